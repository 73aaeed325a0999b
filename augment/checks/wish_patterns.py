"""Objects of one request that hang together: in rows and shapes, or each against another one.

A `Pattern` has a slot for every object, which lie where some numbers within their ranges put
them; a `Chain` puts each object so far from one before it. Both say where an intent admits the
objects together, and which of these placements is nearest to another one.

Notation: N slots, M objects (at most N), K numbers. Points are in the scene's frame.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np

from augment.checks.wish_places import Span
from augment.geometry.polyline import FloatArray
from augment.scene.entities import Point

MOST_ORDERED = 5
"""Objects of which every order is tried."""
THERE_M = 1e-3
"""Coordinates are written in millimetres."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Pattern:
    """Slots that depend on a few numbers.

    Attributes:
        ranges: From and to of each of the K numbers.
        slots: From the numbers (K,) to the ends of a line per slot, (N, 2, 2), anywhere on which
            its object may stand; both ends are the same where it is a point.
    """

    ranges: tuple[Span, ...]
    slots: Callable[[FloatArray], FloatArray]

    def nearest(self, points: FloatArray, guess: Sequence[float]) -> FloatArray:
        """Return the nearest placement (M, 2) to points (M, 2).

        Args:
            points: Where the objects stand, in any order.
            guess: The numbers (K,) to begin with.
        """
        from scipy.optimize import minimize

        # (K,) each; only numbers that have a range are looked for.
        low, high = np.array(self.ranges, dtype=np.float64).T
        numbers = np.clip(np.array(guess, dtype=np.float64), low, high)
        free = np.flatnonzero(high > low)

        def total_m(values: FloatArray) -> float:
            tried = numbers.copy()
            tried[free] = np.clip(values, low[free], high[free])
            return float(np.hypot(*(self._assign(points, tried) - points).T).sum())

        if len(free) and total_m(numbers[free]) > THERE_M * len(points):
            # Infinite ranges are searched as far around the guess as anything is looked for.
            far = np.column_stack([numbers - 60.0, numbers + 60.0])[free]
            bounds = np.clip(far, low[free, None], high[free, None])
            # Powell's method asks for no slopes, which jump where the assignment changes; from two
            # starts, as the sum can have several valleys.
            starts: list[FloatArray] = [numbers[free], bounds.mean(axis=1)]
            options: Any = {"xtol": 1e-4, "ftol": 1e-7}
            results = [
                minimize(total_m, start, method="Powell", bounds=bounds.tolist(), options=options)
                for start in starts
            ]
            numbers[free] = min(results, key=lambda result: float(result.fun)).x
        return self._assign(points, numbers)

    def _assign(self, points: FloatArray, numbers: FloatArray) -> FloatArray:
        """Return where in its slot each point belongs, (M, 2), the sum of all ways the least."""
        ends = self.slots(numbers)
        begin, along = ends[:, 0], ends[:, 1] - ends[:, 0]
        # Foot of each point on each slot's line: (M, N) shares of its length, clipped to it.
        # (N,) squared lengths of the lines, not 0 where a slot is a point.
        length2 = np.maximum((along**2).sum(axis=1), 1e-12)
        shares = ((points[:, None] - begin) * along).sum(axis=2) / length2
        feet = begin + np.clip(shares, 0.0, 1.0)[..., None] * along
        pairs = match_nearest(np.hypot(*(feet - points[:, None]).transpose(2, 0, 1)))
        return np.array([feet[pair] for pair in pairs])


def match_nearest(apart_m: FloatArray) -> list[tuple[int, int]]:
    """Return pairs of a row and a column of which the sum of the distances is the smallest.

    Of an uneven matrix the smaller side is matched as a whole. Of matchings with the same sum the
    one with the smallest squares counts: 1 m and 1 m rather than 0 m and 2 m. Without it the
    order of the objects would decide.
    """
    from scipy.optimize import linear_sum_assignment

    # A distance of d metres weighs d (1 + 1e-6 d), which changes nothing else.
    rows, columns = linear_sum_assignment(apart_m * (1.0 + 1e-6 * apart_m))
    return list(zip(rows.tolist(), columns.tolist(), strict=True))


def find_step_m(at: Callable[[float], Point], begin: Point, from_m: float, gap_m: float) -> float:
    """Return how much further along the lane a point is that far away in a straight line.

    Args:
        at: From a station to its point.
        begin: The point to begin at, which may be elsewhere across the lane.
        from_m: The station of it.
        gap_m: From point to point.
    """
    step_m = gap_m
    for _ in range(5):  # each of them leaves a small part of what is missing
        step_m += gap_m - math.dist(begin, at(from_m + step_m))
    return step_m


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """Where an object stands from another one of its chain.

    Attributes:
        base: The index of that one, which comes before.
        gap_m: From centre to centre.
        toward_rad: In which direction, or at most `aside_rad` to either side of it.
    """

    base: int
    gap_m: Span
    toward_rad: float = 0.0
    aside_rad: float = math.pi

    def nearest(self, base: Point, point: Point) -> Point:
        """Return the nearest admitted point to another one: in a sector of a ring."""
        low_m, high_m = self.gap_m
        dx_m, dy_m = point[0] - base[0], point[1] - base[1]
        away_m = math.hypot(dx_m, dy_m)
        turn_rad = math.remainder(math.atan2(dy_m, dx_m) - self.toward_rad, 2.0 * math.pi)
        inside_rad = min(max(turn_rad, -self.aside_rad), self.aside_rad)
        # Beside the sector the nearest point lies on its edge, at the foot of the way there.
        reach_m = away_m * max(math.cos(turn_rad - inside_rad), 0.0)
        reach_m = min(max(reach_m, low_m), high_m)
        if inside_rad == turn_rad and reach_m == away_m:
            return point
        toward_rad = self.toward_rad + inside_rad
        return base[0] + reach_m * math.cos(toward_rad), base[1] + reach_m * math.sin(toward_rad)


@dataclass(frozen=True, kw_only=True, eq=False)
class Chain:
    """A first object with a place of its own, and others that stand so and so far from it.

    Attributes:
        first: From a point to the nearest one that is admitted for the first object.
    """

    first: Callable[[Point], Point]
    links: tuple[Link, ...]

    def nearest(self, points: Sequence[Point]) -> list[Point]:
        """Return the nearest placement to some points, whichever of them is the first."""
        orders = [tuple(range(len(points)))]
        if len(points) <= MOST_ORDERED:
            orders = list(permutations(orders[0]))

        def miss_m(order: Sequence[int]) -> float:
            ordered = [points[at] for at in order]
            return sum(map(math.dist, self._place(ordered, ordered[0]), ordered))

        order = min(orders, key=miss_m)
        ordered = [points[at] for at in order]

        def total_m(start: FloatArray) -> float:
            placed = self._place(ordered, (float(start[0]), float(start[1])))
            return sum(map(math.dist, placed, ordered))

        # The first may give way for the others: it begins where each of them would have it.
        starts = [np.array(ordered[0])]
        for link, point in zip(self.links, ordered[1:], strict=False):
            there = link.nearest(ordered[link.base], point)
            starts.append(starts[0] + np.array(point) - np.array(there))
        start = min(starts, key=total_m)
        if self.links and total_m(start) > THERE_M * len(points):
            from scipy.optimize import minimize

            # Two unknowns, x and y of the first, in metres.
            start = minimize(total_m, start, method="Nelder-Mead", options={"xatol": 1e-4}).x
        best = self._place(ordered, (float(start[0]), float(start[1])))
        back = dict(zip(order, best, strict=True))
        return [back[at] for at in range(len(points))]

    def _place(self, points: Sequence[Point], start: Point) -> list[Point]:
        placed = [self.first(start)]
        for link, point in zip(self.links, points[1:], strict=False):
            placed.append(link.nearest(placed[link.base], point))
        return placed
