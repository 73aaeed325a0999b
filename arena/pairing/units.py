"""Assignment of units to experts: balanced over scenarios first, then over pairs.

Notation: E experts, P pairs, S scenarios.
"""

import itertools
import math
from collections import deque

import numpy as np

from arena.errors import NothingToPlan
from arena.pairing.order import BoolArray, IntArray


def choose_units(
    showable: BoolArray, experts: int, votes: int, rng: np.random.Generator
) -> BoolArray:
    """Units per expert, (E, P, S): balanced over scenarios first, then over pairs.

    On each scenario the pairs that the expert is owed most, then those that fewest experts have
    judged there, then by lot.
    """
    pairs, scenarios = showable.shape
    of_scenario = quotas(showable.sum(axis=0), experts, votes, rng)
    of_pair = quotas(showable.sum(axis=1), experts, votes, rng)
    chosen = np.zeros((experts, pairs, scenarios), dtype=bool)
    judges = np.zeros((pairs, scenarios))
    for expert in range(experts):
        mine, owed = chosen[expert], of_pair[expert].astype(float)
        for scenario in rng.permutation(scenarios):
            # (P,): what is owed outweighs any number of judges, and these the lots below 1.
            score = 1e4 * owed - judges[:, scenario] + rng.random(pairs)
            score[~showable[:, scenario]] = -np.inf
            picked = np.argsort(-score)[: of_scenario[expert, scenario]]
            mine[picked, scenario] = True
            owed[picked] -= 1
        even_out(mine, showable, of_pair[expert])
        judges += mine
    # (P, E * S): with each expert's scenarios as columns of their own, whose sums stay, pairs are
    # evened out over everybody.
    flat = chosen.transpose(1, 0, 2).reshape(pairs, experts * scenarios)
    everywhere = np.tile(showable, (1, experts))
    even_out(flat, everywhere, np.zeros(pairs, dtype=np.int64))
    return flat.reshape(pairs, experts, scenarios).transpose(1, 0, 2)


def quotas(capacity: IntArray, experts: int, votes: int, rng: np.random.Generator) -> IntArray:
    """Shares (E, n) of the votes of each expert: equal to +-1 by row and by column total.

    A place whose capacity is too small gets its capacity. The odd votes go around in one circle
    over all experts, so that nobody and no place collects them.
    """
    base = np.zeros(len(capacity), dtype=np.int64)
    # One more for every place with room, as long as that can be given to all of them.
    while (base + (base < capacity)).sum() <= votes and (base < capacity).any():
        base += base < capacity
    odd = votes - int(base.sum())
    quotas = np.tile(base, (experts, 1))
    places = rng.permutation(np.flatnonzero(base < capacity))
    for expert in range(experts):
        # The circle goes on where the odd votes of the expert before ended.
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
        # gives @ takes' (P, P): in how many columns a row can give to another one; as floats,
        # which multiply fast.
        gives = chosen.astype(np.float32)
        takes = (showable & ~chosen).astype(np.float32)
        chain = _chain(level, gives @ takes.T > 0)
        if chain is None:
            return
        for giver, taker in itertools.pairwise(chain):
            column = np.flatnonzero(chosen[giver] & showable[taker] & ~chosen[taker])[0]
            chosen[giver, column], chosen[taker, column] = False, True


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


_MOST_AT_ONCE = 250
"""Units of an expert that are held against each other at a time."""
_TRIES = 8
"""Rounds over all experts without an exchange, after which units are taken over."""


def bring_together(
    chosen: BoolArray, showable: BoolArray, share: float, rng: np.random.Generator
) -> None:
    """Exchange units until so many of the judged ones are judged by two experts or more.

    Args:
        chosen: (E, P, S), changed in place; everybody's sums over pairs and over scenarios stay,
            unless no exchange within them is left: then units are taken over from others.
        showable: (P, S), where a unit can be.
        share: Of the judged units, from 0 to 1; a plan that has more keeps it.
        rng: Says which.

    Raises:
        NothingToPlan: One expert alone, or one with far more units than the others.
    """
    judges = chosen.sum(axis=0)
    idle = 0
    while not _is_reached(judges, share):
        bring = _exchange if idle < _TRIES else _take_over
        moved = sum(
            bring(chosen[expert], judges, showable, rng)
            for expert in rng.permutation(len(chosen))
            if not _is_reached(judges, share)
        )
        if not moved and bring is _take_over:
            raise NothingToPlan(
                f"Of the pairs that are judged, {share:.0%} are to be judged by two experts or "
                f"more; {int((judges > 1).sum())} of {int((judges > 0).sum())} are reached. "
                "Ask for less, or for more experts."
            )
        idle = 0 if moved and idle < _TRIES else idle + 1


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
    # (n, n): unit i takes the scenario of j, and j that of i; row and column sums stay.
    fits = free[pair[:, None], scenario[None, :]] & free[pair[None, :], scenario[:, None]]
    others = judges[pair[:, None], scenario[None, :]]
    # How many of the two new units somebody else judges already.
    gain = np.minimum(others, 1) + np.minimum(others.T, 1)
    gain[~fits] = 0
    if not gain.size or not gain.max():
        return False
    first, other = np.unravel_index(int(gain.argmax()), gain.shape)
    for unit, change in (
        ((pair[first], scenario[first]), -1),
        ((pair[other], scenario[other]), -1),
        ((pair[first], scenario[other]), 1),
        ((pair[other], scenario[first]), 1),
    ):
        mine[unit] = change > 0
        judges[unit] += change
    return True


def _take_over(mine: BoolArray, judges: IntArray, _: BoolArray, rng: np.random.Generator) -> bool:
    """Give up a unit of one expert (P, S) for one of others, as near to even sums as can be."""
    alone = rng.permutation(np.argwhere(mine & (judges == 1)))[:_MOST_AT_ONCE]
    others = rng.permutation(np.argwhere(~mine & (judges > 0)))[:_MOST_AT_ONCE]
    if not len(alone) or not len(others):
        return False
    # (n, m): units that one other judges come first.
    cost = np.where(judges[tuple(others.T)] == 1, 0, judges.size)[None, :]
    for axis in (0, 1):
        here, there = alone[:, None, axis], others[None, :, axis]
        for counts in (mine.sum(axis=1 - axis), judges.sum(axis=1 - axis)):
            # Half of what the sum of squared counts changes by when one moves.
            cost = cost + np.where(here == there, 0, counts[there] - counts[here] + 1)
    giver, taken = np.unravel_index(int(cost.argmin()), cost.shape)
    for unit, change in ((alone[giver], -1), (others[taken], 1)):
        mine[tuple(unit)] = change > 0
        judges[tuple(unit)] += change
    return True
