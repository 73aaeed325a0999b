"""How often 95 % intervals contain the truth, over simulated studies: `docs/coverage.md`.

    python -m tests.benchmarks.coverage_study [STUDIES] [--write]

Numbers of experts, votes and sizes of effects as in `EXPERTS`, `VOTES` and `EFFECTS`, with the
paper's nine ratings and with nine equals. All of it is simulated; 250 studies a row take a
quarter of an hour of one processor.
"""

from __future__ import annotations

import argparse
import re
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import DidNotConverge
from arena.rating.comparisons import Comparisons, FloatArray
from arena.rating.leaderboard import Intervals, Leaderboard, rate
from tests.benchmarks.worlds import World, paper_ratings

EXPERTS = (3, 5, 9, 12, 20)
VOTES = (40, 200, 480)
EFFECTS = ((0.0, 0.0), (100.0, 40.0), (0.0, 80.0), (100.0, 80.0))
ROUNDS = 1000
RESAMPLED_ROUNDS = 400
PAGE = Path(__file__).resolve().parents[2] / "docs" / "coverage.md"

DEFAULT, PLAIN = "closed form, default", "plain sandwich, t"
RESAMPLED, PAPERS = "two-way resamples", "paper's mode"
METHODS = (DEFAULT, PLAIN, RESAMPLED, PAPERS)


@dataclass(slots=True)
class Tally:
    """How often intervals held the truth, and how wide they were."""

    held: int = 0
    seen: int = 0
    half_widths: float = 0.0

    def add(self, truth: FloatArray, lower: FloatArray, upper: FloatArray) -> None:
        """Intervals without one of their ends say nothing of widths and are left out."""
        known = ~(np.isnan(lower) | np.isnan(upper))
        inside = (lower <= truth) & (truth <= upper)
        self.held += int(inside[known].sum())
        self.seen += int(known.sum())
        self.half_widths += float((upper - lower)[known].sum() / 2.0)

    @property
    def coverage(self) -> float:
        return self.held / self.seen

    @property
    def half_width(self) -> float:
        return self.half_widths / self.seen

    def __str__(self) -> str:
        return f"{self.coverage:.1%} ±{self.half_width:.0f}" if self.seen else "none"


@dataclass(slots=True)
class Found:
    """What studies of one world said.

    Attributes:
        intervals: By method.
        hardest: The default's of the controversial contestants alone.
        ranks_held: Contestants whose true place is in their rank set, of so many `ranked`.
        all_ranks_held: Studies in which all of them are.
        false: Studies in which a pair was wrongly told apart.
        studies: How many there were, without those whose votes determine no ratings.
    """

    intervals: dict[str, Tally] = field(
        default_factory=lambda: {name: Tally() for name in METHODS}
    )
    hardest: Tally = field(default_factory=Tally)
    ranked: int = 0
    ranks_held: int = 0
    all_ranks_held: int = 0
    places: int = 0
    false: int = 0
    studies: int = 0

    @property
    def ranks(self) -> str:
        return f"{self.ranks_held / self.ranked:.1%} {self.places / self.ranked:.1f}"


def bounds(board: Leaderboard, *, check: bool = False) -> tuple[FloatArray, FloatArray]:
    """(C,), (C,); NaN where there is none."""
    kinds = ("check_lower", "check_upper") if check else ("lower", "upper")
    lower, upper = (
        np.array([getattr(line, kind) for line in board.lines], dtype=np.float64) for kind in kinds
    )
    return lower, upper


def study(world: World, *, studies: int, methods: tuple[str, ...] = METHODS) -> Found:
    """What studies with seeds 0, 1, 2 and so on say of a world."""
    found, truth = Found(), world.truth()
    for seed in range(studies):
        votes = world.votes(np.random.default_rng(seed))
        try:
            board = rate(votes, rounds=ROUNDS, seed=seed)
        except DidNotConverge:
            continue
        if any(line.rating is None for line in board.lines):
            continue
        found.studies += 1
        found.intervals[DEFAULT].add(truth, *bounds(board))
        found.intervals[PLAIN].add(truth, *bounds(board, check=True))
        hard = list(world.controversial)
        found.hardest.add(truth[hard], *(one[hard] for one in bounds(board)))
        _add_ranks(found, board, truth)
        for name, unit in ((RESAMPLED, Unit.TWO_WAY), (PAPERS, Unit.VOTE)):
            if name in methods:
                found.intervals[name].add(truth, *bounds(_resampled(votes, unit, seed)))
    return found


def _resampled(votes: Comparisons, unit: Unit, seed: int) -> Leaderboard:
    rounds = RESAMPLED_ROUNDS
    way = Intervals.RESAMPLES
    return rate(votes, unit=unit, intervals=way, rounds=rounds, seed=seed, details=False)


def _add_ranks(found: Found, board: Leaderboard, truth: FloatArray) -> None:
    """True places; equals share theirs, and whoever is told apart from an equal is wrong."""
    close = 1e-6
    best = 1 + (truth[:, None] > truth[None, :] + close).sum(axis=0)
    worst = len(truth) - (truth[:, None] < truth[None, :] - close).sum(axis=0)
    before = found.ranked - found.ranks_held
    for line, first, last in zip(board.lines, best, worst, strict=True):
        if line.rank_best is not None and line.rank_worst is not None:
            found.ranked += 1
            found.ranks_held += line.rank_best <= first and last <= line.rank_worst
            found.places += line.rank_worst - line.rank_best + 1
    found.all_ranks_held += found.ranked - found.ranks_held == before
    if board.separation is not None:
        wrong = board.separation.above & (truth[:, None] < truth[None, :] + close)
        found.false += bool(wrong.any())


def lines(studies: int, numbers: tuple[int, ...] = EXPERTS) -> Iterator[str]:
    """The big table, row by row, for numbers of experts."""
    heads = ("experts x votes", "scenario / expert", *METHODS, "rank sets", "false separations")
    yield "| " + " | ".join(heads) + " |"
    yield "|---" * len(heads) + "|"
    equal = np.full(len(paper_ratings()), 1000.0)
    for experts in numbers:
        for votes in VOTES:
            for scenario_sd, expert_sd in EFFECTS:
                world = World(
                    ratings=paper_ratings(),
                    scenario_sd=scenario_sd,
                    expert_sd=expert_sd,
                    experts=experts,
                    votes_per_expert=votes,
                )
                found = study(world, studies=studies)
                alike = study(replace(world, ratings=equal), studies=studies, methods=())
                cells = [
                    f"{experts} x {votes}",
                    f"{scenario_sd:.0f} / {expert_sd:.0f}",
                    *(str(found.intervals[name]) for name in METHODS),
                    found.ranks,
                    f"{alike.false / alike.studies:.1%}",
                ]
                yield "| " + " | ".join(cells) + " |"


def controversial_lines(studies: int) -> Iterator[str]:
    """One contestant about whom experts differ four times as much (160 points against 40)."""
    heads = ("experts x votes", DEFAULT, "of the one contestant", PLAIN)
    yield "| " + " | ".join(heads) + " |"
    yield "|---" * len(heads) + "|"
    for experts in EXPERTS:
        world = World(
            ratings=paper_ratings(),
            scenario_sd=100.0,
            expert_sd=40.0,
            experts=experts,
            votes_per_expert=200,
            controversial=(4,),
        )
        found = study(world, studies=studies, methods=())
        cells = (str(found.intervals[DEFAULT]), str(found.hardest), str(found.intervals[PLAIN]))
        yield f"| {experts} x 200 | " + " | ".join(cells) + " |"


def tied_lines(studies: int) -> Iterator[str]:
    """Rank sets where several are truly equal: nine, or three times three 60 points apart."""
    heads = (
        "experts x votes", "scenario / expert", "equals", "all nine rank sets hold",
        "each set holds, places",
    )  # fmt: skip
    yield "| " + " | ".join(heads) + " |"
    yield "|---" * len(heads) + "|"
    for experts in (5, 9, 20):
        for scenario_sd, expert_sd in EFFECTS[:2]:
            for said, groups in (("nine", 1), ("three, three, three", 3)):
                world = World(
                    ratings=np.repeat(1000.0 + 60.0 * np.arange(groups), 9 // groups),
                    scenario_sd=scenario_sd,
                    expert_sd=expert_sd,
                    experts=experts,
                    votes_per_expert=480,
                )
                found = study(world, studies=studies, methods=())
                cells = (
                    f"{experts} x 480", f"{scenario_sd:.0f} / {expert_sd:.0f}", said,
                    f"{found.all_ranks_held / found.studies:.1%}", found.ranks,
                )  # fmt: skip
                yield "| " + " | ".join(cells) + " |"


def write_table(name: str, text: str) -> None:
    """Replace what stands between the marks of a table."""
    begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
    page = re.sub(
        f"{re.escape(begin)}.*?{re.escape(end)}",
        lambda _: f"{begin}{text}\n{end}",
        PAGE.read_text(),
        flags=re.S,
    )
    PAGE.write_text(page)


def print_tables(tables: Mapping[str, Callable[[int], Iterator[str]]], *, studies: int) -> None:
    """Print tables line by line; with `--write` each goes between its marks in the page.

    Args:
        tables: What gives the lines of each, for so many studies a row.
        studies: How many, unless the command says so.
    """
    parser = argparse.ArgumentParser()
    parser.add_argument("studies", type=int, nargs="?", default=studies)
    parser.add_argument("--write", action="store_true", help="into docs/coverage.md")
    asked = parser.parse_args()
    for name, lines_of in tables.items():
        said = [f"{asked.studies} simulated studies a row.", ""]
        for line in lines_of(asked.studies):
            print(line, flush=True)
            said.append(line)
        if asked.write:
            write_table(name, "\n".join(said))


def main() -> None:
    began = time.process_time()
    tables = {"controversial": controversial_lines, "ties": tied_lines, "worlds": lines}
    print_tables(tables, studies=250)
    print(f"{time.process_time() - began:.0f} s of processor")


if __name__ == "__main__":
    main()
