"""Threshold of a sweep: the first value that a planner fails, and the hardest solvable one.

In: for each value the drives of several planners, one of which is under test. A drive is lawful
if it has no collision at fault, stays on the road and makes progress on its way. The side of the
road is not asked: passing what stands in the lane may need the other one.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

_LAWFUL = ("no_ego_at_fault_collisions", "drivable_area_compliance", "ego_is_making_progress")
"""Parts of nuPlan's score, each 1 in a lawful drive."""


def is_lawful(parts: Mapping[str, float | None]) -> bool:
    """Return whether a drive with these parts of nuPlan's score is lawful."""
    return all(parts[name] == 1.0 for name in _LAWFUL)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """A drive of one value.

    Attributes:
        driver: The planner and how it drove.
        score: nuPlan's, 0 to 1.
        is_tested: Whether the planner is the one under test.
    """

    driver: str
    score: float
    is_lawful: bool
    is_tested: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class TriedValue:
    """A value of the swept number with its drives; without any where it could not be placed."""

    value: float
    trials: tuple[Trial, ...] = ()

    @property
    def tested(self) -> Trial | None:
        """The drive of the planner under test, None without one."""
        return next((trial for trial in self.trials if trial.is_tested), None)

    @property
    def is_passed(self) -> bool | None:
        """True if the planner under test drives it lawfully; None if it has not driven."""
        return None if self.tested is None else self.tested.is_lawful

    @property
    def solution(self) -> Trial | None:
        """The best lawful drive, None without one."""
        lawful = [trial for trial in self.trials if trial.is_lawful]
        return max(lawful, key=lambda trial: trial.score, default=None)


Tried = TypeVar("Tried", bound=TriedValue)


def find_edges(values: Iterable[TriedValue]) -> tuple[tuple[float, float], ...]:
    """Return between which neighbours the outcome changes: (passed, failed), in order of values.

    Values that were not driven are left out.
    """
    driven = sorted(
        (value for value in values if value.is_passed is not None), key=lambda value: value.value
    )
    return tuple(
        (tried.value, other.value) if tried.is_passed else (other.value, tried.value)
        for tried, other in pairwise(driven)
        if tried.is_passed != other.is_passed
    )


def find_hardest(values: Sequence[Tried]) -> Tried | None:
    """Return the value that is solved, not by the planner under test, with the least score.

    Of equal ones that furthest from all values that the planner passes, then the lowest.
    """
    passed = [tried.value for tried in values if tried.is_passed]

    def ease(tried: TriedValue) -> tuple[float, float, float]:
        nearest = min((abs(tried.value - other) for other in passed), default=0.0)
        # Scores that differ by less than 1e-4 are equal: then the distance decides.
        return round(tried.solution.score if tried.solution else 0.0, 4), -nearest, tried.value

    solved = [tried for tried in values if tried.is_passed is False and tried.solution is not None]
    return min(solved, key=ease, default=None)
