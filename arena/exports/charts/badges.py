"""Where the numbers of points stand, so that none covers another."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

Place = tuple[float, float]
Box = tuple[float, float, float, float]
"""Left, right, top and bottom of the plot."""

_DIRECTIONS = 12
_RINGS = 40


def badge_places(points: Sequence[Place], *, radius: float, box: Box) -> list[Place]:
    """A place for the badge of each point: on it where free, else as near as there is room.

    Args:
        points: In the picture's units; earlier ones have the first choice.
        radius: Of a badge.
        box: What the badges' centres stay in.
    """
    taken: list[Place] = []
    for point in points:
        free = (place for place in _around(point, radius, box) if _is_free(place, taken, radius))
        taken.append(next(free, point))
    return taken


def _around(point: Place, radius: float, box: Box) -> Iterator[Place]:
    """The point, then rings around it; sideways first, as intervals stand upright."""
    yield point
    left, right, top, bottom = box
    for ring in range(2, _RINGS):
        for turn in range(_DIRECTIONS):
            half = (turn + 1) // 2 * (-1) ** turn
            angle = 2.0 * math.pi * half / _DIRECTIONS
            x = point[0] + ring * 1.1 * radius * math.cos(angle)
            y = point[1] + ring * 1.1 * radius * math.sin(angle)
            if left <= x <= right and top <= y <= bottom:
                yield round(x, 1), round(y, 1)


def _is_free(place: Place, taken: Sequence[Place], radius: float) -> bool:
    return all(math.dist(place, other) >= 2.1 * radius for other in taken)
