"""compose.yaml and the image hang together; they can't be built everywhere, so they are read."""

import re
from typing import Any

import pytest
import yaml
from django.conf import settings

from arena.config.env import Environment, read_environment
from arena.serving.stack import Web, background, web_server
from tests.house.source import PRODUCT
from tests.processes import ROOT
from tests.stack import free_port


@pytest.fixture(scope="module")
def services() -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((ROOT / "compose.yaml").read_text())["services"]
    return found


def seconds(period: str) -> float:
    assert period.endswith("s")
    return float(period.removesuffix("s"))


@pytest.mark.parametrize("name", ["web", "worker", "render-worker"])
def test_nobody_starts_before_the_tables_are_there(services: dict[str, Any], name: str) -> None:
    waits_for = services[name]["depends_on"]
    assert waits_for["prepare"] == {"condition": "service_completed_successfully"}
    assert services["prepare"]["command"] == "python manage.py prepare"


@pytest.mark.django_db
def test_each_has_as_long_to_stop_as_serve_gives_it(services: dict[str, Any]) -> None:
    *_, worker = background(concurrency=4)
    web = web_server(Web(port=free_port()))
    assert settings.LLM_TIMEOUT_S == 120, "compose.yaml counts on the default"
    assert seconds(services["worker"]["stop_grace_period"]) >= worker.grace_s
    assert seconds(services["web"]["stop_grace_period"]) >= web.grace_s


@pytest.mark.django_db
@pytest.mark.parametrize(
    ("cores", "concurrency", "workers", "threads"), [(2, 4, 2, 2), (2, 3, 2, 2), (8, 3, 3, 1)]
)
def test_work_runs_in_as_many_processes_as_there_are_cores(
    monkeypatch: pytest.MonkeyPatch, cores: int, concurrency: int, workers: int, threads: int
) -> None:
    monkeypatch.setattr("os.cpu_count", lambda: cores)
    programs = [one for one in background(concurrency=concurrency) if one.name == "worker"]
    lines = [" ".join(one.arguments) for one in programs]
    names = [f"--hostname worker{number + 1}@%h" for number in range(workers)]
    assert all(name in line for name, line in zip(names, lines, strict=True))
    assert all(f"--concurrency {threads} " in line for line in lines)


def test_every_queue_has_a_worker_that_is_probed(services: dict[str, Any]) -> None:
    taken: list[str] = []
    for name in ("worker", "render-worker"):
        words = services[name]["command"].split()
        queues = words[words.index("--queues") + 1].split(",")
        taken += queues
        assert words[words.index("--hostname") + 1] == f"{queues[0]}@%h"
        probe = services[name]["healthcheck"]["test"][1]
        assert f"--destination {queues[0]}@$$HOSTNAME" in probe
    assert sorted(taken) == sorted(settings.CELERY_TASK_QUEUES)


def test_what_the_env_file_leaves_empty_is_as_if_it_were_not_there(
    services: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    ours = ("prepare", "web", "worker", "render-worker")
    assert {services[name]["env_file"] for name in ours} == {".env"}, "with keys of models"
    names = services["web"]["environment"].keys() & Environment.model_fields.keys()
    assert {"ARENA_HOSTS", "ARENA_PROXIES", "ARENA_LOG_FORM", "ARENA_METRICS_TOKEN"} <= names
    for name in (*names, "ARENA_VAR_DIR"):  # tests have one of their own
        monkeypatch.setenv(name, "")
    assert read_environment() == Environment.model_validate({})


def test_the_image_runs_as_nobody_special() -> None:
    lines = (ROOT / "Dockerfile").read_text().splitlines()
    assert lines.index("USER arena") < next(
        number for number, line in enumerate(lines) if line.startswith("CMD")
    )


def test_the_image_gets_by_name_what_the_product_reads_and_nothing_else() -> None:
    copied = re.findall(r"^COPY (.+) \S+$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    names = {name for line in copied for name in line.split()}
    sources = [path.read_text() for package in PRODUCT for path in (ROOT / package).rglob("*.py")]
    read = set(re.findall(r'BASE_DIR / "([\w.]+)"', "".join(sources))) - {"var", "media"}
    assert {"templates", "fixtures", "pyproject.toml"} <= read
    assert names == read | {*PRODUCT, "requirements.txt"}
    ignored = (ROOT / ".dockerignore").read_text().split()
    assert ignored[0] == "*"
    assert {line[1:] for line in ignored if line.startswith("!")} == names
    assert "**/.env*" in ignored


def test_kubernetes_runs_what_compose_runs(services: dict[str, Any]) -> None:
    documents = list(yaml.safe_load_all((ROOT / "kubernetes.yaml").read_text()))
    pods = {
        document["metadata"]["name"]: document["spec"]["template"]["spec"]
        for document in documents
        if document["kind"] in ("Job", "Deployment")
    }
    pairs = {"web": "arena-web", "worker": "arena-models", "render-worker": "arena-drawing"}
    for name, pod in pairs.items():
        command = pods[pod]["containers"][0]["command"][-1]
        assert command.endswith(" ".join(services[name]["command"].split()))
        grace_s = pods[pod]["terminationGracePeriodSeconds"]
        assert grace_s == seconds(services[name]["stop_grace_period"])
        ready = pods[pod]["containers"][0]
        assert {"readinessProbe", "livenessProbe"} <= ready.keys()
        assert "migrate --check" in pods[pod]["initContainers"][0]["command"][-1]
    for pod in pods.values():
        assert pod["securityContext"]["runAsNonRoot"]
        for container in (*pod["containers"], *pod.get("initContainers", ())):
            assert container["securityContext"]["readOnlyRootFilesystem"]
            assert not container["securityContext"]["allowPrivilegeEscalation"]
            assert {"cpu", "memory"} == container["resources"]["limits"].keys()
    assert pods["arena-prepare"]["containers"][0]["command"] == ["python", "manage.py", "prepare"]
    values = [one for one in documents if one["kind"] in ("Secret", "ConfigMap")]
    named = {name for one in values for name in (one.get("stringData") or one["data"])}
    assert named - {"AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "OPENAI_API_KEY"} <= {
        *Environment.model_fields
    }
