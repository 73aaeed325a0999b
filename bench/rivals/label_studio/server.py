"""Label Studio under load: pairs of images, 8 annotators, as its own documentation sets it up."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from bench.rivals.load import Connection, Turn, timed
from bench.rivals.processes import serving

EMAIL, PASSWORD = "person0@bench.example", "bench-pass-1"
CONFIG = """<View>
  <Text name="instruction" value="$instruction"/>
  <Pairwise name="pw" toName="left,right"/>
  <Image name="left" value="$left"/><Image name="right" value="$right"/>
</View>"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Studio:
    """A running server with a project of pairs."""

    port: int
    pid: int
    project: int
    admin: str
    annotators: list[str]


@contextmanager
def studio(
    python: Path,
    folder: Path,
    *,
    port: int,
    tasks: int,
    annotators: int,
    postgres_socket: Path | None,
) -> Iterator[Studio]:
    """Label Studio on a fresh database: as pip leaves it, or on PostgreSQL behind gunicorn."""
    folder.mkdir(parents=True, exist_ok=True)
    package = next(python.parents[1].glob("lib/python3*/site-packages/label_studio"))
    environment = _environment(folder, package, port, postgres_socket)
    _must([str(python), str(package / "manage.py"), "migrate"], environment)
    seed = str(Path(__file__).with_name("seed.py"))
    made = json.loads(_must([str(python), seed, str(annotators)], environment).splitlines()[-1])
    with serving(
        _command(python, folder, port, postgres_socket),
        environment=environment,
        port=port,
        path="/health",
        log=folder / "web.log",
    ) as pid:
        project = _project(port, made["admin"], tasks, annotators)
        yield Studio(port=port, pid=pid, project=project, **made)


def annotators_of(here: Studio) -> list[Turn]:
    """One turn-taker an annotator: fetch the next task, submit the answer."""
    return [_annotator(here, token) for token in here.annotators]


def _environment(
    folder: Path, package: Path, port: int, postgres_socket: Path | None
) -> dict[str, str]:
    found = {
        **os.environ,
        "DJANGO_SETTINGS_MODULE": "core.settings.label_studio",
        "PYTHONPATH": f"{package}:{package.parent}",
        "LABEL_STUDIO_BASE_DATA_DIR": str(folder),
        "LABEL_STUDIO_HOST": f"http://127.0.0.1:{port}",
        "COLLECT_ANALYTICS": "false",
        "LATEST_VERSION_CHECK": "false",
        "SENTRY_DSN": "",
        "FRONTEND_SENTRY_DSN": "",
        "DJANGO_DB": "sqlite",
    }
    if postgres_socket is not None:
        found |= {"DJANGO_DB": "default", "POSTGRE_HOST": str(postgres_socket)}
        # Two indexes for searching, which our wheel's PostgreSQL has no extension for: its own
        # switches leave them out, and a write has less to do.
        found |= {"SKIP_TRIGRAM_EXTENSION": "full", "SKIP_BTREE_GIN_EXTENSION": "full"}
    return found


def _command(python: Path, folder: Path, port: int, postgres_socket: Path | None) -> list[str]:
    if postgres_socket is None:
        started = [str(python.with_name("label-studio")), "start", "--no-browser"]
        return [*started, "--port", str(port), "--data-dir", str(folder)]
    return [
        *(str(python), "-m", "gunicorn", "core.wsgi"),
        *("--bind", f"127.0.0.1:{port}", "--workers", "2", "--threads", "4"),
    ]


def _project(port: int, token: str, tasks: int, annotators: int) -> int:
    wire = Connection(port, {"Authorization": f"Token {token}"})
    settings = {
        "title": "Bench",
        "label_config": CONFIG,
        "maximum_annotations": annotators,
        "sampling": "Sequential sampling",
    }
    project = int(json.loads(wire.ask("POST", "/api/projects/", settings, expect=(201,)))["id"])
    given = [
        {
            "data": {
                "instruction": f"Pair {n}",
                "left": f"/static/{n}a.png",
                "right": f"/static/{n}b.png",
            }
        }
        for n in range(tasks)
    ]
    wire.ask("POST", f"/api/projects/{project}/import", given, expect=(201,))
    wire.close()
    return project


def _annotator(here: Studio, token: str) -> Turn:
    wire = Connection(here.port, {"Authorization": f"Token {token}"})
    value = {"from_name": "pw", "to_name": "left,right", "type": "pairwise", "id": "choice"}
    result = [{**value, "value": {"selected": "left"}}]

    def turn() -> Mapping[str, float]:
        found, next_ms = timed(lambda: wire.ask("GET", f"/api/projects/{here.project}/next"))
        task = json.loads(found)["id"]
        body = {"result": result, "lead_time": 3.0}
        _, submit_ms = timed(
            lambda: wire.ask("POST", f"/api/tasks/{task}/annotations/", body, expect=(201,))
        )
        return {"next": next_ms, "submit": submit_ms, "vote": next_ms + submit_ms}

    return turn


def _must(arguments: list[str], environment: dict[str, str]) -> str:
    ended = subprocess.run(arguments, env=environment, capture_output=True, text=True, check=False)
    if ended.returncode:
        raise RuntimeError(ended.stdout[-2000:] + ended.stderr[-2000:])
    return ended.stdout
