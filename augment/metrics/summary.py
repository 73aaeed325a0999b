"""Many displacements in a few numbers: what a box of a box plot shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from augment.metrics.displacement import Displacement

WHISKER = 1.5
"""Whiskers end at the last value within so many interquartile ranges of the box (Tukey)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxSummary:
    """Quartiles by linear interpolation, whiskers by Tukey, all in metres."""

    mean_m: float
    low_m: float
    q1_m: float
    median_m: float
    q3_m: float
    high_m: float
    outliers_m: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """The displacements of some augmentations taken together.

    Attributes:
        augmentations: How many there are.
        n: Matched objects, each with its own distance.
        missing: Objects of the references that nothing stands for.
        surplus: Generated objects that stand for nothing.
        box: None where nothing is matched.
    """

    augmentations: int
    n: int
    missing: int
    surplus: int
    box: BoxSummary | None


def summarise(displacements: Sequence[Displacement]) -> Summary:
    """All matched objects of all augmentations; each object counts once."""
    distances_m = [value for displacement in displacements for value in displacement.distances_m]
    return Summary(
        augmentations=len(displacements),
        n=len(distances_m),
        missing=sum(len(displacement.missing) for displacement in displacements),
        surplus=sum(len(displacement.surplus) for displacement in displacements),
        box=box_of(distances_m) if distances_m else None,
    )


def box_of(values_m: Sequence[float]) -> BoxSummary:
    """The box of at least one value.

    Raises:
        ValueError: There is no value.
    """
    if not values_m:
        raise ValueError("a box needs at least one value")
    values = np.sort(np.asarray(values_m, dtype=float))
    q1, median, q3 = (float(one) for one in np.percentile(values, (25.0, 50.0, 75.0)))
    reach = WHISKER * (q3 - q1)
    inside = (values >= q1 - reach) & (values <= q3 + reach)
    # Interpolated quartiles may leave no value between a box's edge and its whisker's reach.
    low, high = min(float(values[inside][0]), q1), max(float(values[inside][-1]), q3)
    return BoxSummary(
        mean_m=float(values.mean()),
        low_m=low,
        q1_m=q1,
        median_m=median,
        q3_m=q3,
        high_m=high,
        outliers_m=tuple(float(value) for value in values[~inside]),
    )
