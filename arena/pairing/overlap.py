"""Units that two experts or more judge, so that one can say how far experts agree.

A plan that is balanced over scenarios and pairs spreads few votes over many units: of 480 votes on
1,800 units hardly one is judged twice. Exchanges inside one expert bring units together: of two
units (pair, scenario) and (other pair, other scenario) that nobody else judges the expert gets
(pair, other scenario) and (other pair, scenario), of which somebody else judges one or both. Every
expert keeps as many votes of each pair and of each scenario.

Notation: E experts, P pairs, S scenarios.
"""

from __future__ import annotations

import math

import numpy as np

from arena.errors import NothingToPlan
from arena.pairing.arrays import BoolArray, IntArray

_MOST_AT_ONCE = 250
"""Units of an expert that are held against each other at a time."""
_TRIES = 8
"""Rounds over all experts without an exchange, after which there is none."""


def overlap_of(chosen: BoolArray) -> tuple[int, int]:
    """How many units of a plan (E, P, S) somebody judges, and how many two experts or more."""
    judges = chosen.sum(axis=0)
    return int((judges > 0).sum()), int((judges > 1).sum())


def bring_together(
    chosen: BoolArray, showable: BoolArray, share: float, rng: np.random.Generator
) -> None:
    """Exchange units until so many of the judged ones are judged by two experts or more.

    Args:
        chosen: (E, P, S), changed in place; sums over pairs and over scenarios stay for everybody.
        showable: (P, S), where a unit can be.
        share: Of the judged units, from 0 to 1; a plan that has more keeps it.
        rng: Says which.

    Raises:
        NothingToPlan: It can't be reached; the text says how far.
    """
    judges = chosen.sum(axis=0)
    idle = 0
    while True:
        judged, shared = int((judges > 0).sum()), int((judges > 1).sum())
        if shared >= math.ceil(share * judged - 1e-9):
            return
        moved = sum(
            _exchange(chosen[expert], judges, showable, rng)
            for expert in rng.permutation(len(chosen))
            if not _is_reached(judges, share)
        )
        idle = 0 if moved else idle + 1
        if idle == _TRIES:
            raise NothingToPlan(_out_of_reach(chosen, share))


# --- Private -----------------------------------------------------------------------------------


def _is_reached(judges: IntArray, share: float) -> bool:
    judged = int((judges > 0).sum())
    return int((judges > 1).sum()) >= math.ceil(share * judged - 1e-9)


def _exchange(
    mine: BoolArray, judges: IntArray, showable: BoolArray, rng: np.random.Generator
) -> bool:
    """Make the best exchange of one expert (P, S); False where none brings units together."""
    alone = np.argwhere(mine & (judges == 1))
    drawn = rng.permutation(len(alone))[:_MOST_AT_ONCE]
    pair, scenario = alone[drawn].T
    free = showable & ~mine
    fits = free[pair[:, None], scenario[None, :]] & free[pair[None, :], scenario[:, None]]
    others = judges[pair[:, None], scenario[None, :]]
    gain = np.minimum(others, 1) + np.minimum(others.T, 1)
    gain[~fits] = 0
    if not gain.size or not gain.max():
        return False
    one, other = np.unravel_index(int(gain.argmax()), gain.shape)
    for unit, change in (
        ((pair[one], scenario[one]), -1),
        ((pair[other], scenario[other]), -1),
        ((pair[one], scenario[other]), 1),
        ((pair[other], scenario[one]), 1),
    ):
        mine[unit] = change > 0
        judges[unit] += change
    return True


def _out_of_reach(chosen: BoolArray, share: float) -> str:
    judged, shared = overlap_of(chosen)
    return (
        f"Of the pairs that are judged, {share:.0%} are to be judged by two experts or more; "
        f"with these experts, votes and pictures {shared} of {judged} are reached. Ask for less, "
        "or for more votes per expert."
    )
