"""The default rating of many contestants, or of many judges: processor time, clock and memory.

    python -m bench.rating_scale [--rows N ...] [--write]
    python -m bench.rating_scale --resamples [--write]   # the paper's mode, beside others

Each row is a process of its own, which makes the votes, rates them with all defaults
and says what rating took; memory is the most that the process ever held, votes
included. One row is a file rated by `manage.py rate_csv`, start of the process and reading
included. All votes are simulated; some experts give many more of them than others. `--write` puts
the table into docs/benchmarks.md.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from arena.rating.comparisons import Comparisons
from arena.rating.leaderboard import Intervals, rate
from bench.environments import make_environment
from bench.report import ROOT, load, table, write_section
from tests.rating.votes import simulated

HEADING = "Bootstrap and closed form, with many contestants"
RESAMPLES_HEADING = "Intervals by resampled votes, beside others"
REPEATS, ROUNDS = 5, 1000
TIES = 0.3
WINNERS = ("model_a", "tie", "model_b")


WHAT = """`python -m bench.rating_scale [--write]` (in `make bench`): `rate(votes)` with
its defaults (two-way, rank sets) each row in a process of its own.
Simulated votes; the experts' numbers of votes differ widely. In brackets: in closed form."""
BELOW = (
    """Targets: 3 s for LLMFAO's size (simulated; the file is not at hand), 0.4 s for the paper's;
    memory at most 1.3 times that of the closed form for a public arena.""",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Crowd:
    """How many of everything."""

    like: str
    votes: int
    contestants: int
    experts: int
    scenarios: int
    from_file: bool = False


CROWDS = (
    Crowd(like="the paper", votes=5760, contestants=9, experts=9, scenarios=50),
    Crowd(like="LLMFAO", votes=8931, contestants=59, experts=124, scenarios=13),
    Crowd(
        like="LLMFAO, as a file, by the command",
        votes=8931,
        contestants=59,
        experts=124,
        scenarios=13,
        from_file=True,
    ),
    Crowd(like="football", votes=49_520, contestants=316, experts=40, scenarios=40),
    Crowd(like="", votes=200_000, contestants=1000, experts=2000, scenarios=500),
    Crowd(like="a public arena", votes=2_000_000, contestants=150, experts=50_000, scenarios=2000),
)


RESAMPLED = (
    Crowd(like="the paper", votes=5760, contestants=9, experts=9, scenarios=50),
    Crowd(like="", votes=100_000, contestants=50, experts=1000, scenarios=50),
    Crowd(like="", votes=2_000_000, contestants=150, experts=1000, scenarios=50),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rival:
    """A package that rates the same votes, by its fastest way to percentile intervals.

    Attributes:
        program: Rates `stored` votes of `size` contestants in `rounds` resamples.
        rounds: As many as it is given time for; its time is told for 1,000.
        is_ours: Installed here, not in the environment of `bench/rivals`.
    """

    program: str
    rounds: int = ROUNDS
    is_ours: bool = True


PROGRAM = """
import resource, sys, time
import numpy as np
stored, rounds = dict(np.load(sys.argv[1])), int(sys.argv[2])
size = int(stored["first"].max()) + 1
def draw_counts(seen):
    # (size,) how often each kind of vote is drawn, round by round
    yield from np.random.default_rng(0).multinomial(seen.sum(), seen / seen.sum(), size=rounds)
def count_cells():
    # how often each first, second and score (0, a half, 1) occurs
    place = (stored["first"] * size + stored["second"]) * 3 + (2 * stored["score"]).astype(int)
    return np.bincount(place, minlength=3 * size**2)
{program}
print(took, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)
"""
"""Imports and a first round are not timed; memory is the most of the whole process."""
RIVALS = {
    "ours": Rival(
        program="""
from arena.rating.comparisons import Comparisons
from arena.rating.leaderboard import Unit, rate
votes = Comparisons(names=tuple(f"c{one}" for one in range(size)), **stored)
rate(votes, unit=Unit.VOTE, rounds=100)
before = time.process_time()
rate(votes, unit=Unit.VOTE, rounds=rounds)
took = time.process_time() - before
"""
    ),
    # Each resample by its fastest method for all pairs, from the one before.
    "choix": Rival(
        program="""
import choix
before, begin, ratings = time.process_time(), None, []
for drawn in draw_counts(count_cells()):
    lost, tied, won = drawn.reshape(size, size, 3).transpose(2, 0, 1)
    wins, losses = won + 0.5 * tied, lost + 0.5 * tied
    begin = choix.ilsr_pairwise_dense(wins + losses.T, alpha=1e-12, initial_params=begin)
    ratings.append(begin)
np.percentile(ratings, [2.5, 97.5], axis=0)
took = time.process_time() - before
"""
    ),
    # Its own bootstrap draws single votes as Python objects; equal ones are weighted here.
    "evalica": Rival(
        program="""
import evalica
before, ratings = time.process_time(), []
seen = count_cells()
cells = np.flatnonzero(seen)
outcomes = (evalica.Winner.Y, evalica.Winner.Draw, evalica.Winner.X)
winners = [outcomes[cell % 3] for cell in cells]
first, second = (cells // 3 // size).tolist(), (cells // 3 % size).tolist()
index = evalica.indexing(range(size), range(size))[2]
for drawn in draw_counts(seen[cells]):
    weights = drawn.astype(float).tolist()
    rated = evalica.bradley_terry(first, second, winners, weights=weights, index=index)
    ratings.append(np.log(rated.scores.reindex(index)))
np.percentile(ratings, [2.5, 97.5], axis=0)
took = time.process_time() - before
""",
        rounds=100,
        is_ours=False,
    ),
    # Its own bootstrap forks a pool, which may wait for JAX's threads for ever: one by one here.
    "arena-rank": Rival(
        program="""
import jax, pandas as pd
from arena_rank.models.bradley_terry import BradleyTerry, fit_single_bootstrap_sample
from arena_rank.utils.data_utils import PairDataset
winner = np.array(["model_b", "tie", "model_a"])[(2 * stored["score"]).astype(int)]
frame = pd.DataFrame(
    {"model_a": stored["first"], "model_b": stored["second"], "winner": winner}
)
data = PairDataset.from_pandas(frame)
model = BradleyTerry(size)
model.fit(data)
before, ratings = time.process_time(), []
for drawn in draw_counts(np.asarray(data.counts).astype(int)):
    fitted = fit_single_bootstrap_sample(jax.numpy.asarray(drawn * 1.0), model, data)
    ratings.append(fitted["ratings"])
np.percentile(ratings, [2.5, 97.5], axis=0)
took = time.process_time() - before
""",
        rounds=5,
        is_ours=False,
    ),
}


def drawn(crowd: Crowd, seed: int = 1) -> Comparisons:
    """Votes whose expected score is exactly logistic."""
    rng = np.random.default_rng(seed)
    elo = rng.normal(1000.0, 100.0, crowd.contestants).tolist()
    votes = simulated(elo, crowd.votes, seed, ties=TIES, scenarios=crowd.scenarios)
    busy = 1.0 / np.arange(1.0, crowd.experts + 1.0) ** 0.7
    expert = rng.choice(crowd.experts, crowd.votes, p=busy / busy.sum())
    return replace(votes, expert=expert)


def measure(crowd: Crowd, intervals: Intervals) -> dict[str, float]:
    """Seconds of processor and clock, and megabytes, in this process or a command's."""
    votes = drawn(crowd)
    who = resource.RUSAGE_CHILDREN if crowd.from_file else resource.RUSAGE_SELF
    with tempfile.TemporaryDirectory() as folder:
        sheet = Path(folder) / "votes.csv"
        if crowd.from_file:
            save_csv(votes, sheet)
        before, began = _processor(who), time.perf_counter()
        if crowd.from_file:
            command = [sys.executable, "manage.py", "rate_csv", str(sheet)]
            command += ["--intervals", intervals.value]
            subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
        else:
            rate(votes, intervals=intervals)
        took = time.perf_counter() - began
    return {
        "processor_s": _processor(who) - before,
        "clock_s": took,
        "memory_mb": resource.getrusage(who).ru_maxrss / 1024.0,
    }


def measure_resamples() -> str:
    """The section on 1,000 vote resamples: rivals take turns, each in a process of its own."""
    before, rows = load(), []
    others = make_environment(Path(__file__).parent / "rivals")
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "votes.npz"
        for crowd in RESAMPLED:
            votes = drawn(crowd)
            columns = ("first", "second", "score", "expert", "scenario")
            np.savez(path, **{column: getattr(votes, column) for column in columns})
            turns: dict[str, list[tuple[float, float]]] = {key: [] for key in RIVALS}
            for key in list(RIVALS) * REPEATS:
                turns[key].append(run_rival(RIVALS[key], path, others))
            medians = {key: np.median(turn, axis=0) for key, turn in turns.items()}
            ours = medians["ours"][0]
            rows.append(
                [f"{crowd.votes:,}", str(crowd.contestants)]
                + [f"{s:,.3g} s ({s / ours:,.3g}), {mb:,.0f} MB" for s, mb in medians.values()]
            )
            print(rows[-1], flush=True)
    fewer = ", ".join(f"{key} {one.rounds}" for key, one in RIVALS.items() if not one.is_ours)
    said = (
        "`python -m bench.rating_scale --resamples [--write]`: the paper's mode, 1,000 resamples "
        "of single votes with percentile intervals. Processor time without start and imports, "
        f"median of {REPEATS} turns (and its ratio to ours), one thread; memory of the whole "
        f"process. Fewer resamples, scaled to 1,000: {fewer}. choix is warm-started on dense "
        f"matrices, evalica gets equal votes as weights, arena-rank compiles each fit; {before}."
    )
    return "\n\n".join([said, table(["votes", "contestants", *RIVALS], rows)])


def run_rival(rival: Rival, votes: Path, others: Path) -> tuple[float, float]:
    """Seconds of processor time for 1,000 resamples, and megabytes."""
    python = sys.executable if rival.is_ours else str(others)
    command = [python, "-c", PROGRAM.replace("{program}", rival.program), str(votes)]
    ended = subprocess.run(
        [*command, str(rival.rounds)], cwd=ROOT, check=True, stdout=subprocess.PIPE
    )
    seconds, megabytes = map(float, ended.stdout.split())
    return seconds * ROUNDS / rival.rounds, megabytes


def save_csv(votes: Comparisons, path: Path) -> None:
    """One line a vote, for rate_csv."""
    outcome = (2.0 - 2.0 * votes.score).astype(int).tolist()
    columns = (votes.first, votes.second, votes.expert, votes.scenario)
    rows = zip(*(column.tolist() for column in columns), outcome, strict=True)
    lines = [f"c{a},c{b},{WINNERS[won]},judge {e},item {s}" for a, b, e, s, won in rows]
    path.write_text("\n".join(["model_a,model_b,winner,judge,item", *lines]) + "\n")


def _processor(who: int) -> float:
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def section(rows: list[list[str]], before: str) -> str:
    """The text for docs/benchmarks.md."""
    heads = ["votes, contestants, experts, scenarios", "like", "processor", "clock", "memory"]
    said = f"{' '.join(WHAT.split())} {before}."
    return "\n\n".join([said, table(heads, rows), *(" ".join(one.split()) for one in BELOW)])


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--rows", type=int, nargs="+", default=range(len(CROWDS)))
    parser.add_argument("--write", action="store_true", help="into docs/benchmarks.md")
    parser.add_argument("--one", type=int, help="measure a row in this process, and print JSON")
    parser.add_argument("--closed", action="store_true", help="of that row, in closed form")
    parser.add_argument("--resamples", action="store_true", help="the paper's mode, beside others")
    asked = parser.parse_args()
    if asked.resamples:
        text = measure_resamples()
        if asked.write:
            write_section(RESAMPLES_HEADING, text)
        return
    if asked.one is not None:
        way = Intervals.CLOSED_FORM if asked.closed else Intervals.BOOTSTRAP
        print(json.dumps(measure(CROWDS[asked.one], way)))
        return
    before, rows = load(), []
    for number in asked.rows:
        command = [sys.executable, "-m", "bench.rating_scale", "--one", str(number)]
        ways = []
        for more in ([], ["--closed"]):
            ended = subprocess.run(
                [*command, *more], cwd=ROOT, check=True, capture_output=True, text=True
            )
            ways.append(json.loads(ended.stdout))
        (found, closed), crowd = ways, CROWDS[number]
        counts = (crowd.votes, crowd.contestants, crowd.experts, crowd.scenarios)
        rows.append(
            [
                ", ".join(f"{one:,}" for one in counts),
                crowd.like,
                f"{found['processor_s']:.2g} s ({closed['processor_s']:.2g} s)",
                f"{found['clock_s']:.2g} s ({closed['clock_s']:.2g} s)",
                f"{found['memory_mb']:.0f} MB ({closed['memory_mb']:.0f} MB)",
            ]
        )
        print(rows[-1], flush=True)
    text = section(rows, before)
    if asked.write:
        write_section(HEADING, text)


if __name__ == "__main__":
    main()
