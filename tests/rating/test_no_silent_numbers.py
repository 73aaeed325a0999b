"""Few and lopsided votes, by every method and unit: a number that means something, or a reason."""

from __future__ import annotations

import math

import numpy as np
import pytest

from arena.rating.chains import Status
from arena.rating.comparisons import Comparisons
from arena.rating.leaderboard import Method, rate
from arena.rating.rules import Unit

RULES = [
    (method, unit)
    for method in Method
    for unit in Unit
    if method is not Method.ELO or unit is Unit.VOTE
]


def few_votes(seed: int) -> Comparisons:
    rng = np.random.default_rng(seed)
    contestants, rows = int(rng.integers(2, 14)), int(rng.integers(1, 120))
    strengths = rng.normal(0.0, rng.choice([0.0, 1.0, 4.0]), contestants)
    first = rng.integers(0, contestants, rows)
    second = (first + rng.integers(1, contestants, rows)) % contestants
    wins = rng.random(rows) < 1.0 / (1.0 + np.exp(strengths[second] - strengths[first]))
    tied = rng.random(rows) < rng.choice([0.0, 0.3, 0.9])
    return Comparisons(
        names=tuple(f"c{index}" for index in range(contestants)),
        first=first,
        second=second,
        score=np.where(tied, 0.5, wins.astype(np.float64)),
        expert=rng.integers(0, int(rng.integers(1, 6)), rows),
        scenario=rng.integers(0, int(rng.integers(1, 30)), rows),
        count=rng.integers(1, int(rng.choice([2, 50])), rows),
    )


@pytest.mark.parametrize(("method", "unit"), RULES)
def test_every_line_has_finite_numbers_or_a_reason(method: Method, unit: Unit) -> None:
    for seed in range(30):
        board = rate(few_votes(seed), method=method, unit=unit, rounds=60, seed=seed)
        assert board.status is Status.RATED or board.explanation
        for line in board.lines:
            bounds = [line.lower, line.upper]
            assert all(math.isfinite(one) for one in (line.rating, *bounds) if one is not None)
            if None in (line.rating, line.rank, *bounds):
                assert line.note
                assert board.explanation
            if line.lower is not None and line.upper is not None:
                assert line.lower < line.upper
            if line.rank == 1 and line.upper is None:
                assert line.lower is not None or method is Method.DAVIDSON
            if line.lower is None and line.upper is None and method is not Method.DAVIDSON:
                assert line.rank != 1
