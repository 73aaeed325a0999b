"""Our ratings beside FastChat's, choix's and evalica's, in one run.

    python -m bench.rating_speed [SIZES]       for example S or SM; all by default

Every rival runs in a process and an environment of its own, made in .bench/ratings from a lock
file. Writes the table into docs/benchmarks.md and arena-rank's answers, for the tests to compare
ours with, into tests/rating/arena_rank.json. What a rival can't do in the time is measured on
fewer rounds and multiplied, and marked so.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from arena.rating import bradley_terry, sandwich
from arena.rating.bootstrap import Unit
from arena.rating.comparisons import Comparisons, count_pairs
from arena.rating.leaderboard import Method, rate
from arena.rating.sandwich import bradley_terry_pulls
from bench.rating_sizes import SIZES, Votes, drawn
from bench.report import load, table, write_section
from bench.rivals.environments import RIVALS, ROOT, NotInstalled, python_of

HEADING = "Rating votes, side by side with other packages"
ANSWERS = ROOT / "tests" / "rating" / "arena_rank.json"
RUNNER = RIVALS / "ratings" / "runner.py"
ROUNDS = 1000
LONGEST_S = 150
LAUNCHER = """
import resource, subprocess, sys, time
began = time.perf_counter()
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
print(time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""
"""A new process counts the memory of the one that started it as its own: this one is small."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """A rival on a size: how many rounds are really run, and how many calls; the first is cold."""

    rival: str
    size: str
    rounds: int
    calls: int = 3


BRADLEY_TERRY = "Bradley-Terry, 1000 resamples of votes"
CLOSED_FORM = "Bradley-Terry, intervals in closed form"
ONLINE = "online Elo, 1000 resamples"


TASKS = {
    BRADLEY_TERRY: (
        Task(rival="fastchat-bt", size="S", rounds=20),
        Task(rival="fastchat-bt", size="M", rounds=3, calls=2),
        Task(rival="choix", size="S", rounds=ROUNDS),
        Task(rival="choix", size="M", rounds=ROUNDS),
        Task(rival="choix", size="L", rounds=100, calls=2),
        Task(rival="evalica-bt", size="S", rounds=ROUNDS),
        Task(rival="evalica-bt", size="M", rounds=100, calls=2),
        Task(rival="evalica-bt", size="L", rounds=20, calls=2),
    ),
    CLOSED_FORM: (Task(rival="arena-rank", size="S", rounds=0, calls=2),),
    ONLINE: (
        Task(rival="fastchat-elo", size="S", rounds=20),
        Task(rival="fastchat-elo", size="M", rounds=3, calls=2),
        Task(rival="evalica-elo", size="S", rounds=ROUNDS),
        Task(rival="evalica-elo", size="M", rounds=20, calls=2),
    ),
}
"""What is not here can't be done: evalica's Elo holds all rounds at once (about 190 GB for L),
FastChat a matrix of votes by contestants (5 GB for L). arena-rank is asked for its answer alone:
each of its calls here compiles anew."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """Seconds for all rounds, warm and for the first call, and megabytes of the process."""

    warm_s: float
    first_s: float
    memory_mb: float | None = None
    extrapolated: bool = False

    def text(self, ours: float | None = None) -> str:
        seconds = _seconds(self.warm_s) + (" (e)" if self.extrapolated else "")
        return seconds if ours is None else f"{seconds}, {self.warm_s / ours:.0f} x"


def _seconds(value: float) -> str:
    return f"{1000 * value:.3g} ms" if value < 1.0 else f"{value:.3g} s"


def timed(call: Callable[[], object], *, calls: int = 5, longest_s: float = 8.0) -> Measured:
    """Medians of warm calls; few where they are long."""
    took: list[float] = []
    while len(took) < 2 or (len(took) <= calls and sum(took) < longest_s):
        began = time.perf_counter()
        call()
        took.append(time.perf_counter() - began)
    return Measured(first_s=took[0], warm_s=median(took[1:]))


# --- Ours ----------------------------------------------------------------------------------------


def closed_form(votes: Comparisons) -> None:
    """Ratings and their covariance by votes, as arena-rank's."""
    counts = count_pairs(votes)
    strengths = bradley_terry.fit(
        contestants=len(votes.names),
        low=counts.low,
        high=counts.high,
        games=counts.games[None],
        scores=counts.scores[None],
    )[0]
    met = bradley_terry.Meetings(contestants=len(votes.names), low=counts.low, high=counts.high)
    inverse = bradley_terry.inverse_curvature(met, counts.games, strengths)
    sandwich.covariance(votes, bradley_terry_pulls(votes, strengths, inverse), Unit.VOTE)


def ours(name: str, votes: Votes) -> Iterator[tuple[str, Measured]]:
    """What we measure of ours for a size, with its heading."""
    pairs, cells = votes.counted(clusters=False), votes.counted(clusters=True)

    def by_votes(rounds: int, **rules: Any) -> Callable[[], object]:
        return lambda: rate(pairs, unit=Unit.VOTE, rounds=rounds, details=False, **rules)

    yield BRADLEY_TERRY, timed(by_votes(ROUNDS))
    yield CLOSED_FORM, timed(lambda: closed_form(pairs))
    if name != "L":
        yield ONLINE, timed(by_votes(ROUNDS, method=Method.ELO))
    many = 10 * ROUNDS if name == "S" else ROUNDS
    if name == "S":
        yield f"Bradley-Terry, {many:,} resamples of votes", timed(by_votes(many))
    two_way = timed(lambda: rate(cells, rounds=many, details=False))
    yield f"Bradley-Terry, {many:,} two-way resamples", two_way


def process(path: Path) -> Measured:
    """`manage.py rate_csv` from the start of the process to its end."""
    command = [sys.executable, "manage.py", "rate_csv", str(path)]
    ended = subprocess.run(
        [sys.executable, "-c", LAUNCHER, *command],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    took, kilobytes = map(float, ended.stdout.split())
    return Measured(warm_s=took, first_s=took, memory_mb=kilobytes / 1024.0)


# --- Rivals --------------------------------------------------------------------------------------


def rival(python: Path, task: Task, path: Path) -> tuple[Measured, dict[str, Any]] | str:
    """What a rival took and answered, or why there is nothing."""
    try:
        ended = subprocess.run(
            [str(python), str(RUNNER), task.rival, str(path), str(task.rounds), str(task.calls)],
            capture_output=True,
            text=True,
            timeout=LONGEST_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"over {LONGEST_S} s"
    if ended.returncode:
        said = ended.stderr.strip().splitlines() or ["nothing said"]
        return f"failed: {said[-1][:80]}"
    found = json.loads(ended.stdout.strip().splitlines()[-1])
    factor = ROUNDS / task.rounds if task.rounds else 1.0
    seconds = [factor * one for one in found["seconds"]]
    measured = Measured(
        first_s=seconds[0],
        warm_s=median(seconds[1:]),
        memory_mb=found["memory_mb"],
        extrapolated=factor != 1.0,
    )
    return measured, found["ratings"]


def keep_answer(votes: Votes, name: str, ratings: dict[str, Any]) -> None:
    """Store arena-rank's answer with the counts that it was given."""
    counts = count_pairs(votes.counted(clusters=False))
    kept = json.loads(ANSWERS.read_text()) if ANSWERS.exists() else {}
    kept["what"] = "arena-rank 0.1.1 with its defaults; pairs: low, high, wins, ties, losses"
    pairs = zip(counts.low.tolist(), counts.high.tolist(), counts.outcomes.tolist(), strict=True)
    kept[name] = {
        "pairs": [[low, high, *outcomes] for low, high, outcomes in pairs],
        **{kind: [round(value, 4) for value in values] for kind, values in ratings.items()},
    }
    ANSWERS.write_text(json.dumps(kept) + "\n")


# --- The table -----------------------------------------------------------------------------------


Found = dict[tuple[str, str, str], Measured | str]


def measure(names: str) -> Found:
    """By heading, who and size."""
    found: Found = {}
    try:
        python: Path | None = python_of("ratings")
    except NotInstalled as error:
        print(error, flush=True)
        python = None
    with tempfile.TemporaryDirectory() as folder:
        for size in (one for one in SIZES if one.name in names):
            votes, path = drawn(size), Path(folder) / f"{size.name}.npz"
            votes.save(path)
            for heading, measured in ours(size.name, votes):
                found[heading, "ours", size.name] = measured
                print(f"{size.name}: ours, {heading}: {measured.text()}", flush=True)
            for clusters in (False, True):
                sheet = Path(folder) / "votes.csv"
                votes.save_csv(sheet, clusters=clusters)
                heading = "rate_csv, from a CSV file to the table"
                heading += ", two-way" if clusters else ", votes"
                found[heading, "ours", size.name] = process(sheet)
            for heading, tasks in TASKS.items():
                for task in tasks:
                    if task.size == size.name and python is not None:
                        answer = rival(python, task, path)
                        said = answer if isinstance(answer, str) else answer[0]
                        if task.rival != "arena-rank":
                            found[heading, task.rival, size.name] = said
                        elif not isinstance(answer, str):
                            keep_answer(votes, size.name, answer[1])
                        shown = said if isinstance(said, str) else said.text()
                        print(f"{size.name}: {task.rival}: {shown}", flush=True)
    return found


def section(found: Found, names: str, before: str) -> str:
    """The text for docs/benchmarks.md."""
    rows = []
    lines = list(dict.fromkeys((heading, who) for heading, who, _ in found))
    headings = list(dict.fromkeys(heading for heading, _ in lines))
    for heading, who in sorted(lines, key=lambda line: headings.index(line[0])):
        cells = []
        for name in names:
            measured = found.get((heading, who, name), "-")
            mine = found.get((heading, "ours", name))
            if isinstance(measured, str):
                cells.append(measured)
                continue
            other = mine.warm_s if isinstance(mine, Measured) and who != "ours" else None
            memory = f", {measured.memory_mb:.0f} MB" if measured.memory_mb else ""
            cells.append(measured.text(other) + memory)
        rows.append([heading, who, *cells])
    sizes = "; ".join(
        f"{one.name} {one.votes:,} votes on {one.contestants}"
        for one in SIZES
        if one.name in names
    )
    return (
        "`python -m bench.rating_speed` (in `make bench`): warm medians, for rivals "
        "with how many times ours they take, and the most memory their process held. "
        f"{sizes}; simulated. Ours start from counts, rivals from what they take (data frames, "
        f"lists). (e): fewer rounds run, and multiplied. {before}.\n\n"
        + table(["what", "who", *names], rows)
        + "\n\nRivals at their best: choix starts every round at the ratings of the data, evalica "
        "rates counts with weights instead of single votes. "
        "A dash can't be done. arena-rank is not in the table: its bootstrap hangs on Linux as "
        "published."
    )


def main() -> None:
    names = sys.argv[1] if len(sys.argv) > 1 else "SML"
    before = load()
    text = section(measure(names), names, before)
    print(text)
    write_section(HEADING, text)


if __name__ == "__main__":
    main()
