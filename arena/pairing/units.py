"""Which units each expert judges: balanced over scenarios first, then over pairs.

Notation: E experts, P pairs, S scenarios.
"""

from __future__ import annotations

import itertools
from collections import deque

import numpy as np

from arena.pairing.arrays import BoolArray, FloatArray, IntArray


def choose_units(
    showable: BoolArray, experts: int, votes: int, rng: np.random.Generator
) -> BoolArray:
    """Units per expert, (E, P, S): balanced over scenarios first, then over pairs."""
    pairs, scenarios = showable.shape
    of_scenario = quotas(showable.sum(axis=0), experts, votes, rng)
    of_pair = quotas(showable.sum(axis=1), experts, votes, rng)
    chosen = np.zeros((experts, pairs, scenarios), dtype=bool)
    judges = np.zeros((pairs, scenarios))
    for expert in range(experts):
        mine = chosen[expert]
        wanted = of_pair[expert].astype(float)
        for scenario in rng.permutation(scenarios):
            # The pair that is owed most, then the one that fewest have judged here, then by lot.
            score = 1e4 * wanted - judges[:, scenario] + rng.random(pairs)
            score[~showable[:, scenario]] = -np.inf
            picked = np.argsort(-score)[: of_scenario[expert, scenario]]
            mine[picked, scenario] = True
            wanted[picked] -= 1
        even_out(mine, showable, of_pair[expert])
        judges += mine
    flat = chosen.transpose(1, 0, 2).reshape(pairs, experts * scenarios)
    everywhere = np.tile(showable, (1, experts))
    even_out(flat, everywhere, np.zeros(pairs, dtype=np.int64))
    return flat.reshape(pairs, experts, scenarios).transpose(1, 0, 2)


def draw_probability(showable: BoolArray, votes: int) -> FloatArray:
    """How likely each unit (P, S) is a given showing: its pair's share times its scenario's.

    Exact where every unit can be shown; else the product of both shares, made to sum to 1.
    """
    by_scenario = _level(showable.sum(axis=0), votes)
    by_pair = _level(showable.sum(axis=1), votes)
    shares = np.where(showable, by_pair[:, None] * by_scenario[None, :], 0.0)
    return np.asarray(shares / shares.sum())


def quotas(capacity: IntArray, experts: int, votes: int, rng: np.random.Generator) -> IntArray:
    """Shares (E, n) of the votes of each expert: equal to +-1 by row and by column total.

    A place whose capacity is too small gets its capacity. The odd votes go around in one circle
    over all experts, so that nobody and no place collects them.
    """
    base = np.zeros(len(capacity), dtype=np.int64)
    while (base + (base < capacity)).sum() <= votes and (base < capacity).any():
        base += base < capacity
    odd = votes - int(base.sum())
    quotas = np.tile(base, (experts, 1))
    places = rng.permutation(np.flatnonzero(base < capacity))
    for expert in range(experts):
        start = expert * odd
        for step in range(odd):
            quotas[expert, places[(start + step) % len(places)]] += 1
    return quotas


def even_out(chosen: BoolArray, showable: BoolArray, aim: IntArray) -> None:
    """Exchange units within columns until the rows of `chosen` are as near their aim as can be.

    Args:
        chosen: (P, K), changed in place; the sum of every column stays.
        showable: (P, K), where a unit can be.
        aim: (P,) wanted row sums; rows are moved until no surplus over the aim can be passed on
            to a row that has two less. A chain of exchanges through other rows counts too, which
            makes the result the best there is for these columns.
    """
    while True:
        level = chosen.sum(axis=1) - aim
        if level.max() - level.min() < 2:
            return
        gives = chosen.astype(np.float32)
        takes = (showable & ~chosen).astype(np.float32)
        chain = _chain(level, gives @ takes.T > 0)
        if chain is None:
            return
        for giver, taker in itertools.pairwise(chain):
            column = np.flatnonzero(chosen[giver] & showable[taker] & ~chosen[taker])[0]
            chosen[giver, column], chosen[taker, column] = False, True


# --- Private -----------------------------------------------------------------------------------


def _chain(level: IntArray, can_give: BoolArray) -> list[int] | None:
    """The shortest way by `can_give` (P, P) from a row down to one at least two lower."""
    for source in np.argsort(-level, kind="stable"):
        came_from = {int(source): -1}
        queue = deque([int(source)])
        while queue:
            row = queue.popleft()
            if level[source] - level[row] >= 2:
                chain = [row]
                while came_from[chain[-1]] >= 0:
                    chain.append(came_from[chain[-1]])
                return chain[::-1]
            for taker in np.flatnonzero(can_give[row]):
                if int(taker) not in came_from:
                    came_from[int(taker)] = row
                    queue.append(int(taker))
    return None


def _level(capacity: IntArray, total: int) -> FloatArray:
    """Share a total equally among vessels that hold no more than their capacity each."""
    level = np.zeros(len(capacity))
    left = float(total)
    while left > 1e-9:
        open_ = capacity - level > 1e-9
        poured = np.where(open_, np.minimum(capacity - level, left / open_.sum()), 0.0)
        level += poured
        left -= poured.sum()
    return level
