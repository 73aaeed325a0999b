"""Online Elo: every round plays the paper's formula."""

from dataclasses import replace

import numpy as np
import pytest

from arena.rating import models
from arena.rating.comparisons import Comparisons, FloatArray, count_pairs, select_votes
from tests.rating.votes import simulated

TRUTH = [1150.0, 1040.0, 1000.0, 980.0, 830.0]


def as_worded(votes: Comparisons, k: float) -> FloatArray:
    """K, base 10, scale 400, initial 1000, a tie half a win."""
    rating = np.full(len(votes.names), 1000.0)
    for first, second, score in zip(votes.first, votes.second, votes.score, strict=True):
        expected = 1.0 / (1.0 + 10.0 ** ((rating[second] - rating[first]) / 400.0))
        rating[first] += k * (score - expected)
        rating[second] -= k * (score - expected)
    return rating


def by_kind(votes: Comparisons) -> Comparisons:
    """The votes by pair and outcome, so that draws do not depend on the order of lines."""
    counts = count_pairs(votes)
    kind = counts.pair_of * 3 + counts.outcome_of
    return select_votes(votes, np.argsort(kind, kind="stable"))


@pytest.mark.parametrize("k", [0.5, 4.0, 64.0])
@pytest.mark.parametrize(("size", "rounds"), [(307, 130), (5003, 3), (5, 1)])
def test_every_round_replays_votes_drawn_with_replacement(
    size: int, rounds: int, k: float
) -> None:
    """Few votes and many, in one go and in several with a remainder."""
    votes = by_kind(simulated(TRUTH, size, 1, ties=0.5))
    order = np.random.default_rng(5).integers(0, len(votes), size=(len(votes), rounds))
    replays = [as_worded(select_votes(votes, order[:, number]), k) for number in range(rounds)]
    sampled = models.resample_elo(votes, rounds=rounds, seed=5, k=k).T
    assert sampled == pytest.approx(np.array(replays), abs=1e-8)


def test_counted_votes_are_resampled_like_as_many_rows() -> None:
    drawn = simulated(TRUTH, 900, 1)
    columns = (drawn.first, drawn.second, drawn.score)
    kinds, count = np.unique(np.stack(columns, axis=1), axis=0, return_counts=True)
    counted = Comparisons(
        names=drawn.names,
        first=kinds[:, 0].astype(np.int64),
        second=kinds[:, 1].astype(np.int64),
        score=np.asarray(kinds[:, 2], dtype=np.float64),
        expert=np.zeros(len(kinds), dtype=np.int64),
        scenario=np.zeros(len(kinds), dtype=np.int64),
        count=count,
    )
    single = select_votes(counted, np.repeat(np.arange(len(counted)), counted.count))
    rows = replace(single, count=np.ones(len(single), dtype=np.int64))
    assert len(counted) < len(rows) == counted.votes
    of_counted = models.resample_elo(counted, rounds=7, seed=2)
    assert of_counted.tolist() == models.resample_elo(rows, rounds=7, seed=2).tolist()


def test_one_sided_votes_drive_apart_without_end_and_without_rounding() -> None:
    """Small gains on large ratings: what single precision would lose."""
    votes = simulated([1000.0, 1000.0], 30_000, 1, ties=0.0)
    ones = np.ones_like(votes.first)
    always = replace(votes, first=ones - 1, second=ones, score=np.ones_like(votes.score))
    assert models.resample_elo(always, rounds=2, seed=0)[:, 1] == pytest.approx(
        as_worded(always, 4.0), abs=1e-6
    )
