"""How likely two contestants of a planned study are told apart, all pairs judged at once.

Studies are drawn from the spread that is expected of them: differences of ratings and what their
variances are found to be. Each is judged as a rating is (`simultaneous`), against differences of
equals drawn from the same spread. No votes are drawn, so it takes hundredths of a second.

Notation: C contestants, P pairs, N draws of equals, S studies.
"""

from __future__ import annotations

import numpy as np

from arena.rating.comparisons import BoolArray, FloatArray
from arena.rating.estimate import LEVEL
from arena.rating.moderated import MOST_PRIOR, Component, Spread
from arena.rating.simultaneous import CAUTION, SingleArray, draw_equals

MOST_DRAWN = 12
"""Among more contestants nothing is drawn."""
_STUDIES, _EQUALS = 100, 500
_SEED = 0
_ALIKE = 1.02
"""Distances that differ by less are the same."""


def component_of(found: FloatArray, own: float, degrees: float) -> Component:
    """What clusters of one kind are expected to add to the covariance.

    Args:
        found: (C, C) squared points.
        own: Degrees of freedom of a contestant's own squares: clusters less one.
        degrees: The same with what all contestants have in common.
    """
    of_each = np.ones(len(found))
    return Component(
        covariance=found,
        plain=found,
        common=found,
        own_share=of_each * own / (own + MOST_PRIOR),
        own_degrees=of_each * own,
        degrees=of_each * degrees,
    )


class PlannedPairs:
    """What is drawn for a spread; the same for every question.

    Args:
        spread: Expected of the ratings.
        distances: (P,) points between the pairs, in the order of np.triu_indices.
    """

    def __init__(self, spread: Spread, distances: FloatArray) -> None:
        low, high = np.triu_indices(len(spread.covariance), 1)
        rounds = _EQUALS + _STUDIES
        gaps, found, common = draw_equals(spread, low, high, rounds=rounds, seed=_SEED)
        self._distances = distances
        self._equals = _sizes(gaps[_STUDIES:], np.sqrt(found[_STUDIES:]))
        self._gaps = gaps[:_STUDIES]
        self._errors: SingleArray = np.sqrt(np.maximum(found, common)[:_STUDIES])

    def power(self, gap: float) -> float:
        """The chance that a pair so many points apart is told apart.

        It stands for the pairs that are nearest to being as far apart.
        """
        nearest = self._distances[np.abs(self._distances - gap).argmin()]
        asked = np.abs(self._distances - nearest) <= (_ALIKE - 1.0) * nearest
        distances = np.where(asked, gap, self._distances).astype(np.float32)
        sizes = _sizes(distances + self._gaps, self._errors)
        return float(np.mean([self._told_apart(of_study)[asked].mean() for of_study in sizes]))

    def gap_found(self, power: float) -> float:
        """How far apart, in points, two must be to be told apart with such a chance."""
        low, high = 0.0, 100.0
        while self.power(high) < power:
            low, high = high, 2.0 * high
        while high - low > 0.5:
            middle = (low + high) / 2.0
            low, high = (middle, high) if self.power(middle) < power else (low, middle)
        return high

    def _told_apart(self, sizes: SingleArray) -> BoolArray:
        """(P,) by step-down: from the largest size to the first that equals exceed too often."""
        order = np.argsort(-sizes)
        # Of a pair's rivals the largest: of itself and all after it.
        largest = np.maximum.accumulate(self._equals[:, order[::-1]], axis=1)[:, ::-1]
        exceeded = CAUTION * (1.0 + (largest >= sizes[order]).sum(axis=0)) / (1.0 + _EQUALS)
        told_apart = np.empty(len(sizes), dtype=np.bool_)
        told_apart[order] = np.logical_and.accumulate(exceeded <= 1.0 - LEVEL)
        return told_apart


def _sizes(gaps: SingleArray, errors: SingleArray) -> SingleArray:
    """How many errors a gap is wide, either way."""
    return np.asarray(np.abs(gaps) / errors, dtype=np.float32)
