"""What besides the contestants says who wins: types, sides, the place in a session."""

from __future__ import annotations

import numpy as np

from arena.rating.comparisons import FloatArray, IntArray, restrict_to, select_votes, tally
from arena.rating.estimate import Estimate
from arena.rating.influence import without_each_expert
from arena.rating.interactions import Interaction
from arena.rating.leaderboard import Leaderboard
from arena.rating.pooling import pool_types
from arena.rating.raters import agreement_with_others
from arena.rating.session import Drift, drifts, number_sessions
from arena.rating.type_interaction import type_interaction
from arena.services.vote_arrays import VoteArrays

PERMUTATIONS = 999
MOST_CONTESTANTS_POOLED = 100


def by_type(arrays: VoteArrays, strengths: FloatArray | None, *, seed: int) -> Interaction | None:
    """Whether some contestants are stronger on some types; None without types or ratings.

    Args:
        arrays: The votes that count.
        strengths: (C,) of those who have votes, None where not everybody has a rating.
        seed: Of the permutations.
    """
    if strengths is None or "" in arrays.types:
        return None
    rated = np.flatnonzero(tally(arrays.comparisons).sum(axis=1)).tolist()
    inner = restrict_to(arrays.comparisons, rated)
    return type_interaction(
        inner, arrays.type_of, arrays.types, strengths, rounds=PERMUTATIONS, seed=seed
    )


def within_sessions(
    arrays: VoteArrays, strengths: FloatArray | None, chosen: IntArray
) -> tuple[Drift, ...]:
    """How ties, pace, agreement and sides change within the sessions of experts.

    Args:
        arrays: The votes that count.
        strengths: (C,) of those who have votes, None where not everybody has a rating.
        chosen: Those in which an expert saw a pair for the first time, by a person.
    """
    if np.isnan(arrays.at_s[chosen]).all() and np.isnan(arrays.position[chosen]).all():
        return ()
    rated = np.flatnonzero(tally(arrays.comparisons).sum(axis=1)).tolist()
    votes = select_votes(restrict_to(arrays.comparisons, rated), chosen)
    session, place = number_sessions(votes.expert, arrays.at_s[chosen], arrays.position[chosen])
    agreed, others = agreement_with_others(votes)
    decided = votes.score != 0.5
    favourites = np.full(len(votes), np.nan)
    if strengths is not None and len(arrays.judges) > 1:
        without = without_each_expert(restrict_to(arrays.comparisons, rated), strengths)
        lead = without[votes.expert, votes.first] - without[votes.expert, votes.second]
        hit = (votes.score == 1.0) == (lead > 0.0)
        favourites = np.where(decided & (np.nan_to_num(lead) != 0.0), hit, np.nan)
    measures = {
        "ties": np.where(decided, 0.0, 1.0),
        "seconds": arrays.ms[chosen] / 1000.0,
        "agreement": np.where(others, agreed, np.nan),
        "favourites": favourites,
        "left": np.where(decided, votes.score, np.nan),
    }
    found = drifts(votes.expert, session, place, measures)
    return tuple(one for one in found if one.votes)


def pooled_by_type(
    arrays: VoteArrays, board: Leaderboard
) -> tuple[dict[tuple[str, str], Estimate], Estimate | None]:
    """Ratings by type that borrow from each other, by type and slug, and how far types differ.

    Only those who are rated together, by the largest part of the board; nothing for online Elo,
    for votes without types, and where there are very many contestants.
    """
    parts = [line.part for line in board.lines if line.rating is not None]
    if not parts or "" in arrays.types or len(arrays.types) < 2:
        return {}, None
    main = max(set(parts), key=lambda part: (parts.count(part), -part))
    members = [
        number
        for number, line in enumerate(board.lines)
        if line.part == main and line.rating is not None
    ]
    if not 2 <= len(members) <= MOST_CONTESTANTS_POOLED:
        return {}, None
    whole = arrays.comparisons
    inside = np.isin(whole.first, members) & np.isin(whole.second, members)
    votes = restrict_to(whole, members)
    found = pool_types(votes, arrays.type_of[inside], len(arrays.types), board.unit)
    if found is None:
        return {}, None
    estimates = {
        (name, votes.names[place]): Estimate(
            value=float(found.rating[number, place]),
            lower=float(found.lower[number, place]),
            upper=float(found.upper[number, place]),
        )
        for number, name in enumerate(arrays.types)
        for place in range(len(members))
    }
    return estimates, found.spread
