"""Our own server under load: gunicorn as `manage.py serve` starts it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path

from bench.rivals.environments import ROOT
from bench.rivals.load import Connection, Turn, timed
from bench.rivals.processes import serving

ACCOUNTS_PER_CLIENT = 3
"""The product refuses more than 20 votes in 5 s from one account; so a client takes turns."""

PAUSE_S = 6.0
"""Between two runs, for the same reason."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Arena:
    """A running server with a study; one link a voter.

    Attributes:
        environment: What a process needs that works on the same rows.
    """

    port: int
    pid: int
    environment: dict[str, str]
    study: str
    tokens: list[str]


@contextmanager
def arena(folder: Path, *, port: int, clients: int, votes: int, database: str) -> Iterator[Arena]:
    """The product on a fresh database, with a study that has enough for all votes."""
    folder.mkdir(parents=True, exist_ok=True)
    environment = {
        **os.environ,
        "DJANGO_SETTINGS_MODULE": "arena.config.settings",
        "PYTHONPATH": str(ROOT),
        "DATABASE_URL": database,
        "ARENA_VAR_DIR": str(folder / "var"),
        "ARENA_MEDIA_DIR": str(folder / "media"),
    }
    must([sys.executable, "manage.py", "prepare"], environment)
    voters = clients * ACCOUNTS_PER_CLIENT
    seed = [sys.executable, "-m", "bench.rivals.ours_seed"]
    each = min(200, -(-votes // voters) + 2)
    made = json.loads(must([*seed, str(voters), str(each)], environment).splitlines()[-1])
    gunicorn = [
        *(sys.executable, "-m", "gunicorn", "arena.config.wsgi"),
        *("--worker-class", "arena.serving.web_worker.BufferingWorker"),
        *("--bind", f"127.0.0.1:{port}", "--workers", "2", "--threads", "4"),
        *("--worker-tmp-dir", str(folder), "--no-control-socket"),
    ]
    with serving(
        gunicorn, environment=environment, port=port, path="/login/", log=folder / "web.log"
    ) as pid:
        yield Arena(port=port, pid=pid, environment=environment, **made)


def voters(here: Arena, clients: int) -> list[Turn]:
    """One turn-taker a client: a vote is stored and the next pair comes back in the answer."""
    accounts = [_signed_in(here, token) for token in here.tokens]
    return [_voter(here, accounts[number::clients]) for number in range(clients)]


def pause() -> None:
    time.sleep(PAUSE_S)


def _signed_in(here: Arena, token: str) -> dict[str, str]:
    wire = Connection(here.port)
    page = f"/invitation/{token}/"
    wire.ask("GET", page)
    wire.ask("POST", page, f"csrfmiddlewaretoken={wire.cookies['csrftoken']}", expect=(302,))
    wire.close()
    return wire.cookies


def _voter(here: Arena, accounts: list[dict[str, str]]) -> Turn:
    wire = Connection(here.port)
    asked = f"/api/v1/matchups?study={here.study}&n=1"
    waiting: dict[int, str] = {}
    order = cycle(range(len(accounts)))

    def turn() -> Mapping[str, float]:
        number = next(order)
        wire.cookies = dict(accounts[number])
        if number not in waiting:
            waiting[number] = json.loads(wire.ask("GET", asked))[0]["matchup"]
        body = {"key": str(uuid.uuid4()), "matchup": waiting.pop(number), "outcome": "A", "n": 1}
        found, ms = timed(lambda: wire.ask("POST", "/api/v1/votes", body))
        following = json.loads(found)["next"]
        if following:
            waiting[number] = following[0]["matchup"]
        return {"vote": ms}

    return turn


def must(arguments: list[str], environment: dict[str, str]) -> str:
    """What a command says; it must end well."""
    ended = subprocess.run(
        arguments, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    if ended.returncode:
        raise RuntimeError(ended.stdout + ended.stderr)
    return ended.stdout
