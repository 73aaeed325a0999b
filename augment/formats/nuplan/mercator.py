"""Longitude and latitude as the metres of a UTM zone.

The transverse Mercator of the WGS 84 ellipsoid by Krüger's series to the fourth order in the third
flattening: within a micrometre inside a zone (Karney, Transverse Mercator with an accuracy of a
few nanometers, J. Geodesy 85, 2011).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

WGS84_A_M = 6_378_137.0
WGS84_F = 1.0 / 298.257223563
SCALE = 0.9996
FALSE_EAST_M = 500_000.0
FALSE_NORTH_M = 10_000_000.0

_N = WGS84_F / (2.0 - WGS84_F)
_E = math.sqrt(WGS84_F * (2.0 - WGS84_F))
_RADIUS_M = WGS84_A_M / (1.0 + _N) * (1.0 + _N**2 / 4.0 + _N**4 / 64.0)
_ALPHA = (
    _N / 2.0 - 2.0 * _N**2 / 3.0 + 5.0 * _N**3 / 16.0 + 41.0 * _N**4 / 180.0,
    13.0 * _N**2 / 48.0 - 3.0 * _N**3 / 5.0 + 557.0 * _N**4 / 1440.0,
    61.0 * _N**3 / 240.0 - 103.0 * _N**4 / 140.0,
    49561.0 * _N**4 / 161280.0,
)


def to_utm(degrees: FloatArray, *, zone: int, is_south: bool) -> FloatArray:
    """East and north (P, 2) in metres.

    Args:
        degrees: Longitude and latitude (P, 2).
        zone: 1 to 60.
        is_south: Whether it is a zone of the southern hemisphere.
    """
    longitude = np.radians(degrees[:, 0] - (6.0 * zone - 183.0))
    sine = np.sin(np.radians(degrees[:, 1]))
    conformal = np.sinh(np.arctanh(sine) - _E * np.arctanh(_E * sine))
    xi = np.arctan2(conformal, np.cos(longitude))
    eta = np.arcsinh(np.sin(longitude) / np.hypot(conformal, np.cos(longitude)))
    north, east = xi.copy(), eta.copy()
    for order, alpha in enumerate(_ALPHA, start=1):
        north += alpha * np.sin(2.0 * order * xi) * np.cosh(2.0 * order * eta)
        east += alpha * np.cos(2.0 * order * xi) * np.sinh(2.0 * order * eta)
    return np.column_stack(
        [
            FALSE_EAST_M + SCALE * _RADIUS_M * east,
            (FALSE_NORTH_M if is_south else 0.0) + SCALE * _RADIUS_M * north,
        ]
    )
