"""What a study will be able to tell, before its first vote: half-widths, power, votes needed.

In: a `StudyDesign`. Out: half-widths, the gap that is found, and the votes that either needs, from
the terms that the intervals of `moderated.py` are made of:

- single votes: the sandwich of a balanced plan, H^-1 B H^-1, with contestants evenly spaced over
  the spread and ties likelier between those close to each other;
- what experts, and what scenarios, make of each contestant: its variance over the number of
  clusters, plus what an uneven share of the pairs adds where a cluster has few votes;
- Student's t with Satterthwaite's degrees of freedom of that sum.

All of it is closed form, but for the gap that is found: studies are drawn from the spread that is
expected of them, differences of ratings and what their variances are found to be, and judged as a
rating is. No votes are drawn, so it takes hundredths of a second.

`docs/rating.md` holds it against simulated studies. Everything is on the scale of the rated
table, ties as half a win.

Notation: C contestants, P pairs, E experts, S scenarios, V votes, N draws. Points are Elo points.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import BoolArray, FloatArray, IntArray
from arena.rating.estimate import LEVEL, t_quantile
from arena.rating.moderated import MOST_PRIOR, Component, Spread
from arena.rating.ranking import CAUTION, SingleArray, draw_equals

SURE = 1.0 - LEVEL
"""The chance of an error that intervals and separations allow."""

_RANGES = np.linspace(-9.0, 9.0, 1801)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyDesign:
    """A study that somebody thinks of.

    Attributes:
        contestants: C, 2 or more.
        experts: E, 2 or more.
        scenarios: S, 2 or more.
        spread: Points from the worst to the best; the others lie evenly between.
        tie_share: Of the votes, from 0 to below 1.
        expert_sd: By how many points experts differ in what they make of a contestant.
        scenario_sd: The same of scenarios.
        overlap_share: Of the judged units, those that two experts judge.

    Raises:
        ValueError: Something is out of range; the text says what is allowed.
    """

    contestants: int
    experts: int
    scenarios: int
    spread: float = 0.0
    tie_share: float = 0.4
    expert_sd: float = 0.0
    scenario_sd: float = 0.0
    overlap_share: float = 0.0

    def __post_init__(self) -> None:
        for name in ("contestants", "experts", "scenarios"):
            if getattr(self, name) < 2:
                raise ValueError(f"{name} must be 2 or more, not {getattr(self, name)}")
        for name in ("spread", "expert_sd", "scenario_sd"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be 0 or more, not {getattr(self, name)}")
        if not 0.0 <= self.overlap_share <= 1.0:
            raise ValueError(f"overlap_share goes from 0 to 1, not {self.overlap_share}")
        if not 0.0 <= self.tie_share < min(1.0, self.most_ties):
            raise ValueError(
                f"tie_share goes from 0 to below {min(1.0, self.most_ties):.2f} with a spread of "
                f"{self.spread:g} points, not {self.tie_share}"
            )

    @property
    def pairs(self) -> int:
        """P."""
        return self.contestants * (self.contestants - 1) // 2

    @property
    def units(self) -> int:
        """P S: so many votes an expert can give at most, as nobody sees a unit twice."""
        return self.pairs * self.scenarios

    @property
    def most_ties(self) -> float:
        """The tie share at which the weaker one of a pair would never win."""
        return float((2.0 * self._lower_scores()).mean())

    def pairs_within(self, gap: float) -> int:
        """How many pairs are at most so many points apart."""
        return int((self.gaps() * ELO_PER_LOGIT <= gap + 1e-6).sum())

    def gaps(self) -> FloatArray:
        """(P,) logits between the pairs, in the order of np.triu_indices."""
        strengths = np.linspace(0.0, self.spread, self.contestants) / ELO_PER_LOGIT
        low, high = np.triu_indices(self.contestants, 1)
        return np.asarray(strengths[high] - strengths[low])

    def _lower_scores(self) -> FloatArray:
        return np.asarray(1.0 / (1.0 + np.exp(self.gaps())))


@dataclass(frozen=True, slots=True, kw_only=True)
class Expected:
    """How sure the ratings of a design will be.

    Attributes:
        design: Whose.
        spread: As a rating would find it if it found what is true.
        degrees: Of Student's t.
    """

    design: StudyDesign
    spread: Spread
    degrees: float

    @property
    def covariance(self) -> FloatArray:
        """(C, C) squared points."""
        return self.spread.covariance

    @property
    def half_width(self) -> float:
        """Points of a typical 95 % interval."""
        typical = float(self.covariance.diagonal().mean())
        return float(t_quantile(self.degrees)) * math.sqrt(typical)

    @property
    def widest(self) -> float:
        """Points expected of the widest 95 % interval of a table: by chance some are wider."""
        place = int(self.covariance.diagonal().argmax())
        variance = float(self.covariance[place, place])
        # Only a contestant's own squares are guesses; what all have in common moves all alike.
        chance = sum(
            2.0
            * (part.own_share[place] * part.common[place, place] / variance) ** 2
            / part.own_degrees[place]
            for part in self.spread.components
        )
        by_chance = 1.0 + 0.5 * _largest_of(self.design.contestants) * math.sqrt(chance)
        return float(t_quantile(self.degrees)) * math.sqrt(variance) * by_chance

    def tells_apart(self, gap: float, *, power: float) -> bool:
        """Whether two so many points apart are told apart with such a chance."""
        if self.design.contestants <= MOST_DRAWN:
            return self._planned_pairs().power(gap) >= power
        return self.gap_found(power=power) <= gap

    def gap_found(self, *, power: float) -> float:
        """How far apart, in points, two must be to be told apart with such a chance.

        All pairs of the table are judged at once, at 5 % for all of them. Among more than 12
        contestants, where nothing is drawn, the closer ones share the 5 % by Tukey's range.

        Args:
            power: From 0.5 to below 1.
        """
        if self.design.contestants <= MOST_DRAWN:
            return self._planned_pairs().gap_found(power)
        variance = self.covariance.diagonal()
        error = math.sqrt(float((variance[1:] + variance[:-1]
                                 - 2.0 * self.covariance.diagonal(1)).mean()))  # fmt: skip
        all_pairs = _level_of_all_pairs(self.design.contestants)
        degrees = min(self.degrees, 2.0 * (self.design.experts - 1.0))
        gap = 0.0
        for _ in range(20):  # the gap says which pairs are closer, and these say the gap
            closer = max(self.design.pairs_within(gap), self.design.contestants - 1)
            level = min(all_pairs * self.design.pairs / closer, SURE) / CAUTION
            limit = float(t_quantile(degrees, 1.0 - level / 2.0))
            before, gap = gap, (limit + float(ndtri(power))) * error
            if abs(gap - before) < 0.01:
                break
        return gap

    def _planned_pairs(self) -> PlannedPairs:
        return PlannedPairs(self.spread, self.design.gaps() * ELO_PER_LOGIT)


def expect(design: StudyDesign, votes: float) -> Expected:
    """How sure ratings will be after so many votes of all experts, more than 0."""
    contestants = design.contestants
    centre = np.eye(contestants) - 1.0 / contestants
    single = _by_single_votes(design, votes)
    distinct = votes / (1.0 + design.overlap_share)
    parts = (
        (design.experts, design.expert_sd, votes / design.experts),
        (design.scenarios, design.scenario_sd, distinct / design.scenarios),
    )
    at_widest = float(single.diagonal().max())
    common, weights, components = single.copy(), 0.0, []
    for clusters, effect, per_cluster in parts:
        added = effect**2 * (1.0 / clusters + _uneven(design, per_cluster) / clusters) * centre
        common = common + added
        own = clusters - 1.0
        degrees = max(min(MOST_PRIOR + own, own * (contestants - 1.0)), 1.0)
        weights += (at_widest + float(added[0, 0])) ** 2 / degrees
        components.append(component_of(single + added, own, degrees))
    spread = Spread(
        covariance=common,
        degrees=np.full(contestants, max(float(common.diagonal().max()) ** 2 / weights, 1.0)),
        common=common,
        base=single,
        plain=common,
        components=tuple(components),
    )
    return Expected(design=design, spread=spread, degrees=float(spread.degrees[0]))


def votes_per_expert_for(
    design: StudyDesign, reached: Callable[[Expected], bool], *, most: int | None = None
) -> int | None:
    """The fewest votes per expert with which something is reached.

    Args:
        design: The study.
        reached: Says it of what is expected; with more votes never less so.
        most: Votes that an expert can give; by default as many as there are units.

    Returns:
        None where no number of votes of these experts on these scenarios reaches it.
    """
    low, high = 0, design.units if most is None else most
    if not reached(expect(design, high * design.experts)):
        return None
    while high - low > 1:
        middle = (low + high) // 2
        if reached(expect(design, middle * design.experts)):
            high = middle
        else:
            low = middle
    return high


def agreement_error(design: StudyDesign, votes: float) -> float | None:
    """Half of the 95 % interval of the share in which two experts agree; None without overlap.

    For a share of a half, where it is widest.
    """
    twice = votes * design.overlap_share / (1.0 + design.overlap_share)
    return None if twice < 1.0 else float(ndtri(0.5 + LEVEL / 2.0)) * 0.5 / math.sqrt(twice)


# --- Widths --------------------------------------------------------------------------------------


def _by_single_votes(design: StudyDesign, votes: float) -> FloatArray:
    """(C, C) the covariance if each vote stood for itself, in squared points."""
    low, high = (place.astype(np.int64) for place in np.triu_indices(design.contestants, 1))
    expected = 1.0 / (1.0 + np.exp(design.gaps()))
    ties = design.tie_share / design.most_ties * 2.0 * expected
    each = votes / design.pairs
    curvature = _laplacian(design.contestants, low, high, each * expected * (1.0 - expected))
    surprise = each * (expected * (1.0 - expected) - ties / 4.0)
    # The mean is fixed: its direction, of which votes say nothing, gets a curvature and loses it.
    mean = np.full_like(curvature, 1.0 / design.contestants)
    scale = float(curvature.trace()) / design.contestants
    inverse = np.linalg.inv(curvature + scale * mean) - mean / scale
    squares = _laplacian(design.contestants, low, high, surprise)
    return np.asarray(inverse @ squares @ inverse * ELO_PER_LOGIT**2)


def _laplacian(size: int, low: IntArray, high: IntArray, weights: FloatArray) -> FloatArray:
    found = np.zeros((size, size))
    found[low, high] = found[high, low] = -weights
    np.fill_diagonal(found, -found.sum(axis=1))
    return found


def _uneven(design: StudyDesign, per_cluster: float) -> float:
    """What a cluster's tastes weigh more because it has not every pair equally often.

    The pairs of a cluster are drawn without putting back: with m of P pairs the variance of its
    mean taste is (C - 2) (P - m) / ((P - 1) m) times larger than with all of them.
    """
    pairs = design.pairs
    if per_cluster >= pairs or pairs < 2:
        return 0.0
    missing = (pairs - per_cluster) / (pairs - 1)
    return (design.contestants - 2) * missing / max(per_cluster, 1e-9)


def _largest_of(number: int) -> float:
    """The mean of the largest of so many standard normal values."""
    step = float(_RANGES[1] - _RANGES[0])
    return float((1.0 - ndtr(_RANGES) ** number - ndtr(-_RANGES)).sum()) * step


def _level_of_all_pairs(contestants: int) -> float:
    """The chance of an error for each pair so that among equals all pairs share the 5 %.

    By the range of C independent normal values (Tukey), whose distribution is one integral.
    """
    density = np.exp(-(_RANGES**2) / 2.0) / math.sqrt(2.0 * math.pi)
    step = float(_RANGES[1] - _RANGES[0])
    low, high = 0.0, 12.0
    for _ in range(60):
        middle = (low + high) / 2.0
        inside = (ndtr(_RANGES) - ndtr(_RANGES - middle)) ** (contestants - 1)
        chance = contestants * float((density * inside).sum()) * step
        low, high = (middle, high) if chance < LEVEL else (low, middle)
    return 2.0 * float(ndtr(-low / math.sqrt(2.0)))


# --- Pairs of drawn studies ----------------------------------------------------------------------


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
