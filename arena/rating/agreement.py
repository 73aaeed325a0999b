"""How well two raters agree beyond chance."""

from __future__ import annotations

from collections.abc import Sequence


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
    seen = sum(one == other for one, other in zip(first, second, strict=True)) / n
    yes_first, yes_second = sum(first) / n, sum(second) / n
    by_chance = yes_first * yes_second + (1.0 - yes_first) * (1.0 - yes_second)
    if by_chance >= 1.0:
        return None
    return (seen - by_chance) / (1.0 - by_chance)
