"""Angles in radians, counter-clockwise from +x."""

from __future__ import annotations

import math


def wrap(angle_rad: float) -> float:
    """The same direction in (-pi, pi]."""
    wrapped = math.remainder(angle_rad, 2.0 * math.pi)
    return math.pi if wrapped == -math.pi else wrapped


def difference(to_rad: float, from_rad: float) -> float:
    """The turn from one heading to another, in (-pi, pi], positive to the left."""
    return wrap(to_rad - from_rad)
