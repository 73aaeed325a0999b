"""The demo refuses what makes no sense, and runs a model of one's own within a cap."""

from collections.abc import Iterator

import pytest
from django.core.management import CommandError, call_command

from arena.management.commands.demo import add_model, finish, launch_model, wait_for
from augment.errors import AugmentError
from augment.fake_llm.server import running
from augment.models import Contestant, Endpoint, ModelCall
from augment.services.endpoints import EndpointRequest
from augment.services.running.jobs import finish_if_over
from augment.services.running.runner import AUGMENTATIONS
from augment.services.scenarios.prompts import find_stored_tasks
from tests.brokers import Broker
from tests.jobs.rows import INSTRUCTION, add_scenario


@pytest.mark.parametrize(("given", "says"), [("0", "1 or more"), ("few", "no whole number")])
def test_a_number_that_makes_no_sense_is_refused(given: str, says: str) -> None:
    with pytest.raises(CommandError, match=says):
        call_command("demo", f"--per-type={given}")


@pytest.fixture
def address() -> Iterator[str]:
    with running(known=find_stored_tasks) as server:
        yield server.url


@pytest.mark.django_db(transaction=True)
@pytest.mark.parametrize(
    ("base_url", "model", "key", "says"),
    [
        (None, "fake-best", "", r"fake-best at .* can’t be asked: .* 404 .*It lists: fake-429, "),
        ("http://127.0.0.1:1/v1", "any", "", "any at .* can’t be asked: .* URL right, up to /v1"),
        ("127.0.0.1:1", "any", "", "base_url: an address such as"),
        (None, "fake-good", "sk-secret", "key_variable: the name of an environment variable"),
    ],
)
def test_a_model_that_cannot_be_asked_is_refused_and_leaves_no_row(
    address: str, base_url: str | None, model: str, key: str, says: str
) -> None:
    request = EndpointRequest(base_url=base_url or address, key_variable=key)
    with pytest.raises(AugmentError, match=says):
        add_model(request, model)
    assert not Endpoint.objects.exists()
    assert not Contestant.objects.exists()


@pytest.mark.django_db(transaction=True)
@pytest.mark.parametrize("sees", [True, False])
def test_a_model_of_ones_own_runs_within_its_cap(
    address: str, broker: Broker, monkeypatch: pytest.MonkeyPatch, sees: bool
) -> None:
    request = EndpointRequest(base_url=address)
    elsewhere = EndpointRequest(base_url=address.replace("127.0.0.1", "localhost"))
    own = add_model(request, "fake-good" if sees else "fake-no-vision")
    variants = [slug.rsplit("-", 1)[1] for slug in own.contestants]
    assert variants == ["otm", "fc", "tqa", *(["vqa"] if sees else [])]
    assert add_model(request, own.name) == own
    assert add_model(elsewhere, own.name).name == f"{own.name}-2"
    assert not Contestant.objects.get(slug=own.contestants[0]).is_simulated
    for slug in ("near", "far"):
        add_scenario(slug, instruction=f"{INSTRUCTION} It is {slug}.")
    monkeypatch.setattr("arena.management.commands.demo.CALLS_PER_SCENARIO", 10)
    lines: list[str] = []
    job = launch_model(own, ["near", "far"], lines.append)
    assert "on 2 scenarios" in lines[0]
    assert launch_model(own, ["near", "far"], lines.append) == job

    def work_on_one() -> None:
        waiting = job.augmentations.filter(state="queued").order_by("pk")
        assert AUGMENTATIONS.perform(waiting[0].pk)
        finish_if_over(job_pk=job.pk)

    if not sees:
        job.augmentations.filter(scenario__slug="near").update(state="failed", reason="too long")
        monkeypatch.setattr("arena.management.commands.demo.retry_failed", lambda job: None)
    complete = finish(job, lines.append, work_on_one)
    asked = ModelCall.objects.filter(served_from=None).count()
    assert asked + own.probe_calls <= 20
    assert complete == (["near"] if sees else ["far"])
    assert sees or lines[-1].endswith("of what failed: too long")
    states = set(job.augmentations.values_list("state", flat=True))
    assert states == {"done", "cancelled" if sees else "failed"}


def test_what_workers_do_is_waited_for_while_it_gets_less(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("arena.management.commands.demo.STUCK_S", 0.0)
    for left, ends_with in (([3, 2, 0], 0), ([3, 3, 3, 0], 3)):
        assert wait_for(iter(left).__next__, lambda: None) == ends_with
