"""What somebody judges who joins a study that is under way.

A pure function of what is planned so far and of a generator. Notation: P pairs, S scenarios.
"""

from __future__ import annotations

import numpy as np

from arena.pairing.arrays import IntArray
from arena.pairing.later import Wanted
from arena.pairing.rules import Grid


def choose_units(
    grid: Grid, judges: IntArray, count: int, rng: np.random.Generator
) -> list[Wanted]:
    """Units for a newcomer, so that pairs and scenarios stay as equal as they can.

    One after the other: of the pairs that come least in this choice those that are planned least
    so far, and of those one by lot; of its scenarios those with the fewest judges, of those the
    ones that come least in this choice, then those that are planned least so far over all pairs,
    and of those one by lot.

    Args:
        grid: What can be shown.
        judges: (P, S) how many experts have each unit.
        count: How many; fewer where there are not so many units.
        rng: The lots.
    """
    free = grid.showable.copy()
    counts = judges.copy()
    of_pair = np.zeros(free.shape[0], dtype=np.int64)
    of_scenario = np.zeros(free.shape[1], dtype=np.int64)
    chosen: list[Wanted] = []
    while len(chosen) < count and free.any():
        open_pairs = np.flatnonzero(free.any(axis=1))
        planned = counts[open_pairs].sum(axis=1)
        pairs = open_pairs[_least(of_pair[open_pairs], planned)]
        pair = int(rng.choice(pairs))
        open_scenarios = np.flatnonzero(free[pair])
        scenarios = open_scenarios[
            _least(
                counts[pair, open_scenarios],
                of_scenario[open_scenarios],
                counts[:, open_scenarios].sum(axis=0),
            )
        ]
        scenario = int(rng.choice(scenarios))
        chance = 1.0 / (len(pairs) * len(scenarios))
        chosen.append(Wanted(pair=pair, scenario=scenario, chance=chance))
        free[pair, scenario] = False
        counts[pair, scenario] += 1
        of_pair[pair] += 1
        of_scenario[scenario] += 1
    return chosen


def _least(*keys: IntArray) -> np.ndarray:
    """Where the first is least, among those the second, and so on."""
    left = np.arange(len(keys[0]))
    for key in keys:
        left = left[key[left] == key[left].min()]
    return left
