"""How well a contestant refuses: the wishes that can't be met, and no others.

A refusal of a wish that can't be met is right, any other refusal is wrong. An answer that nobody
can read, or one that changes something, is no refusal.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class RefusalScore:
    """The answers of one contestant, counted.

    Attributes:
        right: Refused, and the wish can't be met.
        wrong: Refused, and the wish can be met.
        overlooked: Not refused, and the wish can't be met.
        rest: Not refused, and the wish can be met.
    """

    right: int
    wrong: int
    overlooked: int
    rest: int

    @property
    def precision(self) -> float | None:
        """The share of the refusals that are right, None without a refusal."""
        refused = self.right + self.wrong
        return self.right / refused if refused else None

    @property
    def recall(self) -> float | None:
        """The share of the wishes that can't be met which were refused, None without any."""
        unmet = self.right + self.overlooked
        return self.right / unmet if unmet else None


def score_refusals(answers: Iterable[tuple[bool, bool]]) -> RefusalScore:
    """Count answers.

    Args:
        answers: Of each whether it was refused, and whether the wish can't be met.
    """
    given = list(answers)
    return RefusalScore(
        right=given.count((True, True)),
        wrong=given.count((True, False)),
        overlooked=given.count((False, True)),
        rest=given.count((False, False)),
    )
