"""Contestants whom the votes put above or below others without any limit.

Who scored against others who never scored back is above them, and no vote says by how much at
most: the largest likelihood lies at infinity. At least by how much is known, though. Of m
independent comparisons that all went one way the share p that the winner may be expected to score
is at least 0.025^(1/m), with 97.5 % confidence (the exact binomial bound, Clopper and Pearson
1934). Ratings with these shares in place of 100 % are finite, and between two components they lie
as near to each other as the votes allow.

Votes of one expert or on one scenario hang together, so with these as units m is the number of
the experts or scenarios, both ways the smaller one.

Notation: C contestants, P pairs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from arena.rating import bradley_terry
from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT, Meetings
from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    count_pairs,
    renumber_codes,
    restrict_to,
    select_votes,
)
from arena.rating.connectivity import Diagnosis
from arena.rating.estimate import LEVEL

_TAIL = (1.0 - LEVEL) / 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tiers:
    """Where the components of a diagnosis stand.

    Attributes:
        reached: (C, C) whether the row's contestant scored against the column's, or through a
            chain.
        part_of: (C,) the number of each one's component in `Diagnosis.parts`.
        group_of: (C,) of each one's group of components that met.
        level: (C,) points; where each one's component lies at least above the next lower one, or
            at most below the next higher one. Its zero is the mean of the group.
    """

    reached: BoolArray
    part_of: IntArray
    group_of: IntArray
    level: FloatArray


def tiers(votes: Comparisons, diagnosis: Diagnosis, unit: Unit) -> Tiers:
    """The components' places on common scales.

    Args:
        votes: Of contestants who all have votes.
        diagnosis: Of these votes.
        unit: What hangs together.
    """
    contestants = len(votes.names)
    part_of = _numbered(diagnosis.parts, contestants)
    group_of = _numbered(diagnosis.groups, contestants)
    level = np.zeros(contestants)
    for group in diagnosis.groups:
        members = list(group)
        if len(np.unique(part_of[members])) > 1:
            level[members] = _levels(restrict_to(votes, members), part_of[members], unit)
    return Tiers(reached=diagnosis.reached, part_of=part_of, group_of=group_of, level=level)


class Ranked(Protocol):
    """What puts those of one component in order."""

    @property
    def name(self) -> str:
        """The contestant's."""

    @property
    def rating(self) -> float | None:
        """In points."""

    @property
    def rank(self) -> int | None:
        """None where it is withheld."""


def standing_order(found: Tiers, lines: Sequence[Ranked]) -> list[int]:
    """The contestants, best first, group by group.

    Whoever scored stands above those who never scored back, and within a component the rating
    decides. Who has neither rating nor rank comes last.

    Args:
        found: Where the components stand.
        lines: (C,) theirs.
    """
    above_me = (found.reached & (found.part_of[:, None] != found.part_of[None, :])).sum(axis=0)
    keys = [
        (
            int(found.group_of[number]),
            line.rating is None and line.rank is None,
            int(above_me[number]),
            int(found.part_of[number]),
            -(line.rating or 0.0),
            line.name,
        )
        for number, line in enumerate(lines)
    ]
    return sorted(range(len(lines)), key=keys.__getitem__)


def main_parts(found: Tiers) -> BoolArray:
    """(C,) who is in the largest component of their group, the highest of these; none of one."""
    size = np.bincount(found.part_of)[found.part_of]
    is_main = np.zeros(len(size), dtype=bool)
    for group in np.unique(found.group_of).tolist():
        members = np.flatnonzero(found.group_of == group).tolist()
        best = max(members, key=lambda one: (size[one], found.level[one]))
        if size[best] > 1:
            is_main |= found.part_of == found.part_of[best]
    return is_main


def outer_bounds(found: Tiers) -> tuple[FloatArray, FloatArray]:
    """(C,), (C,) points above the mean of the main part, of those alone in their component.

    Only a lower bound for who is above it with nobody above them, only an upper one for who is
    below it with nobody below; NaN is no bound. Where there is no main part the mean is that of
    the group.
    """
    lower, upper = np.full((2, len(found.level)), np.nan)
    is_main, level = main_parts(found), found.level - _middle(found)
    across = found.part_of[:, None] != found.part_of[None, :]
    above, below = found.reached & across, found.reached.T & across
    for one in np.flatnonzero(_is_single(found)).tolist():
        base = (found.group_of == found.group_of[one]) & is_main
        if not base.any():
            base = found.group_of == found.group_of[one]
        if above[one][base].any() and not below[one].any():
            lower[one] = level[one]
        elif below[one][base].any() and not above[one].any():
            upper[one] = level[one]
    return lower, upper


def ranks_across(found: Tiers, rank: IntArray, lower: FloatArray, upper: FloatArray) -> IntArray:
    """(C,) ranks within the parts, moved down by those of higher parts; 0 is withheld.

    Who is on top by the votes is first where these show them above the average; who is below
    others has a rank only where somebody is shown to be above them. Those of the main part keep
    their ranks.

    Args:
        found: Where the components stand.
        rank: (C,) within the own part, 0 where withheld.
        lower: (C,) bounds above the mean of the own part, NaN without one; zero for who is alone.
        upper: (C,) the same.
    """
    single, is_main = _is_single(found), main_parts(found)
    low = found.level + np.where(np.isnan(lower), -np.inf, lower)
    high = found.level + np.where(np.isnan(upper), np.inf, upper)
    across = found.reached & (found.part_of[:, None] != found.part_of[None, :])
    higher = (across & (low[:, None] > high[None, :])).sum(axis=0)
    inner = np.where(single, 1, rank)
    on_top = across.any(axis=1) & ~across.any(axis=0)
    keeps = is_main | ~(across.any(axis=1) | across.any(axis=0) | single)
    is_first = on_top & (low > _middle(found)) & (inner == 1)
    decided = np.where(keeps, rank > 0, (inner > 1) | is_first) | (higher > 0)
    return np.where(decided, np.maximum(inner, 1) + higher, 0)


# --- Private -----------------------------------------------------------------------------------


def _numbered(groups: Sequence[Sequence[int]], contestants: int) -> IntArray:
    number = np.zeros(contestants, dtype=np.int64)
    for index, members in enumerate(groups):
        number[list(members)] = index
    return number


def _is_single(found: Tiers) -> BoolArray:
    return np.asarray(np.bincount(found.part_of)[found.part_of] == 1)


def _middle(found: Tiers) -> FloatArray:
    """(C,) the level of the main part of each one's group, zero without one."""
    middle, is_main = np.zeros(len(found.level)), main_parts(found)
    for group in np.unique(found.group_of[is_main]).tolist():
        inside = found.group_of == group
        middle[inside] = found.level[inside & is_main].mean()
    return middle


def _levels(votes: Comparisons, part_of: IntArray, unit: Unit) -> FloatArray:
    """(C,) the mean of each one's component when every separation is as small as it may be."""
    counts = count_pairs(votes)
    games, scores = counts.games, counts.scores.copy()
    ends = np.sort([part_of[counts.low], part_of[counts.high]], axis=0)
    for first, second in np.unique(ends[:, ends[0] != ends[1]], axis=1).T.tolist():
        pairs = (ends[0] == first) & (ends[1] == second)
        share = _TAIL ** (1.0 / _independent(select_votes(votes, pairs[counts.pair_of]), unit))
        won = scores[pairs] > 0.0
        scores[pairs] = games[pairs] * np.where(won, share, 1.0 - share)
    met = Meetings(contestants=len(votes.names), low=counts.low, high=counts.high)
    strengths = bradley_terry.newton(met, games[:, None], scores[:, None])[:, 0] * ELO_PER_LOGIT
    _, place = np.unique(part_of, return_inverse=True)
    mean = np.bincount(place, weights=strengths) / np.bincount(place)
    return np.asarray(mean[place])


def _independent(votes: Comparisons, unit: Unit) -> int:
    """How many votes count as independent; what there is only one of is left out."""
    numbers = []
    if unit in (Unit.EXPERT, Unit.TWO_WAY):
        numbers.append(len(renumber_codes(votes.expert)[0]))
    if unit in (Unit.SCENARIO, Unit.TWO_WAY):
        numbers.append(len(renumber_codes(votes.scenario)[0]))
    return min((number for number in numbers if number > 1), default=votes.votes)
