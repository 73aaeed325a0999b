"""Which units tell most about the ratings, given the votes so far.

A pair is drawn by how much one more vote on it shrinks the summed variance of the ratings
(A-optimality), mixed with a uniform draw, so that every pair stays possible and its probability is
known. See Chaloner and Verdinelli (1995), "Bayesian experimental design: a review".

Notation: C contestants, P pairs, S scenarios. Ratings are in logits, the prior has a standard
deviation of 200 points of the Elo scale.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from arena.pairing.arrays import FloatArray, IntArray
from arena.pairing.later import Wanted
from arena.pairing.rules import Grid

PRIOR_SD = 200.0 * math.log(10.0) / 400.0
NEWTON_STEPS = 50


def contestants_of(grid: Grid) -> list[str]:
    """The order of rows and columns of ratings and covariance."""
    return sorted({name for pair in grid.pairs for name in pair})


def ratings_so_far(scores: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Ratings (C,) and their covariance (C, C) by the votes so far and the prior.

    Args:
        scores: (C, C) what the row scored against the column: a win 1, a tie one half.
    """
    size = len(scores)
    votes = scores + scores.T
    prior = np.eye(size) / PRIOR_SD**2
    ratings = np.zeros(size)
    for _ in range(NEWTON_STEPS):
        expected = 1.0 / (1.0 + np.exp(ratings[None, :] - ratings[:, None]))
        slope = (scores - votes * expected).sum(axis=1) - ratings / PRIOR_SD**2
        weight = votes * expected * (1.0 - expected)
        information = np.diag(weight.sum(axis=1)) - weight + prior
        step = np.linalg.solve(information, slope)
        ratings += step
        if np.abs(step).max() < 1e-10:
            break
    return ratings, np.asarray(np.linalg.inv(information), dtype=np.float64)


def gains(
    pairs: Sequence[tuple[int, int]], ratings: FloatArray, covariance: FloatArray
) -> FloatArray:
    """By how much a vote on each pair (P,) shrinks the trace of the covariance."""
    first, second = np.array(pairs).T
    chance = 1.0 / (1.0 + np.exp(ratings[second] - ratings[first]))
    weight = chance * (1.0 - chance)
    along = covariance[:, first] - covariance[:, second]
    spread = along[first, np.arange(len(pairs))] - along[second, np.arange(len(pairs))]
    information: FloatArray = weight * (along**2).sum(axis=0) / (1.0 + weight * spread)
    return information


def draw_units(
    grid: Grid,
    known: set[tuple[int, int]],
    judges: IntArray,
    ratings: FloatArray,
    covariance: FloatArray,
    uniform_share: float,
    count: int,
    rng: np.random.Generator,
) -> list[Wanted]:
    """Units for one expert, drawn one after the other, each as if the one before were voted.

    Args:
        grid: What can be shown.
        known: Units (pair, scenario) that the expert has.
        judges: (P, S) how many experts have each unit; within a pair the scenarios with the
            fewest go first, and of those the ones that come least in this draw.
        ratings: (C,) in the order of `contestants_of`.
        covariance: (C, C) of the ratings.
        uniform_share: The probability that the pair is drawn uniformly.
        count: How many; fewer where the expert knows all others.
        rng: The lots.
    """
    names = {name: index for index, name in enumerate(contestants_of(grid))}
    pairs = [(names[first], names[second]) for first, second in grid.pairs]
    free = grid.showable.copy()
    for pair, scenario in known:
        free[pair, scenario] = False
    counts, covariance = judges.copy(), covariance.copy()
    used = np.zeros(free.shape[1], dtype=np.int64)
    drawn: list[Wanted] = []
    while len(drawn) < count and free.any():
        open_ = np.flatnonzero(free.any(axis=1))
        gain = gains([pairs[pair] for pair in open_], ratings, covariance)
        best = open_[gain >= gain.max() * (1.0 - 1e-9)]
        chance = np.where(np.isin(open_, best), (1.0 - uniform_share) / len(best), 0.0)
        chance += uniform_share / len(open_)
        picked = int(rng.choice(len(open_), p=chance / chance.sum()))
        pair = int(open_[picked])
        places = np.flatnonzero(free[pair])
        load = counts[pair, places] * 1000 + used[places]
        fewest = places[load == load.min()]
        scenario = int(rng.choice(fewest))
        drawn.append(
            Wanted(pair=pair, scenario=scenario, chance=float(chance[picked]) / len(fewest))
        )
        free[pair, scenario] = False
        counts[pair, scenario] += 1
        used[scenario] += 1
        covariance = _after_a_vote(pairs[pair], ratings, covariance)
    return drawn


def _after_a_vote(
    pair: tuple[int, int], ratings: FloatArray, covariance: FloatArray
) -> FloatArray:
    first, second = pair
    chance = 1.0 / (1.0 + math.exp(ratings[second] - ratings[first]))
    weight = chance * (1.0 - chance)
    along = covariance[:, first] - covariance[:, second]
    spread = along[first] - along[second]
    after: FloatArray = covariance - weight * np.outer(along, along) / (1.0 + weight * spread)
    return after
