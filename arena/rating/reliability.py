"""How well experts agree: Krippendorff's alpha, Gwet's AC1, percent agreement, with intervals.

A unit is what can be judged twice: two contestants on one scenario. Values are oriented by the
contestants' numbers, never by the side, or a preference for a side would count as disagreement.
Intervals resample whole scenarios, because the same pictures come in several units of one.

Notation: B rounds, U units, S scenarios, V votes; the three values are low won, tie, high won.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from arena.rating.comparisons import Comparisons, FloatArray, IntArray, count_pairs
from arena.rating.estimate import LEVEL, Estimate

VALUES = 3
_TAILS = (50.0 * (1.0 - LEVEL), 50.0 * (1.0 + LEVEL))


class DifferenceMetric(StrEnum):
    """How far two values are apart: all alike, or a win two steps from a loss."""

    NOMINAL = "nominal"
    INTERVAL = "interval"


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """What experts who judged the same units make of each other.

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


def agreement(votes: Comparisons, *, rounds: int, seed: int) -> Agreement:
    """Agreement of all experts on the units that several of them judged.

    Args:
        votes: Without planned repeats: an expert's own second judgement is not another expert's.
        rounds: Of the bootstrap over scenarios.
        seed: Of its draws.
    """
    table, scenario = unit_table(votes)
    is_shared = table.sum(axis=1) >= 2
    if not is_shared.any():
        nothing = Estimate(value=None)
        return Agreement(
            alpha=nothing, alpha_interval=nothing, percent=nothing, units=0, judgements=0
        )
    found, cluster = np.unique(scenario, return_inverse=True)
    by_unit = np.hstack([_coincidences(table), _shares(table)])
    sums = np.zeros((len(found), by_unit.shape[1]))
    np.add.at(sums, cluster, by_unit)
    rng = np.random.default_rng(seed)
    chance = np.full(len(found), 1.0 / len(found))
    drawn = rng.multinomial(len(found), chance, size=rounds) @ sums
    whole = sums.sum(axis=0)[None]
    several = len(np.unique(scenario[is_shared])) > 1
    return Agreement(
        alpha=_estimate(_alpha, DifferenceMetric.NOMINAL, whole, drawn, several),
        alpha_interval=_estimate(_alpha, DifferenceMetric.INTERVAL, whole, drawn, several),
        percent=_estimate(_percent, DifferenceMetric.NOMINAL, whole, drawn, several),
        units=int(is_shared.sum()),
        judgements=int(table[is_shared].sum()),
        ac1=_estimate(_ac1, DifferenceMetric.NOMINAL, whole, drawn, several),
    )


def gwet_ac1(table: IntArray) -> float | None:
    """AC1 of a table (U, K) of values by unit; None if no unit was judged twice.

    What is expected by chance comes from all units, also those that were judged once.

    Source: K. L. Gwet, Computing inter-rater reliability in the presence of high agreement (2008).
    """
    is_shared = table.sum(axis=1) >= 2
    return float(_ac1_of(_shares(table).sum(axis=0)[None])[0]) if is_shared.any() else None


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
    found = float(_alpha(_coincidences(paired).sum(axis=0)[None], metric)[0])
    return None if np.isnan(found) else found


# --- Private -----------------------------------------------------------------------------------


def _coincidences(table: IntArray) -> FloatArray:
    """(U, 9): each unit's pairs of values, every value weighing one in all; none of a single."""
    pairs = table[:, :, None] * (table[:, None, :] - np.eye(VALUES, dtype=np.int64))
    others = np.maximum(table.sum(axis=1) - 1, 1)
    return np.asarray((pairs / others[:, None, None]).reshape(len(table), -1))


def _shares(table: IntArray) -> FloatArray:
    """(U, K + 3): the values' shares, one, the share of equal pairs, and one if there are any."""
    total = table.sum(axis=1, keepdims=True)
    equal = (table * (table - 1)).sum(axis=1, keepdims=True) / np.maximum(total * (total - 1), 1)
    return np.hstack([table / total, np.ones((len(table), 1)), equal, total > 1])


def _ac1(sums: FloatArray, _: DifferenceMetric) -> FloatArray:
    """(B,) of sums as `agreement` makes them."""
    return _ac1_of(sums[:, VALUES * VALUES :])


def _ac1_of(sums: FloatArray) -> FloatArray:
    """(B,) of sums (B, K + 3) of what units share; not a number where none was judged twice."""
    values = sums[:, :-3] / sums[:, -3:-2]
    with np.errstate(invalid="ignore"):
        seen = sums[:, -2] / sums[:, -1]
    by_chance = (values * (1.0 - values)).sum(axis=1) / (values.shape[1] - 1)
    return np.asarray((seen - by_chance) / (1.0 - by_chance))


def _alpha(sums: FloatArray, metric: DifferenceMetric) -> FloatArray:
    """(B,) of sums (B, 9 or more); not a number where all values are alike."""
    seen = sums[:, : VALUES * VALUES].reshape(-1, VALUES, VALUES)
    place = np.arange(VALUES)
    gap = place[:, None] - place[None, :]
    far = (
        (gap != 0).astype(np.float64)
        if metric is DifferenceMetric.NOMINAL
        else gap.astype(float) ** 2
    )
    totals = seen.sum(axis=2)
    n = totals.sum(axis=1)
    observed = (seen * far).sum(axis=(1, 2))
    expected = np.einsum("bc,bk,ck->b", totals, totals, far)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(1.0 - (n - 1.0) * observed / expected)


def _percent(sums: FloatArray, _: DifferenceMetric) -> FloatArray:
    pairs = sums[:, : VALUES * VALUES]
    with np.errstate(invalid="ignore"):
        return np.asarray(pairs[:, :: VALUES + 1].sum(axis=1) / pairs.sum(axis=1))


def _estimate(
    measure: Callable[[FloatArray, DifferenceMetric], FloatArray],
    metric: DifferenceMetric,
    whole: FloatArray,
    drawn: FloatArray,
    several: bool,
) -> Estimate:
    value = float(measure(whole, metric)[0])
    if np.isnan(value):
        return Estimate(value=None)
    rounds = measure(drawn, metric)
    rounds = rounds[~np.isnan(rounds)]
    if not several or not len(rounds):
        return Estimate(value=value)
    lower, upper = np.percentile(rounds, _TAILS)
    return Estimate(value=value, lower=float(lower), upper=float(upper))
