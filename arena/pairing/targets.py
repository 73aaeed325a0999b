"""How many votes each pair gets where the rules say it, be it by contestant or by pair.

Notation: E experts, C contestants, P pairs, S scenarios.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from arena.errors import NothingToPlan
from arena.pairing.arrays import BoolArray, FloatArray, IntArray
from arena.pairing.units import even_out, quotas

ROUNDS = 2000
"""Of the proportional fitting; it stops earlier when it is exact."""


def votes_by_appearances(
    names: Sequence[str], appearances: IntArray, capacity: IntArray
) -> IntArray:
    """Votes of every pair (C, C), symmetric, whose row sums are the wanted appearances exactly.

    The pairs are as independent as the sums allow (proportional fitting), then rounded.

    Args:
        names: Of the contestants, for the error.
        appearances: (C,) in how many votes each contestant is to appear.
        capacity: (C, C) how many votes each pair can have at most, symmetric, 0 on the diagonal.

    Raises:
        NothingToPlan: No numbers of votes have these sums.
    """
    wanted = _fitted(appearances.astype(float), capacity.astype(float))
    votes = np.minimum(np.floor(wanted + 1e-9).astype(np.int64), capacity)
    lacking = appearances - votes.sum(axis=1)
    rows, columns = np.triu_indices(len(names), 1)
    for best in np.argsort(-(wanted - votes)[rows, columns], kind="stable"):
        i, j = rows[best], columns[best]
        if lacking[i] > 0 and lacking[j] > 0 and votes[i, j] < capacity[i, j]:
            _add(votes, i, j, 1)
            lacking[[i, j]] -= 1
    while lacking.any():
        if not _mend(votes, lacking, wanted, capacity):
            left = np.flatnonzero(lacking).tolist()
            short = ", ".join(f"{names[i]} {appearances[i]}" for i in left)
            raise NothingToPlan(
                f"These appearances can't be reached with the pairs that can be shown: {short}."
            )
    return votes


def share_out(totals: IntArray, experts: int, rng: np.random.Generator) -> IntArray:
    """The votes of each pair per expert (E, P): equal to one, each expert with the same sum.

    Args:
        totals: (P,) votes over all experts; their sum is a multiple of the experts.
        experts: How many there are.
        rng: Says who gets the odd ones.
    """
    shares = np.tile(totals // experts, (experts, 1))
    turn = int(rng.integers(experts))
    for pair in rng.permutation(len(totals)):
        for _ in range(int(totals[pair] % experts)):
            shares[turn % experts, pair] += 1
            turn += 1
    return shares


def choose_wanted(showable: BoolArray, of_pair: IntArray, rng: np.random.Generator) -> BoolArray:
    """Units per expert, (E, P, S), with exactly `of_pair` (E, P) votes of every pair.

    Scenarios are as equal as those counts allow; within a pair, scenarios that few experts judge
    go first.
    """
    experts, pairs = of_pair.shape
    votes = int(of_pair[0].sum())
    used = showable & (of_pair.sum(axis=0) > 0)[:, None]
    of_scenario = quotas(used.sum(axis=0), experts, votes, rng)
    chosen = np.zeros((experts, pairs, showable.shape[1]), dtype=bool)
    judges = np.zeros(showable.shape)
    for expert in range(experts):
        mine = chosen[expert]
        wanted = of_scenario[expert].astype(float)
        for pair in np.argsort(-of_pair[expert] - rng.random(pairs)):
            score = 1e4 * wanted - judges[pair] + rng.random(len(wanted))
            score[~showable[pair]] = -np.inf
            picked = np.argsort(-score)[: of_pair[expert, pair]]
            mine[pair, picked] = True
            wanted[picked] -= 1
        even_out(mine.T, showable.T, of_scenario[expert])
        judges += mine
    return chosen


# --- Private -----------------------------------------------------------------------------------


def _fitted(sums: FloatArray, capacity: FloatArray) -> FloatArray:
    """The independent shares (C, C) with these row sums, none above its capacity."""
    weight = np.sqrt(np.maximum(sums, 0.0))
    for _ in range(ROUNDS):
        shares: FloatArray = np.minimum(np.outer(weight, weight), capacity)
        rows = shares.sum(axis=1)
        if np.abs(rows - sums).max() < 1e-9:
            break
        scale = np.divide(sums, rows, out=np.zeros_like(sums), where=rows > 0)
        weight = np.clip(weight * np.sqrt(scale), 0.0, 1e9)
    return shares


def _mend(votes: IntArray, lacking: IntArray, wanted: FloatArray, capacity: IntArray) -> bool:
    """Give two more appearances by moving a vote: +(i, k), -(k, l), +(l, j); False if none can.

    Too many appearances are mended the other way around.
    """
    sign = 1 if (lacking > 0).any() else -1
    open_ = np.flatnonzero(lacking * sign > 0)
    i = int(open_[0])
    j = int(open_[1]) if len(open_) > 1 else i
    if i == j and abs(lacking[i]) < 2:
        return False
    if i != j and 0 <= votes[i, j] + sign <= capacity[i, j]:
        moves = [[(i, j, sign)]]
    else:
        others = [n for n in range(len(lacking)) if n not in (i, j)]
        moves = [
            [(i, k, sign), (k, o, -sign), (o, j, sign)]
            for k, o in product(others, others)
            if k != o
        ]
    fits = [
        move
        for move in moves
        if all(0 <= votes[a, b] + change <= capacity[a, b] for a, b, change in move)
    ]
    if not fits:
        return False
    best = min(fits, key=lambda move: _strain(move, votes, wanted))
    for a, b, change in best:
        _add(votes, a, b, change)
    lacking[i] -= sign
    lacking[j] -= sign
    return True


def _strain(move: list[tuple[int, int, int]], votes: IntArray, wanted: FloatArray) -> float:
    """How much further from the wanted shares a move leads."""
    return float(
        sum(
            abs(votes[a, b] + change - wanted[a, b]) - abs(votes[a, b] - wanted[a, b])
            for a, b, change in move
        )
    )


def _add(votes: IntArray, i: int, j: int, change: int) -> None:
    votes[i, j] += change
    votes[j, i] += change
