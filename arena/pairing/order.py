"""In which order an expert sees the chosen units, and which side each picture is on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


def put_in_order(
    chosen: BoolArray, gap: int, rng: np.random.Generator
) -> tuple[list[list[tuple[int, int]]], int]:
    """Each expert's units (pair, scenario) in order, and the gap that all orders keep."""
    counts = chosen.sum(axis=1)
    held = min(_largest_gap(row, gap) for row in counts)
    orders = []
    for expert, row in enumerate(counts):
        waiting = [rng.permutation(np.flatnonzero(column)).tolist() for column in chosen[expert].T]
        sequence = _sequence(row, held, rng)
        orders.append([(waiting[scenario].pop(), scenario) for scenario in sequence])
    return orders, held


def deal_sides(
    orders: list[list[tuple[int, int]]], pairs: int, rng: np.random.Generator
) -> list[BoolArray]:
    """Which showings to turn around: half of each expert's of a pair, odd ones in turn."""
    flipped = [np.zeros(len(order), dtype=bool) for order in orders]
    odd_turn = rng.random(pairs) < 0.5
    for expert in rng.permutation(len(orders)):
        showings: dict[int, list[int]] = {}
        for index, (pair, _) in enumerate(orders[expert]):
            showings.setdefault(pair, []).append(index)
        for pair, places in showings.items():
            turned = len(places) // 2
            if len(places) % 2:
                turned += int(odd_turn[pair])
                odd_turn[pair] = not odd_turn[pair]
            flipped[expert][rng.permutation(places)[:turned]] = True
    return flipped


def _largest_gap(counts: IntArray, gap: int) -> int:
    """The most matchups up to `gap` that can lie between two of a scenario.

    The fullest scenarios span (most - 1) blocks of gap + 1 and need one more place each.
    """
    most = int(counts.max())
    if most < 2:
        return gap
    fullest = int((counts == most).sum())
    return min(gap, (int(counts.sum()) - fullest) // (most - 1) - 1)


def _sequence(counts: IntArray, gap: int, rng: np.random.Generator) -> list[int]:
    """Scenarios in an order with at least `gap` others in between: always the fullest allowed."""
    left = counts.astype(float)
    sequence: list[int] = []
    for _ in range(int(counts.sum())):
        score = left + rng.random(len(left))
        score[left < 1] = -np.inf
        if gap:
            score[sequence[-gap:]] = -np.inf
        scenario = int(np.argmax(score))
        sequence.append(scenario)
        left[scenario] -= 1
    return sequence
