"""How much an answer depends on the words: the spread over a wish's wordings.

Values in metres, one for each wording of a scenario: its instruction and its paraphrases.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Robustness:
    """One contestant over all scenarios with at least two wordings that were measured.

    Attributes:
        scenarios: How many those are.
        wordings: How many wordings they have together.
        within_m: The pooled standard deviation within a scenario: the root of the mean variance
            (each with n - 1), weighted by its degrees of freedom.
        median_range_m: The median over scenarios of the largest less the smallest value.
    """

    scenarios: int
    wordings: int
    within_m: float
    median_range_m: float


def measure_robustness(values: Mapping[str, Sequence[float]]) -> Robustness | None:
    """The spread within scenarios, None where no scenario has two wordings.

    Args:
        values: By scenario, one for each of its wordings.
    """
    several = [np.asarray(one, dtype=float) for one in values.values() if len(one) > 1]
    if not several:
        return None
    squares = sum(float(((one - one.mean()) ** 2).sum()) for one in several)
    freedom = sum(len(one) - 1 for one in several)
    return Robustness(
        scenarios=len(several),
        wordings=sum(len(one) for one in several),
        within_m=float(np.sqrt(squares / freedom)),
        median_range_m=float(np.median([np.ptp(one) for one in several])),
    )
