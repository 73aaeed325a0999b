"""Votes as the arrays that ratings are computed from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from arena.models import Vote
from arena.queries.votes.judged import Entrant, Judged
from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, FloatArray, IntArray

SCORES = {
    Vote.Outcome.LEFT.value: WIN,
    Vote.Outcome.EQUAL.value: TIE,
    Vote.Outcome.RIGHT.value: LOSS,
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VoteArrays:
    """V votes as numbers.

    Attributes:
        comparisons: `first` was shown on the left.
        judges, items, types: Names by their numbers.
        type_of: (V,) the type of each vote's scenario.
        ms: (V,) how long each pair was on screen, not a number where unknown.
    """

    comparisons: Comparisons
    judges: tuple[str, ...]
    items: tuple[str, ...]
    types: tuple[str, ...]
    type_of: IntArray
    ms: FloatArray


def vote_arrays(entrants: Sequence[Entrant], votes: Sequence[Judged]) -> VoteArrays:
    """Number everything, in the order in which it occurs.

    Args:
        entrants: The contestants, also those without votes.
        votes: Each compares two of them.
    """
    number = {entrant.slug: index for index, entrant in enumerate(entrants)}
    judges: dict[str, int] = {}
    items: dict[str, int] = {}
    types: dict[str, int] = {}
    whole = partial(np.array, dtype=np.int64)
    type_of = whole([types.setdefault(vote.type, len(types)) for vote in votes])
    comparisons = Comparisons(
        names=tuple(entrant.slug for entrant in entrants),
        shown=tuple(entrant.name for entrant in entrants),
        first=whole([number[vote.left] for vote in votes]),
        second=whole([number[vote.right] for vote in votes]),
        score=np.array([SCORES[vote.outcome] for vote in votes], dtype=np.float64),
        expert=whole([judges.setdefault(vote.judge, len(judges)) for vote in votes]),
        scenario=whole([items.setdefault(vote.item, len(items)) for vote in votes]),
    )
    return VoteArrays(
        comparisons=comparisons,
        judges=tuple(judges),
        items=tuple(items),
        types=tuple(types),
        type_of=type_of,
        ms=np.array(
            [np.nan if vote.ms_visible is None else vote.ms_visible for vote in votes],
            dtype=np.float64,
        ),
    )
