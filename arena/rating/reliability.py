"""Agreement of experts with each other and with themselves, and a judgement on each.

Krippendorff's alpha, Gwet's AC1 and percent agreement come with intervals. Nothing here removes a
vote: who differs from the others may be the one who looks closest.

A unit is what can be judged twice: two contestants on one scenario. Values are oriented by the
contestants' numbers, never by the side, or a preference for a side would count as disagreement.
Intervals resample whole scenarios, because the same pictures come in several units of one.

Notation: B rounds, U units, S scenarios, V votes, E experts, C contestants; the
three values are low won, tie, high won.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import StrEnum
from functools import partial
from typing import Self

import numpy as np

from arena.rating.comparisons import (
    LEVEL,
    BoolArray,
    Comparisons,
    Estimate,
    FloatArray,
    IntArray,
    count_pairs,
    select_votes,
    share,
    wilson,
)

VALUES = 3
# Percentiles.
_TAILS = (50.0 * (1.0 - LEVEL), 50.0 * (1.0 + LEVEL))


class DifferenceMetric(StrEnum):
    """Distance of two values: all differences alike, or a win two steps from a loss."""

    NOMINAL = "nominal"
    INTERVAL = "interval"


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """Agreement of experts who judged the same units.

    Attributes:
        alpha: Krippendorff's, values as names.
        alpha_interval: The same with a win twice as far from a loss as from a tie.
        ac1: Gwet's, values as names: chance is what raters would share who guess on hard units
            alone, so many votes of one kind do not push it towards zero as they do alpha.
        percent: Of the others' judgements of the same unit, the share that is equal, 0 to 1, on
            average over all judgements: the mean of what the panel shows of each expert.
        units: With two judgements or more.
        judgements: On those units.
    """

    alpha: Estimate
    alpha_interval: Estimate
    percent: Estimate
    units: int
    judgements: int
    ac1: Estimate = field(default=Estimate(value=None), metadata={"since": 3})


def agreement(votes: Comparisons, *, rounds: int, seed: int, samples: int = 1) -> Agreement:
    """Agreement of all experts on the units that several of them judged.

    Args:
        votes: Of an expert's judgements of one unit the first counts: the second is not another
            expert's.
        rounds: Of the bootstrap over scenarios.
        seed: Of its draws.
        samples: So many numbers in a row are of one scenario, whose samples are units apart.
    """
    ends = np.sort([votes.first, votes.second], axis=0)
    # Equal columns (expert, scenario, low, high) are one expert's judgements of one unit.
    first = np.unique([votes.expert, votes.scenario, *ends], axis=1, return_index=True)[1]
    table, scenario = unit_table(select_votes(votes, np.sort(first)))
    is_shared = table.sum(axis=1) >= 2
    if not is_shared.any():
        nothing = Estimate(value=None)
        return Agreement(
            alpha=nothing, alpha_interval=nothing, percent=nothing, units=0, judgements=0
        )
    scenario //= samples
    scenarios, cluster = np.unique(scenario, return_inverse=True)
    # (U, 9 + 6): every coefficient is a function of sums over units, which rounds weigh anew.
    by_unit = np.hstack([_coincidences(table), _shares(table)])
    sums = np.zeros((len(scenarios), by_unit.shape[1]))
    np.add.at(sums, cluster, by_unit)
    rng = np.random.default_rng(seed)
    chance = np.full(len(scenarios), 1.0 / len(scenarios))
    # (B, S) @ (S, 15): how often each scenario is drawn, times its sums.
    drawn = rng.multinomial(len(scenarios), chance, size=rounds) @ sums
    whole = sums.sum(axis=0)[None]
    several = len(np.unique(scenario[is_shared])) > 1
    measures: dict[str, Callable[[FloatArray], FloatArray]] = {
        "alpha": partial(_alpha, metric=DifferenceMetric.NOMINAL),
        "alpha_interval": partial(_alpha, metric=DifferenceMetric.INTERVAL),
        "percent": _percent,
        "ac1": _ac1,
    }
    return Agreement(
        units=int(is_shared.sum()),
        judgements=int(table[is_shared].sum()),
        **{name: _estimate(measure, whole, drawn, several) for name, measure in measures.items()},
    )


def unit_table(votes: Comparisons) -> tuple[IntArray, IntArray]:
    """(U, 3) how often each value was given to each unit, and (U,) the units' scenarios."""
    counts = count_pairs(votes)
    pairs = max(len(counts.low), 1)
    units, unit_of = np.unique(votes.scenario * pairs + counts.pair_of, return_inverse=True)
    table = np.bincount(unit_of * VALUES + counts.outcome_of, minlength=VALUES * len(units))
    return table.reshape(-1, VALUES).astype(np.int64), units // pairs


def krippendorff_alpha(table: IntArray, metric: DifferenceMetric) -> float | None:
    """Alpha of a table (U, 3) of values by unit; None if all values are alike or none is paired.

    Source: K. Krippendorff, Content Analysis, chapter on reliability: 1 - observed / expected
    disagreement over the coincidences of values within units.
    """
    paired = table[table.sum(axis=1) >= 2]
    if not len(paired):
        return None
    alpha = float(_alpha(_coincidences(paired).sum(axis=0)[None], metric)[0])
    return None if np.isnan(alpha) else alpha


# --- Coefficients --------------------------------------------------------------------------------


def _coincidences(table: IntArray) -> FloatArray:
    """(U, 9): each unit's pairs of values, every value weighing one in all; none of a single."""
    # n_c (n_k - [c = k]) / (m - 1) in a unit of m values.
    pairs = table[:, :, None] * (table[:, None, :] - np.eye(VALUES, dtype=np.int64))
    others = np.maximum(table.sum(axis=1) - 1, 1)
    return np.asarray((pairs / others[:, None, None]).reshape(len(table), -1))


def _shares(table: IntArray) -> FloatArray:
    """(U, K + 3): the values' shares, one, the share of equal pairs, and one if there are any."""
    total = table.sum(axis=1, keepdims=True)
    equal = (table * (table - 1)).sum(axis=1, keepdims=True) / np.maximum(total * (total - 1), 1)
    return np.hstack([table / total, np.ones((len(table), 1)), equal, total > 1])


def _ac1(sums: FloatArray) -> FloatArray:
    """(B,) of sums as `agreement` makes them; not a number where no unit was judged twice."""
    sums = sums[:, VALUES * VALUES :]
    values = sums[:, :-3] / sums[:, -3:-2]
    with np.errstate(invalid="ignore"):
        seen = sums[:, -2] / sums[:, -1]
    # Gwet's chance: sum p (1 - p) / (q - 1) of q values.
    by_chance = (values * (1.0 - values)).sum(axis=1) / (values.shape[1] - 1)
    return np.asarray((seen - by_chance) / (1.0 - by_chance))


def _alpha(sums: FloatArray, metric: DifferenceMetric) -> FloatArray:
    """(B,) of sums (B, 9 or more); not a number where all values are alike."""
    seen = sums[:, : VALUES * VALUES].reshape(-1, VALUES, VALUES)
    place = np.arange(VALUES)
    gap = place[:, None] - place[None, :]
    far = (gap != 0).astype(np.float64) if metric is DifferenceMetric.NOMINAL else gap**2.0
    totals = seen.sum(axis=2)
    n = totals.sum(axis=1)
    observed = (seen * far).sum(axis=(1, 2))
    expected = np.einsum("bc,bk,ck->b", totals, totals, far)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(1.0 - (n - 1.0) * observed / expected)


def _percent(sums: FloatArray) -> FloatArray:
    pairs = sums[:, : VALUES * VALUES]
    with np.errstate(invalid="ignore"):
        return np.asarray(pairs[:, :: VALUES + 1].sum(axis=1) / pairs.sum(axis=1))


def _estimate(
    measure: Callable[[FloatArray], FloatArray],
    whole: FloatArray,
    drawn: FloatArray,
    several: bool,
) -> Estimate:
    value = float(measure(whole)[0])
    if np.isnan(value):
        return Estimate(value=None)
    rounds = measure(drawn)
    rounds = rounds[~np.isnan(rounds)]
    if not several or not len(rounds):
        return Estimate(value=value)
    lower, upper = np.percentile(rounds, _TAILS)
    return Estimate(value=value, lower=float(lower), upper=float(upper))


# --- Single experts ------------------------------------------------------------------------------


_PRIOR_VOTES = 3.0
"""What is foreseen of a contestant on a scenario weighs as much as that on all by so many votes;
about right where scenarios differ by 100 points."""
_DIFFERENT = 0.45
"""Standard deviation of how far honest experts follow the others, who are on average 1: they
differ in their tastes, in their ties and in what they are held against."""
_STEADIER, _PRIOR_REPEATS = 0.15, 20.0
"""By how much more repeats are answered alike by who looks, before the others' repeats say so."""
FAST_MS = 1000.0
"""Quicker than this nobody compares two pictures."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """Evidence of answers for an attentive expert against a careless one.

    Logarithms of likelihood ratios, and what is expected of them: pieces of evidence are added up.

    Attributes:
        gain: Above what is expected of somebody who does not look.
        scale: The gain that is expected of somebody who judges as the others do.
        looking, guessing: The variance of the gain if they do, and if they do not.
    """

    gain: float = 0.0
    scale: float = 0.0
    looking: float = 0.0
    guessing: float = 0.0

    @classmethod
    def of_trials(cls, hits: float, trials: float, *, looking: float, guessing: float) -> Self:
        """Return the evidence of hits among trials, given both experts' chances of a hit."""
        # By how much more a hit says than a miss; constants cancel between gain and expectation.
        weight = math.log(looking / guessing * (1.0 - guessing) / (1.0 - looking))
        return cls(
            gain=weight * (hits - trials * guessing),
            scale=weight * trials * (looking - guessing),
            looking=weight**2 * trials * looking * (1.0 - looking),
            guessing=weight**2 * trials * guessing * (1.0 - guessing),
        )

    def __add__(self, other: "Evidence") -> "Evidence":
        return Evidence(
            **{
                part.name: getattr(self, part.name) + getattr(other, part.name)
                for part in fields(self)
            }
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Rater:
    """One expert; shares go from 0 to 1, None where there is nothing to count.

    Attributes:
        median_ms: How long a pair was on screen, over the votes that were timed.
        fast: The share of timed votes below a second.
        ties: The share of votes that call both equal.
        left: The share of decided votes for the left picture.
        agreement: The mean share of other experts' judgements of the same units that are equal
            to this expert's, and `shared` the votes that have any.
        favourites: The share of decided votes for the contestant that the other experts' votes
            rate higher, and `decided` how many votes that is.
        evidence: Of votes that go with the others' or against them, and of hidden repeats.
    """

    expert: int
    votes: int
    median_ms: float | None
    fast: float | None
    ties: float
    left: Estimate
    agreement: Estimate
    shared: int
    favourites: Estimate
    decided: int
    evidence: Evidence = field(default=Evidence(), metadata={"since": 5})


def raters(votes: Comparisons, *, ms: FloatArray, without: FloatArray) -> tuple[Rater, ...]:
    """One line per expert who has votes.

    Args:
        votes: `first` was shown on the left; without planned repeats.
        ms: (V,) how long each pair was on screen, not a number where that is unknown.
        without: (E, C) strengths by the votes of all others, not a number where those determine
            none; see `arena.rating.influence`.
    """
    agreed, others = agreement_with_others(votes)
    evidence = evidence_of_votes(votes)
    won_left = votes.score == 1.0
    lines = []
    for expert in np.unique(votes.expert).tolist():
        own = votes.expert == expert
        timed = ms[own & ~np.isnan(ms)]
        decided = own & (votes.score != 0.5)
        lead = without[expert][votes.first] - without[expert][votes.second]
        foreseen = decided & ~np.isnan(lead) & (lead != 0.0)
        shared = own & others
        lines.append(
            Rater(
                expert=expert,
                votes=int(own.sum()),
                median_ms=float(np.median(timed)) if len(timed) else None,
                fast=float((timed < FAST_MS).mean()) if len(timed) else None,
                ties=float((votes.score[own] == 0.5).mean()),
                left=_estimate_share(won_left[decided]),
                agreement=_mean(agreed[shared]),
                shared=int(shared.sum()),
                favourites=_estimate_share(won_left[foreseen] == (lead[foreseen] > 0)),
                decided=int(foreseen.sum()),
                evidence=evidence[expert],
            )
        )
    return tuple(lines)


def evidence_of_votes(votes: Comparisons) -> dict[int, Evidence]:
    """Hold each expert's votes against what the others' votes foresee, by expert.

    Foreseen is the net score of a contestant on the same scenario by the others' votes, drawn
    towards that on all scenarios and this towards zero. How much a vote follows it is taken from
    the others: experts whose votes do not go together say nothing of each other.
    """
    lean = 2.0 * votes.score - 1.0
    foreseen = _net_score(votes, lean, votes.first) - _net_score(votes, lean, votes.second)
    sums = np.stack(
        [
            np.bincount(votes.expert, weights=weights)
            for weights in (lean * foreseen, foreseen**2, lean**2, np.ones(len(lean)))
        ]
    )
    product, square, size, number = sums.sum(axis=1, keepdims=True) - sums
    with np.errstate(invalid="ignore", divide="ignore"):
        # (1, E): least squares through zero of the others' leans on what was foreseen of them.
        slope = np.nan_to_num(np.maximum(product, 0.0) / square)
        weight = np.nan_to_num(slope * number / size)
    gain, scale = weight * sums[0], weight * slope * sums[1]
    return {
        expert: Evidence(
            gain=gain[expert],
            scale=scale[expert],
            looking=scale[expert] + (_DIFFERENT * scale[expert]) ** 2,
            guessing=scale[expert],
        )
        for expert in np.unique(votes.expert).tolist()
    }


def _net_score(votes: Comparisons, lean: FloatArray, contestant: IntArray) -> FloatArray:
    """(V,) what the others' votes say of a contestant of each vote, from -1 to 1."""
    number, experts = len(lean), int(votes.expert.max(initial=0)) + 1
    ends = np.concatenate([votes.first, votes.second, contestant])
    values = np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0]]).repeat(number, axis=1)
    values[1] *= np.tile(lean, 3)
    score = np.zeros(number)
    for place in (ends, np.tile(votes.scenario, 3) * len(votes.names) + ends):
        own = np.unique(place * experts + np.tile(votes.expert, 3), return_inverse=True)[1]
        count, net = (
            (np.bincount(place, weights=column)[place] - np.bincount(own, weights=column)[own])[
                -number:
            ]
            for column in values
        )
        score = (net + _PRIOR_VOTES * score) / (count + _PRIOR_VOTES)
    return score


def agreement_with_others(votes: Comparisons) -> tuple[FloatArray, BoolArray]:
    """(V,) the share of the others' judgements of a unit that equal this; (V,) if there are any.

    What the same expert said of the same unit again is not another's judgement.
    """
    counts = count_pairs(votes)
    pairs = max(len(counts.low), 1)
    experts = int(votes.expert.max(initial=0)) + 1
    unit = votes.scenario * pairs + counts.pair_of
    total = _how_many(unit) - _how_many(unit * experts + votes.expert)
    value = unit * VALUES + counts.outcome_of
    equal = _how_many(value) - _how_many(value * experts + votes.expert)
    return np.asarray(equal / np.maximum(total, 1)), np.asarray(total > 0)


def _how_many(keys: IntArray) -> IntArray:
    """(V,) how many votes have the same key."""
    _, place, number = np.unique(keys, return_inverse=True, return_counts=True)
    return np.asarray(number[place])


def _mean(values: FloatArray) -> Estimate:
    """A mean of shares with the normal interval of independent units."""
    if not len(values):
        return Estimate(value=None)
    value = float(values.mean())
    if len(values) < 2:
        return Estimate(value=value)
    half = 1.96 * float(values.std(ddof=1)) / float(np.sqrt(len(values)))
    return Estimate(value=value, lower=max(value - half, 0.0), upper=min(value + half, 1.0))


def _estimate_share(hits: BoolArray) -> Estimate:
    return wilson(int(hits.sum()), len(hits)) if len(hits) else Estimate(value=None)


# --- Hidden repeats ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeats:
    """Test and re-test.

    Attributes:
        same: The share of repeats with the same outcome, its interval clustered by expert.
        reversed: The share in which the winner became the loser.
        by_expert: The number of repeats and of equal ones, by expert.
    """

    number: int
    same: Estimate
    reversed: Estimate
    by_expert: dict[int, tuple[int, int]]


def repeat_consistency(first: FloatArray, again: FloatArray, expert: IntArray) -> Repeats:
    """Compare judgements of the same pictures by the same expert.

    Args:
        first: (R,) what a contestant scored the first time: 1, 0.5 or 0.
        again: (R,) what the same contestant scored the second time.
        expert: (R,) whose judgements they are.

    Raises:
        ValueError: The three have different lengths.
    """
    if not len(first) == len(again) == len(expert):
        raise ValueError(f"{len(first)} votes, {len(again)} repeats, {len(expert)} experts")
    same = first == again
    return Repeats(
        number=len(first),
        same=share(same, expert),
        reversed=share(np.abs(first - again) == 1.0, expert),
        by_expert={
            who: (int((expert == who).sum()), int(same[expert == who].sum()))
            for who in np.unique(expert).tolist()
        },
    )


def evidence_of_repeats(repeats: Repeats, ties: Mapping[int, float]) -> dict[int, Evidence]:
    """Hold repeats answered alike against those of somebody who does not look, by expert.

    How much steadier is who looks is taken from the others' repeats; few of them are drawn towards
    `_STEADIER`.

    Args:
        repeats: Of all experts; they are shown with their sides swapped.
        ties: The share of ties of each expert, who would guess with these.
    """
    # Who guesses ties twice, or names the same side of two by a coin.
    chance = {who: min(ties[who] ** 2 + (1.0 - ties[who]) ** 2 / 2.0, 0.9) for who in ties}
    surplus = {who: alike - n * chance[who] for who, (n, alike) in repeats.by_expert.items()}
    evidence = {}
    for who, (number, alike) in repeats.by_expert.items():
        others = sum(surplus.values()) - surplus[who] + _PRIOR_REPEATS * _STEADIER
        steadier = max(others / (repeats.number - number + _PRIOR_REPEATS), 0.02)
        looking = min(chance[who] + steadier, 0.95)
        evidence[who] = Evidence.of_trials(alike, number, looking=looking, guessing=chance[who])
    return evidence


# --- Two raters ----------------------------------------------------------------------------------


def cohens_kappa(first: Sequence[bool], second: Sequence[bool]) -> float | None:
    """Cohen's kappa of two raters' answers to the same questions.

    Returns:
        1 for full agreement, 0 for what chance gives, below 0 for less; None where there is
        nothing to tell: no question, or both raters gave one and the same answer throughout.

    Raises:
        ValueError: The raters answered different numbers of questions.
    """
    if len(first) != len(second):
        raise ValueError(f"{len(first)} answers against {len(second)}: pair them first")
    n = len(first)
    if n == 0:
        return None
    seen = sum(answer == other for answer, other in zip(first, second, strict=True)) / n
    yes_first, yes_second = sum(first) / n, sum(second) / n
    by_chance = yes_first * yes_second + (1.0 - yes_first) * (1.0 - yes_second)
    if by_chance >= 1.0:
        return None
    return (seen - by_chance) / (1.0 - by_chance)
