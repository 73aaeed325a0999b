"""Who scored against whom through chains of comparisons, and what votes allow to be rated.

Contestants who reach each other both ways are a part (a strongly connected component of the graph
of scores), those who met through any chain a group. Strengths exist when everybody is in one part
(Ford 1957); a tie is a score both ways.

Notation: C contestants, K parts, P pairs, n sets of votes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from arena.rating.comparisons import (
    LEVEL,
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    PairCounts,
    count_pairs,
    restrict_to,
    select_votes,
)
from arena.rating.lines import Line
from arena.rating.models import ELO_PER_LOGIT, Meetings, fit
from arena.rating.rules import Unit

_BITS_AT_ONCE = 32_000_000
_TAIL = (1.0 - LEVEL) / 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chains:
    """The parts and groups, numbered in the order of their first members.

    Attributes:
        part_of: (C,) the number of each one's part.
        group_of: (C,) of each one's group.
        between: (K, K) whether the row's part reaches the column's; it reaches itself.
        scored, conceded: (C,) whether the contestant scored against anybody, and anybody against
            it.
    """

    part_of: IntArray
    group_of: IntArray
    between: BoolArray
    scored: BoolArray
    conceded: BoolArray

    @property
    def sizes(self) -> IntArray:
        """(K,) members of each part."""
        return np.bincount(self.part_of)

    def above(self) -> IntArray:
        """(C,) how many of other parts reach each one."""
        reaching = self.sizes @ self.between - self.sizes
        return np.asarray(reaching[self.part_of])

    def parts(self) -> tuple[tuple[int, ...], ...]:
        """Return the members of each part."""
        return _members_of(self.part_of)

    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Return the members of each group."""
        return _members_of(self.group_of)


def chains_among(contestants: int, counts: PairCounts) -> Chains:
    """Return who reaches whom in votes on so many contestants."""
    met = Meetings(contestants, counts)
    scored = _scored(met, counts.games[:, None], counts.scores[:, None])
    reached, connected = closure(scored)[0], closure(scored | scored.transpose(0, 2, 1))[0]
    part_of = _numbered(reached & reached.T)
    first = np.unique(part_of, return_index=True)[1]
    others = scored[0] & ~np.eye(contestants, dtype=np.bool_)
    return Chains(
        part_of=part_of,
        group_of=_numbered(connected),
        between=reached[np.ix_(first, first)],
        scored=others.any(axis=1),
        conceded=others.any(axis=0),
    )


def chains_in_sets(met: Meetings, games: FloatArray, scores: FloatArray) -> BoolArray:
    """(n, C, C) who reached whom in each of n sets of votes.

    The row's contestant reached the column's by a score against them, or through a chain.

    Args:
        met: The pairs.
        games: (P, n) comparisons of each pair in each set.
        scores: (P, n) what `low` scored in them.
    """
    return closure(_scored(met, games, scores))


def are_determined(met: Meetings, games: FloatArray, scores: FloatArray) -> BoolArray:
    """(n,) which sets have finite Bradley-Terry strengths for everybody; as `chains_in_sets`."""
    found = np.empty(games.shape[1], dtype=np.bool_)
    at_once = max(1, _BITS_AT_ONCE // max(1, met.contestants**2))
    for first in range(0, len(found), at_once):
        some = slice(first, first + at_once)
        scored = _scored(met, games[:, some], scores[:, some])
        found[some] = _all_from_first(scored) & _all_from_first(scored.transpose(0, 2, 1))
    return found


def closure(edges: BoolArray) -> BoolArray:
    """(n, C, C) who is reached through chains of edges (n, C, C) (Warshall 1962)."""
    contestants = edges.shape[1]
    reached = np.packbits(edges, axis=2)
    for via in range(contestants):
        leads_there = (reached[:, :, via // 8] >> (7 - via % 8) & 1) * np.uint8(255)
        reached |= leads_there[:, :, None] & reached[:, via, None]
    return np.unpackbits(reached, axis=2, count=contestants).view(np.bool_)


# --- Private -----------------------------------------------------------------------------------


def _scored(met: Meetings, games: FloatArray, scores: FloatArray) -> BoolArray:
    """(n, C, C) whether the row's contestant ever scored against the column's; itself counts."""
    everybody = np.arange(met.contestants)
    scored = np.zeros((games.shape[1], len(everybody), len(everybody)), dtype=np.bool_)
    scored[:, met.low, met.high] = (scores > 0).T
    scored[:, met.high, met.low] = (scores < games).T
    scored[:, everybody, everybody] = True
    return scored


def _all_from_first(scored: BoolArray) -> BoolArray:
    """(n,) whether the first contestant reaches everybody by scores (n, C, C)."""
    steps = scored.astype(np.float32)
    reached = scored[:, :1]
    while True:
        further = reached.astype(np.float32) @ steps > 0
        if (further == reached).all():
            return np.asarray(reached.all(axis=(1, 2)))
        reached = further


def _numbered(together: BoolArray) -> IntArray:
    """(C,) the number of each one's class, in the order of their first members."""
    if not len(together):
        return np.empty(0, dtype=np.int64)
    return np.unique(together.argmax(axis=1), return_inverse=True)[1].astype(np.int64)


def _members_of(number_of: IntArray) -> tuple[tuple[int, ...], ...]:
    """Return who has each of the numbers (C,), from 0."""
    order = np.argsort(number_of, kind="stable")
    ends = np.cumsum(np.bincount(number_of))[:-1]
    return tuple(tuple(some.tolist()) for some in np.split(order, ends) if len(some))


# --- What the votes allow ------------------------------------------------------------------------


NAMED = 3
"""A sentence names so many contestants at most."""


def few_of(names: Sequence[str]) -> Sequence[str]:
    """The first names, and an ellipsis where there are more."""
    return names if len(names) <= NAMED else (*names[:NAMED], "…")


class Status(StrEnum):
    """What the votes allow."""

    RATED = "rated"
    NO_VOTES = "no votes"
    ONE_CONTESTANT = "one contestant"
    DISCONNECTED = "disconnected"
    UNBOUNDED = "unbounded"
    ALL_TIES = "all ties"
    NO_INTERVALS = "no intervals"
    OPEN_INTERVALS = "open intervals"


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """What the votes allow to say.

    Attributes:
        explanation: The sentences on the status, none where nothing is amiss.
        chains: Who reaches whom by scores, among parts: those who can be rated among each other,
            a part of one without a rating.
        notes: Why each contestant has no rating; empty for who has one.
    """

    status: Status
    explanation: tuple[str, ...] = ()
    chains: Chains = field(compare=False)
    notes: tuple[str, ...] = ()


def diagnose(
    names: tuple[str, ...], counts: PairCounts, *, bounded_anyway: bool = False
) -> Diagnosis:
    """What the votes allow to say about contestants who all have votes.

    Args:
        names: (C,) as in the counts.
        counts: Of the full data.
        bounded_anyway: The method rates also those who won or lost everything.
    """
    chains = chains_among(len(names), counts)
    if not counts.outcomes.sum():
        said = "There are no votes to rate."
        return Diagnosis(status=Status.NO_VOTES, explanation=(said,), chains=chains)
    groups = chains.groups()
    if bounded_anyway:  # whoever met is rated together
        apart = np.eye(len(groups), dtype=np.bool_)
        chains = replace(chains, part_of=chains.group_of, between=apart)
    parts = chains.parts()
    if len(parts) > 1:
        explanation = []
        if len(groups) > 1:
            explanation.append(
                "These groups were never compared with each other: "
                f"{_list_groups(names, groups)}. Each is rated by itself; ratings across them "
                "have no meaning."
            )
        if not bounded_anyway:
            explanation += _who_is_unbounded(names, chains)
        return Diagnosis(
            status=Status.DISCONNECTED if len(groups) > 1 else Status.UNBOUNDED,
            explanation=tuple(explanation),
            chains=chains,
            notes=_notes(parts, chains),
        )
    if not (counts.outcomes[:, 0].any() or counts.outcomes[:, 2].any()):
        return Diagnosis(
            status=Status.ALL_TIES,
            explanation=(
                (
                    "Every vote is a tie: all are rated alike, and the votes do not say how sure "
                    "that is."
                ),
            ),
            chains=chains,
        )
    return Diagnosis(status=Status.RATED, chains=chains)


def _notes(parts: tuple[tuple[int, ...], ...], chains: Chains) -> tuple[str, ...]:
    """(C,) why those who are alone in their part have no rating."""
    notes: list[str] = [""] * len(chains.part_of)
    for part in parts:
        if len(part) == 1:
            lower, upper = bool(chains.scored[part[0]]), bool(chains.conceded[part[0]])
            notes[part[0]] = _LIMITS[lower, upper]
    return tuple(notes)


_LIMITS = {
    (True, True): "no limits among equals",
    (True, False): "no upper limit",
    (False, True): "no lower limit",
    (False, False): "no lower limit and no upper limit",
}
"""By whether there is a lower and an upper one."""


def _who_is_unbounded(names: tuple[str, ...], chains: Chains) -> list[str]:
    """Sentences about those who won or lost everything against the rest that they met."""
    members = chains.parts()
    group_of_part = chains.group_of[[part[0] for part in members]]
    has_rest = np.bincount(group_of_part)[group_of_part] > 1
    is_unbeaten = has_rest & (chains.between.sum(axis=0) == 1)
    is_scoreless = has_rest & (chains.between.sum(axis=1) == 1)
    unbeaten, scoreless = (
        _list_groups(names, [members[part] for part in np.flatnonzero(which).tolist()])
        for which in (is_unbeaten, is_scoreless)
    )
    sentences = []
    if unbeaten:
        sentences.append(f"Nobody else scored against {unbeaten}: there is no upper limit.")
    if scoreless:
        sentences.append(f"{scoreless} scored against nobody else: there is no lower limit.")
    return sentences


def _list_groups(names: tuple[str, ...], groups: Sequence[Sequence[int]]) -> str:
    return "; ".join(
        few_of([", ".join(few_of([names[index] for index in group])) for group in groups])
    )


# --- Contestants above or below others without any limit -----------------------------------------
#
# Who scored against others who never scored back is above them, and no vote says by how much at
# most. At least by how much is known, though: of m independent comparisons that all went one way
# the share p that the winner may be expected to score is at least 0.025^(1/m), with 97.5 %
# confidence (the exact binomial bound, Clopper and Pearson 1934). Ratings with these shares in
# place of 100 % are finite, and between two parts they lie as near to each other as the votes
# allow. Votes that hang together count as one: m is the number of the experts or scenarios.


def find_levels(votes: Comparisons, chains: Chains, unit: Unit) -> FloatArray:
    """Return (C,) points: where each one's part lies at least above the next lower one.

    Or at most below the next higher one. Zero is the mean of the group.

    Args:
        votes: Of contestants who all have votes.
        chains: Of these votes.
        unit: What hangs together.
    """
    levels = np.zeros(len(votes.names))
    groups = chains.groups()
    if len(groups) < len(chains.sizes):
        for members in map(list, groups):
            part_of = chains.part_of[members]
            if (part_of != part_of[0]).any():
                levels[members] = _levels_of_group(restrict_to(votes, members), part_of, unit)
    return levels


def standing_order(chains: Chains, lines: Sequence[Line]) -> list[int]:
    """Return the contestants, best first, group by group.

    Whoever scored stands above those who never scored back, and within a part the rating decides.
    Who has neither rating nor rank comes last.
    """
    above_me = chains.above()
    keys = [
        (
            int(chains.group_of[number]),
            line.rating is None and line.rank is None,
            int(above_me[number]),
            int(chains.part_of[number]),
            -(line.rating or 0.0),
            line.name,
        )
        for number, line in enumerate(lines)
    ]
    return sorted(range(len(lines)), key=keys.__getitem__)


def outer_bounds(chains: Chains, levels: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (C,), (C,) points above the mean of the main part, of those alone in their part.

    Only a lower bound for who is above it with nobody above them, only an upper one for who is
    below it with nobody below; NaN is no bound. Where there is no main part the mean is that of
    the group.
    """
    lower, upper = np.full((2, len(levels)), np.nan)
    is_main = _main_parts(chains, levels)
    level = levels - _middle(chains, levels, is_main)
    others = chains.between & ~np.eye(len(chains.between), dtype=np.bool_)
    for alone in np.flatnonzero(chains.sizes[chains.part_of] == 1).tolist():
        in_group = chains.group_of == chains.group_of[alone]
        base = in_group & is_main if (in_group & is_main).any() else in_group
        part = chains.part_of[alone]
        above, below = others[part], others[:, part]
        if above[chains.part_of[base]].any() and not below.any():
            lower[alone] = level[alone]
        elif below[chains.part_of[base]].any() and not above.any():
            upper[alone] = level[alone]
    return lower, upper


def ranks_across(
    chains: Chains, levels: FloatArray, rank: IntArray, lower: FloatArray, upper: FloatArray
) -> IntArray:
    """Return (C,) ranks within the parts, moved down by those of higher parts; 0 is withheld.

    Who is on top by the votes is first where these show them above the average; who is below
    others has a rank only where somebody is shown to be above them. Those of the main part keep
    their ranks.

    Args:
        chains: Who reaches whom.
        levels: (C,) where the parts stand.
        rank: (C,) within the own part, 0 where withheld.
        lower: (C,) bounds above the mean of the own part, NaN without one; zero for who is alone.
        upper: (C,) the same.
    """
    is_alone = chains.sizes[chains.part_of] == 1
    is_main = _main_parts(chains, levels)
    low = levels + np.where(np.isnan(lower), -np.inf, lower)
    high = levels + np.where(np.isnan(upper), np.inf, upper)
    others = chains.between & ~np.eye(len(chains.between), dtype=np.bool_)
    higher = np.zeros(len(low), dtype=np.int64)
    for part in np.flatnonzero(others.any(axis=0)).tolist():
        members = np.flatnonzero(chains.part_of == part)
        bounds = np.sort(low[others[chains.part_of, part]])
        higher[members] = len(bounds) - np.searchsorted(bounds, high[members], side="right")
    has_lower = np.asarray(others.any(axis=1))[chains.part_of]
    has_higher = np.asarray(others.any(axis=0))[chains.part_of]
    inner = np.where(is_alone, 1, rank)
    keeps = is_main | ~(has_lower | has_higher | is_alone)
    is_above_middle = low > _middle(chains, levels, is_main)
    is_first = has_lower & ~has_higher & is_above_middle & (inner == 1)
    decided = np.where(keeps, rank > 0, (inner > 1) | is_first) | (higher > 0)
    return np.where(decided, np.maximum(inner, 1) + higher, 0)


def _main_parts(chains: Chains, levels: FloatArray) -> BoolArray:
    """Return (C,) who is in the largest part of their group, the highest of these; none of one."""
    size = chains.sizes[chains.part_of]
    is_main = np.zeros(len(size), dtype=np.bool_)
    for members in chains.groups():
        best = max(members, key=lambda member: (size[member], levels[member]))
        if size[best] > 1:
            is_main |= chains.part_of == chains.part_of[best]
    return is_main


def _middle(chains: Chains, levels: FloatArray, is_main: BoolArray) -> FloatArray:
    """Return (C,) the level of the main part of each one's group, zero without one."""
    middle = np.zeros(len(levels))
    for group in np.unique(chains.group_of[is_main]).tolist():
        inside = chains.group_of == group
        middle[inside] = levels[inside & is_main].mean()
    return middle


def _levels_of_group(votes: Comparisons, part_of: IntArray, unit: Unit) -> FloatArray:
    """Return (C,) the mean of each one's part when every separation is as small as it may be."""
    counts = count_pairs(votes)
    games, scores = counts.games, counts.scores.copy()
    ends = np.sort([part_of[counts.low], part_of[counts.high]], axis=0)
    across = np.flatnonzero(ends[0] != ends[1])
    parts, meeting_of = np.unique(ends[:, across], axis=1, return_inverse=True)
    rows = np.flatnonzero(np.isin(counts.pair_of, across))
    of_row = meeting_of[np.searchsorted(across, counts.pair_of[rows])]
    number = _independent_votes(select_votes(votes, rows), of_row, parts.shape[1], unit)
    share = (_TAIL ** (1.0 / number))[meeting_of]
    scores[across] = games[across] * np.where(scores[across] > 0.0, share, 1.0 - share)
    met = Meetings(len(votes.names), counts)
    strengths = fit(met, games[:, None], scores[:, None])[:, 0] * ELO_PER_LOGIT
    _, place = np.unique(part_of, return_inverse=True)
    mean = np.bincount(place, weights=strengths) / np.bincount(place)
    return np.asarray(mean[place])


def _independent_votes(
    votes: Comparisons, of_row: IntArray, meetings: int, unit: Unit
) -> IntArray:
    """Return (M,) how many votes of each of M meetings of two parts count as independent.

    What there is only one of is left out; `of_row` (R,) is the meeting of each row.
    """
    fewest: FloatArray = np.full(meetings, np.inf)
    for kind in unit.kinds:
        occurring, place = np.unique(getattr(votes, kind), return_inverse=True)
        met = np.unique(of_row * len(occurring) + place)
        different = np.bincount(met // len(occurring), minlength=meetings)
        fewest = np.where(different > 1, np.minimum(fewest, different), fewest)
    of_all = np.bincount(of_row, weights=votes.count, minlength=meetings)
    return np.where(np.isinf(fewest), of_all, fewest).astype(np.int64)
