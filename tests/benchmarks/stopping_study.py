"""What stopping rules do to intervals, over simulated studies: `docs/coverage.md`.

    python -m tests.benchmarks.stopping_study [STUDIES] [--write]

Votes come in as the plan has them, all experts at the same pace. One rule looks as
`arena.rating.stopping` does; the other, as people do by hand, at every twentieth of the votes at
the ordinary intervals. Both stop when the widest interval is narrow enough, or at the last vote.
All of it is simulated; 60 studies a row take some minutes of one processor.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from arena.rating.comparisons import BoolArray, Comparisons, FloatArray, select_votes
from arena.rating.leaderboard import Leaderboard, rate
from arena.rating.stopping import StoppingRule, look_levels, widest_half_width
from tests.benchmarks.coverage_study import bounds, print_tables
from tests.benchmarks.worlds import World, paper_ratings

ROWS = ((9, 0.0, 0.0, 30.0), (9, 100.0, 40.0, 45.0), (20, 0.0, 0.0, 22.0), (20, 100.0, 40.0, 35.0))
"""Experts, effects, wanted half-width: reached about half-way."""
VOTES = 200
HAND_LOOKS = 20
ROUNDS = 60


def _rated(votes: Comparisons, number: int, seed: int) -> Leaderboard:
    return rate(select_votes(votes, np.arange(number)), rounds=ROUNDS, seed=seed)


def _in_time(votes: Comparisons, experts: int) -> Comparisons:
    """By the place in each expert's order, one expert after the other."""
    place = np.concatenate([np.arange((votes.expert == one).sum()) for one in range(experts)])
    return select_votes(votes, np.argsort(place, kind="stable"))


def _row(experts: int, scenario_sd: float, expert_sd: float, wanted: float, studies: int) -> str:
    world = World(
        ratings=paper_ratings(), scenario_sd=scenario_sd, expert_sd=expert_sd, experts=experts,
        votes_per_expert=VOTES,
    )  # fmt: skip
    truth, planned = world.truth(), experts * VOTES
    rule = StoppingRule(half_width=wanted)
    points = rule.look_votes(planned)
    levels = look_levels([point / planned for point in points])
    held: dict[str, list[Any]] = {"all looks": [], "rule": [], "hand": []}
    used: dict[str, list[int]] = {"rule": [], "hand": []}
    for seed in range(studies):
        votes = _in_time(world.votes(np.random.default_rng(seed)), experts)
        boards = [_rated(votes, point, seed) for point in points]
        held["all looks"].append(
            [_holds(board, level, truth) for board, level in zip(boards, levels, strict=True)]
        )
        stops = [
            _narrow(board, level, wanted) for board, level in zip(boards, levels, strict=True)
        ]
        stop = stops.index(True) if True in stops else len(points) - 1
        used["rule"].append(points[stop])
        held["rule"].append(_holds(boards[stop], 0.05, truth))
        for number in range(planned // HAND_LOOKS, planned + 1, planned // HAND_LOOKS):
            board = _rated(votes, number, seed)
            if _narrow(board, 0.05, wanted) or number == planned:
                used["hand"].append(number)
                held["hand"].append(_holds(board, 0.05, truth))
                break
    together = np.mean(np.all(held["all looks"], axis=1))
    cells = [
        f"{experts} x {VOTES}", f"{scenario_sd:.0f} / {expert_sd:.0f}", f"±{wanted:.0f}",
        f"{together:.1%}", f"{np.mean(used['rule']):,.0f}", f"{np.mean(held['rule']):.1%}",
        f"{np.mean(used['hand']):,.0f}", f"{np.mean(held['hand']):.1%}",
    ]  # fmt: skip
    return "| " + " | ".join(cells) + " |"


def _narrow(board: Leaderboard, level: float, wanted: float) -> bool:
    widest = widest_half_width(board, level)
    return widest is not None and widest <= wanted


def _holds(board: Leaderboard, level: float, truth: FloatArray) -> BoolArray:
    """(C,) whether intervals of such a level hold the truth; those without one say nothing."""
    lower, upper = bounds(board)
    middle, half = (lower + upper) / 2.0, (upper - lower) / 2.0
    if level != 0.05:
        usual, wide = widest_half_width(board, 0.05), widest_half_width(board, level)
        half = half * (wide / usual if usual and wide else np.inf)
    return np.asarray(np.isnan(half) | (np.abs(truth - middle) <= half), dtype=np.bool_)


def lines(studies: int) -> Iterator[str]:
    heads = (
        "experts x votes", "scenario / expert", "wanted", "all five looks hold together",
        "rule: votes used", "its 95 % intervals hold", "by hand: votes used",
        "its 95 % intervals hold",
    )  # fmt: skip
    yield "| " + " | ".join(heads) + " |"
    yield "|---" * len(heads) + "|"
    for row in ROWS:
        yield _row(*row, studies)


if __name__ == "__main__":
    print_tables({"stopping": lines}, studies=60)
