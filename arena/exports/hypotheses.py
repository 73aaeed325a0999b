"""What was expected and what came of it, in files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from arena.studies.services.plan import Answered

COLUMNS = ("hypothesis", "better", "other", "verdict", "difference", "p_adjusted")


def hypothesis_row(one: Answered) -> list[object]:
    """A line of a table; what no number answers is empty."""
    better, other = one.hypothesis.above or ("", "")
    return [one.hypothesis.text, better, other, one.verdict or "", one.difference, one.p]


def hypotheses_document(answered: Sequence[Answered]) -> list[dict[str, Any]]:
    """For JSON."""
    return [
        {
            "hypothesis": one.hypothesis.text,
            "above": list(one.hypothesis.above) if one.hypothesis.above else None,
            "verdict": one.verdict,
            "difference": None if one.difference is None else round(one.difference, 2),
            "p_adjusted": one.p,
        }
        for one in answered
    ]


def hypothesis_line(one: Answered) -> str:
    """For a terminal."""
    if one.verdict is None:
        return f"Hypothesis: {one.hypothesis.text}"
    numbers = [] if one.difference is None else [f"{one.difference:+.0f} points"]
    if one.p is not None:
        numbers.append(f"p {one.p:.3f} adjusted")
    return f"Hypothesis: {one.hypothesis.text}: {one.verdict} ({', '.join(numbers) or 'unrated'})."
