"""Groups of contestants connected by chains of comparisons, and whether votes can be rated.

Contestants who reach each other both ways are a part (a strongly connected component of the graph
of scores), those who met through any chain a group. Strengths exist when everybody is in one part
(Ford 1957); a tie is a score both ways.

Notation: C contestants, K parts, P pairs, n sets of votes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from arena.rating.comparisons import (
    LEVEL,
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    PairCounts,
)
from arena.rating.models import Meetings
from arena.rating.rules import Unit

FEWEST_TO_TELL = 6
"""A fair coin falls six times alike in 3 % of cases, five times in 6 %: so many independent
comparisons that all went one way show who is above."""
NAMED = 3
"""A sentence names so many contestants at most."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chains:
    """The parts and groups, numbered in the order of their first members.

    Attributes:
        part_of: (C,) the number of each one's part.
        group_of: (C,) of each one's group.
        reaches: (K, K) whether the row's part reaches the column's, which is another one.
    """

    part_of: IntArray
    group_of: IntArray
    reaches: BoolArray

    @property
    def sizes(self) -> IntArray:
        """(K,) members of each part."""
        return np.bincount(self.part_of)

    @property
    def parts(self) -> list[IntArray]:
        """Return the members of each part."""
        return [np.flatnonzero(self.part_of == part) for part in range(len(self.sizes))]

    def above(self) -> IntArray:
        """(C,) how many of other parts reach each one."""
        return np.asarray((self.sizes @ self.reaches)[self.part_of])

    def main_parts(self) -> list[int]:
        """Return the largest part of each group, the highest of these; none of one alone."""
        group_of_part = self.group_of[[members[0] for members in self.parts]]
        # The last key counts first: by group, then the largest, then whom the fewest reach.
        order = np.lexsort([self.reaches.sum(axis=0), -self.sizes, group_of_part])
        _, first = np.unique(group_of_part[order], return_index=True)
        return [part for part in order[first].tolist() if self.sizes[part] > 1]


def chains_among(contestants: int, counts: PairCounts, *, together: bool = False) -> Chains:
    """Return who reaches whom in votes on so many contestants.

    Args:
        contestants: C.
        counts: Who met, and how it came out.
        together: Whoever met is one part, whoever won.
    """
    met = Meetings(contestants, counts)
    scored = _find_scored(met, counts.games[:, None], counts.scores[:, None])
    # (1, C, C) with edges both ways: who met, whoever scored.
    connected = closure(scored | scored.transpose(0, 2, 1))[0]
    reached = connected if together else closure(scored)[0]
    part_of = _number_classes(reached & reached.T)
    first = np.unique(part_of, return_index=True)[1]
    reaches = reached[np.ix_(first, first)] & ~np.eye(len(first), dtype=np.bool_)
    return Chains(part_of=part_of, group_of=_number_classes(connected), reaches=reaches)


def chains_in_sets(met: Meetings, games: FloatArray, scores: FloatArray) -> BoolArray:
    """(n, C, C) who reached whom in each of n sets of votes.

    The row's contestant reached the column's by a score against them, or through a chain.

    Args:
        met: The pairs.
        games: (P, n) comparisons of each pair in each set.
        scores: (P, n) what `low` scored in them.
    """
    return closure(_find_scored(met, games, scores))


def are_determined(met: Meetings, games: FloatArray, scores: FloatArray) -> BoolArray:
    """(n,) which sets have finite Bradley-Terry strengths for everybody; as `chains_in_sets`.

    Everybody is reached from the first contestant, and reaches it. Eight sets are a byte.
    """
    # Sets beyond the last one fill the last byte up: there everybody scores.
    # (P, bytes): whether low scored against high, and high against low.
    scored, conceded = ~np.packbits(scores <= 0, axis=1), ~np.packbits(scores >= games, axis=1)
    is_fine = np.full(scored.shape[1], 255, dtype=np.uint8)
    # First along the edges from the first contestant, then against them.
    for from_low, from_high in ((scored, conceded), (conceded, scored)):
        reached = np.zeros((met.contestants, len(is_fine)), dtype=np.uint8)
        further = reached.copy()
        further[0] = 255
        while (further != reached).any() and not (further == 255).all():
            reached = further.copy()
            # (P, bytes) each: low's reach goes to high, high's to low; then by who receives it.
            arrived = [reached[met.low] & from_low, reached[met.high] & from_high]
            further[met.present] |= np.bitwise_or.reduceat(
                np.concatenate(arrived)[met.by_end], met.starts, axis=0
            )
        is_fine &= np.bitwise_and.reduce(further, axis=0)
    return np.unpackbits(is_fine, count=games.shape[1]).view(np.bool_)


def closure(edges: BoolArray) -> BoolArray:
    """(n, C, C) who is reached through chains of edges (n, C, C) (Warshall 1962)."""
    contestants = edges.shape[1]
    reached = np.packbits(edges, axis=2)
    for via in range(contestants):
        # Whoever reaches `via` reaches all that it reaches; its bit becomes a mask of a byte.
        leads_there = (reached[:, :, via // 8] >> (7 - via % 8) & 1) * np.uint8(255)
        reached |= leads_there[:, :, None] & reached[:, via, None]
    return np.unpackbits(reached, axis=2, count=contestants).view(np.bool_)


def _find_scored(met: Meetings, games: FloatArray, scores: FloatArray) -> BoolArray:
    """(n, C, C) whether the row's contestant ever scored against the column's; itself counts."""
    everybody = np.arange(met.contestants)
    scored = np.zeros((games.shape[1], len(everybody), len(everybody)), dtype=np.bool_)
    scored[:, met.low, met.high] = (scores > 0).T
    scored[:, met.high, met.low] = (scores < games).T
    scored[:, everybody, everybody] = True
    return scored


def _number_classes(together: BoolArray) -> IntArray:
    """(C,) the number of each one's class, in the order of their first members."""
    if not len(together):
        return np.empty(0, dtype=np.int64)
    # Rows of one class are equal, so argmax names its first member.
    return np.unique(together.argmax(axis=1), return_inverse=True)[1].astype(np.int64)


# --- What the votes allow ------------------------------------------------------------------------


class Status(StrEnum):
    """Kind of rating that the votes allow."""

    RATED = "rated"
    NO_VOTES = "no votes"
    ONE_CONTESTANT = "one contestant"
    DISCONNECTED = "disconnected"
    UNBOUNDED = "unbounded"
    ALL_TIES = "all ties"
    NO_INTERVALS = "no intervals"
    OPEN_INTERVALS = "open intervals"


def diagnose(
    names: Sequence[str], votes: Comparisons, chains: Chains
) -> tuple[Status, tuple[str, ...]]:
    """Return the kind of rating that the votes allow, with sentences on its limits.

    Args:
        names: Of all contestants, also those without votes.
        votes: Of those who have some.
        chains: Of these votes.
    """
    if len(names) == 1:
        return Status.ONE_CONTESTANT, (f"There is only one contestant, {names[0]}.",)
    if not len(votes):
        return Status.NO_VOTES, ("There are no votes to rate.",)
    groups = [np.flatnonzero(chains.group_of == n) for n in np.unique(chains.group_of)]
    reasons = []
    if len(groups) > 1:
        reasons.append(
            f"These groups were never compared with each other: {_list(votes, groups)}. Each is "
            "rated by itself; ratings across them have no meaning."
        )
    has_higher, has_lower = chains.reaches.any(axis=0), chains.reaches.any(axis=1)
    for is_end, sentence in (
        (has_lower & ~has_higher, "Nobody else scored against {}: there is no upper limit."),
        (has_higher & ~has_lower, "{} scored against nobody else: there is no lower limit."),
    ):
        if is_end.any():
            ends = [chains.parts[part] for part in np.flatnonzero(is_end)]
            reasons.append(sentence.format(_list(votes, ends)))
    if len(groups) > 1:
        return Status.DISCONNECTED, tuple(reasons)
    if reasons:
        return Status.UNBOUNDED, tuple(reasons)
    if (votes.score == 0.5).all():
        return Status.ALL_TIES, (
            "Every vote is a tie: all are rated alike, and the votes do not say how sure that is.",
        )
    return Status.RATED, ()


def join_few(names: Sequence[str]) -> Sequence[str]:
    """The first names, and an ellipsis where there are more."""
    return names if len(names) <= NAMED else (*names[:NAMED], "…")


def _list(votes: Comparisons, groups: Sequence[IntArray]) -> str:
    return "; ".join(
        join_few(
            [
                ", ".join(join_few([votes.shown[contestant] for contestant in group]))
                for group in groups
            ]
        )
    )


def ranks_across(votes: Comparisons, chains: Chains, unit: Unit, rank: IntArray) -> IntArray:
    """Return (C,) ranks over the parts of each group; 0 is withheld.

    Those of parts that are shown to be above count as above. A part that is neither the largest
    of its group, nor shown to be above or below others, has no ranks.

    Args:
        votes: Of contestants who all have votes.
        chains: Of these votes.
        unit: The clusters of votes.
        rank: (C,) within the own part, 0 where withheld.
    """
    is_shown = _find_shown_parts(votes, chains, unit)
    higher = (chains.sizes * is_shown) @ chains.reaches
    is_ranked = (higher > 0) | (is_shown & ~chains.reaches.any(axis=0))
    is_ranked[chains.main_parts()] = True
    part_of = chains.part_of
    inner = np.where(chains.sizes[part_of] == 1, 1, rank)
    return np.where(is_ranked[part_of] & (inner > 0), inner + higher[part_of], 0)


def judge_across(votes: Comparisons, chains: Chains, unit: Unit) -> BoolArray:
    """Return (C, C) whether the row's contestant is of a part that is above the column's.

    All votes between the two parts went one way, and a fair coin falls so often alike between any
    two of the contestants in less than 5 % (Bonferroni).

    Args:
        votes: Of C contestants who all have votes.
        chains: Of these votes.
        unit: The clusters of votes.
    """
    parts, pairs = len(chains.sizes), len(votes.names) * (len(votes.names) - 1)
    loser = chains.part_of[np.where(votes.score == 1.0, votes.second, votes.first)]
    number = _independent(votes, _winner_parts(votes, chains) * parts + loser, parts**2, unit)
    # A coin falls n times alike with 2^-n: that times all ordered pairs is at most 5 %.
    is_told = (number >= np.log2(pairs / (1.0 - LEVEL))).reshape(parts, parts)
    np.fill_diagonal(is_told, False)
    return np.asarray(is_told[np.ix_(chains.part_of, chains.part_of)])


def _find_shown_parts(votes: Comparisons, chains: Chains, unit: Unit) -> BoolArray:
    """(K,) which parts enough independent votes show to be above those that they reach."""
    is_across = chains.part_of[votes.first] != chains.part_of[votes.second]
    # Votes within a part are a group of their own, the last.
    winner = np.where(is_across, _winner_parts(votes, chains), len(chains.sizes))
    number = _independent(votes, winner, len(chains.sizes) + 1, unit)
    return np.asarray(number[:-1] >= FEWEST_TO_TELL)


def _winner_parts(votes: Comparisons, chains: Chains) -> IntArray:
    """(R,) whose contestant won; any of the two, who are of one part, in a tie."""
    return chains.part_of[np.where(votes.score == 1.0, votes.first, votes.second)]


def _independent(votes: Comparisons, group: IntArray, groups: int, unit: Unit) -> FloatArray:
    """(G,) how many independent votes each group has, by the group (R,) of each row.

    Votes of one cluster count as one. What all votes have only one of is left out.
    """
    fewest = np.bincount(group, weights=votes.count, minlength=groups)
    for kind in unit.kinds:
        codes, cluster = np.unique(getattr(votes, kind), return_inverse=True)
        # Group and cluster as one number: how many different clusters each group has.
        met = np.unique(group * len(codes) + cluster)
        different = np.bincount(met // max(len(codes), 1), minlength=groups)
        fewest = np.minimum(fewest, different) if len(codes) > 1 else fewest
    return np.asarray(fewest, dtype=np.float64)
