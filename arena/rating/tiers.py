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
from arena.rating.chains import Chains
from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    count_pairs,
    renumber_codes,
    select_votes,
    split_votes,
)
from arena.rating.estimate import LEVEL

_TAIL = (1.0 - LEVEL) / 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tiers:
    """Where the components of a diagnosis stand.

    Attributes:
        chains: Who scored against whom through others, by component.
        level: (C,) points; where each one's component lies at least above the next lower one, or
            at most below the next higher one. Its zero is the mean of the group.
    """

    chains: Chains
    level: FloatArray

    @property
    def part_of(self) -> IntArray:
        """(C,) the number of each one's component."""
        return self.chains.part_of

    @property
    def group_of(self) -> IntArray:
        """(C,) the number of each one's group of components that met."""
        return self.chains.group_of


def tiers(votes: Comparisons, chains: Chains, unit: Unit) -> Tiers:
    """The components' places on common scales.

    Args:
        votes: Of contestants who all have votes.
        chains: Of these votes.
        unit: What hangs together.
    """
    level = np.zeros(len(votes.names))
    groups = chains.groups()
    if len(groups) < len(chains.sizes):
        for group, inside in zip(groups, split_votes(votes, groups), strict=True):
            members = list(group)
            part_of = chains.part_of[members]
            if (part_of != part_of[0]).any():
                level[members] = _levels(inside, part_of, unit)
    return Tiers(chains=chains, level=level)


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
    above_me = found.chains.above()
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
    others = _across(found.chains)
    for one in np.flatnonzero(_is_single(found)).tolist():
        base = (found.group_of == found.group_of[one]) & is_main
        if not base.any():
            base = found.group_of == found.group_of[one]
        part = found.part_of[one]
        above, below = others[part], others[:, part]
        if above[found.part_of[base]].any() and not below.any():
            lower[one] = level[one]
        elif below[found.part_of[base]].any() and not above.any():
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
    others = _across(found.chains)
    higher = _higher(others, found.part_of, low, high)
    has_lower = np.asarray(others.any(axis=1))[found.part_of]
    has_higher = np.asarray(others.any(axis=0))[found.part_of]
    inner = np.where(single, 1, rank)
    on_top = has_lower & ~has_higher
    keeps = is_main | ~(has_lower | has_higher | single)
    is_first = on_top & (low > _middle(found)) & (inner == 1)
    decided = np.where(keeps, rank > 0, (inner > 1) | is_first) | (higher > 0)
    return np.where(decided, np.maximum(inner, 1) + higher, 0)


# --- Private -----------------------------------------------------------------------------------


def _across(chains: Chains) -> BoolArray:
    """(K, K) which parts reach which others."""
    across = chains.between.copy()
    np.fill_diagonal(across, False)
    return across


def _higher(others: BoolArray, part_of: IntArray, low: FloatArray, high: FloatArray) -> IntArray:
    """(C,) how many of parts that reach the own one have their lower bound above the own upper."""
    number = np.zeros(len(low), dtype=np.int64)
    for part in np.flatnonzero(others.any(axis=0)).tolist():
        members = np.flatnonzero(part_of == part)
        bounds = np.sort(low[others[part_of, part]])
        number[members] = len(bounds) - np.searchsorted(bounds, high[members], side="right")
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
    across = np.flatnonzero(ends[0] != ends[1])
    parts, meeting_of = np.unique(ends[:, across], axis=1, return_inverse=True)
    rows = np.flatnonzero(np.isin(counts.pair_of, across))
    of_row = meeting_of[np.searchsorted(across, counts.pair_of[rows])]
    number = _independent(select_votes(votes, rows), of_row, parts.shape[1], unit)
    share = (_TAIL ** (1.0 / number))[meeting_of]
    scores[across] = games[across] * np.where(scores[across] > 0.0, share, 1.0 - share)
    met = Meetings(contestants=len(votes.names), low=counts.low, high=counts.high)
    strengths = bradley_terry.newton(met, games[:, None], scores[:, None])[:, 0] * ELO_PER_LOGIT
    _, place = np.unique(part_of, return_inverse=True)
    mean = np.bincount(place, weights=strengths) / np.bincount(place)
    return np.asarray(mean[place])


def _independent(votes: Comparisons, of_row: IntArray, meetings: int, unit: Unit) -> IntArray:
    """(M,) how many votes of each meeting of two parts count as independent.

    What there is only one of is left out.

    Args:
        votes: R rows.
        of_row: (R,) the meeting of each.
        meetings: M.
        unit: What hangs together.
    """
    kinds = {Unit.EXPERT: (votes.expert,), Unit.SCENARIO: (votes.scenario,), Unit.VOTE: ()}
    fewest: FloatArray = np.full(meetings, np.inf)
    for codes in kinds.get(unit, (votes.expert, votes.scenario)):
        occurring, place = renumber_codes(codes)
        met = np.unique(of_row * len(occurring) + place)
        different = np.bincount(met // len(occurring), minlength=meetings)
        fewest = np.where(different > 1, np.minimum(fewest, different), fewest)
    of_all = np.bincount(of_row, weights=votes.count, minlength=meetings)
    return np.where(np.isinf(fewest), of_all, fewest).astype(np.int64)
