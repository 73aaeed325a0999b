"""One part of a driving score."""

from __future__ import annotations

from dataclasses import dataclass, field

from augment.simulation.states import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Metric:
    """A metric with how it came about.

    Attributes:
        name: nuPlan's or interPlan's own.
        value: 0 to 1; None where it can't be said, and then it does not count.
        weight: Its weight in the weighted mean; None for a multiplier.
        parts: Numbers that led to the value, by name.
        series: What it looked at, by name: (T,) each.
    """

    name: str
    value: float | None
    weight: float | None = None
    parts: dict[str, float] = field(default_factory=dict)
    series: dict[str, FloatArray] = field(default_factory=dict)


def combine(metrics: tuple[Metric, ...]) -> float:
    """The product of the multipliers times the weighted mean of the others, 0 to 1."""
    product, total, weights = 1.0, 0.0, 0.0
    for metric in metrics:
        if metric.value is None:
            continue
        if metric.weight is None:
            product *= metric.value
        else:
            total += metric.weight * metric.value
            weights += metric.weight
    return product * (total / weights if weights else 1.0)
