"""A number and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass

LEVEL = 0.95
"""Of every interval."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A number with its 95 % interval; None where the votes do not determine it."""

    value: float | None
    lower: float | None = None
    upper: float | None = None
