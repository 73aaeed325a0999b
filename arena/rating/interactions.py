"""A test of contestants against conditions, and its cells: by type, by side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arena.rating.comparisons import FloatArray
from arena.rating.estimate import Estimate
from arena.rating.ranking import holm
from arena.rating.student import t_above, t_quantile


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """By how many points a contestant differs from its own average under one condition.

    Attributes:
        condition: The scenario type; "left" for the side.
        effect: Elo points with the interval of this cell alone.
        p_value: Adjusted for all cells (Holm).
    """

    contestant: str
    condition: str
    votes: int
    effect: Estimate
    p_value: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Interaction:
    """A test of contestants against conditions, and the cells.

    Attributes:
        statistic: About as large as `freedom` where there is no interaction and votes are
            independent without ties.
        p_value: None where nothing can be told.
        rounds: Of the permutations; 0 where the p-value is that of a distribution in closed form.
    """

    statistic: float
    freedom: int
    p_value: float | None
    rounds: int
    cells: tuple[Effect, ...] = ()


def cells_of(
    names: tuple[str, ...],
    conditions: tuple[str, ...],
    votes: FloatArray,
    effects: FloatArray,
    errors: FloatArray,
    degrees: FloatArray,
) -> tuple[Effect, ...]:
    """The cells of (n,) effects in points with standard errors and degrees of freedom."""
    known = ~np.isnan(effects) & (errors > 0.0)
    single = 2.0 * t_above(np.abs(effects[known]) / errors[known], degrees[known])
    adjusted = np.full(len(names), np.nan)
    adjusted[known] = holm(single)
    half = np.zeros(len(names))
    half[known] = t_quantile(degrees[known]) * errors[known]
    return tuple(
        Effect(
            contestant=name,
            condition=condition,
            votes=int(votes[number]),
            effect=Estimate(
                value=float(effects[number]),
                lower=float(effects[number] - half[number]),
                upper=float(effects[number] + half[number]),
            )
            if known[number]
            else Estimate(value=None),
            p_value=float(adjusted[number]) if known[number] else None,
        )
        for number, (name, condition) in enumerate(zip(names, conditions, strict=True))
    )
