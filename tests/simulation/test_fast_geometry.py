"""The quick tests of many things at once, held against shapely and scipy."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from augment.simulation.path import Path, Region, dense
from augment.simulation.states import corners, meet
from tests.properties import examples

metres = st.floats(-8.0, 8.0)
angles = st.floats(-math.pi, math.pi)
sizes = st.floats(0.2, 6.0)
boxes = st.tuples(metres, metres, angles, sizes, sizes)


@examples(25)
@given(st.lists(st.tuples(boxes, boxes), min_size=1, max_size=20))
def test_boxes_meet_where_their_polygons_do(pairs: list[tuple[tuple[float, ...], ...]]) -> None:
    first, second = (np.array([pair[side] for pair in pairs]) for side in (0, 1))
    a, b = shapely.polygons(corners(first)), shapely.polygons(corners(second))
    clear = np.abs(shapely.distance(a, b) - 1e-9) > 1e-9  # nobody argues about rounding
    clear |= shapely.area(shapely.intersection(a, b)) > 1e-9
    assert (meet(first, second) == shapely.intersects(a, b))[clear].all()


@examples(25)
@given(st.integers(0, 2**32 - 1))
def test_a_region_answers_as_its_polygon_does(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rings = [rng.uniform(-20.0, 20.0, (3, 2)) for _ in range(4)]
    ground = shapely.union_all([shapely.Polygon(ring) for ring in rings])
    points = rng.uniform(-25.0, 25.0, (40, 10, 2))
    found = Region(ground).contains(points)
    assert (found == shapely.contains_xy(ground, points[..., 0], points[..., 1])).all()


@examples(25)
@given(st.integers(0, 2**32 - 1))
def test_places_beside_a_path_are_those_of_the_whole_line(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = np.cumsum(rng.uniform(-0.02, 0.02, 200))
    line = dense(np.cumsum(np.stack([np.cos(turn), np.sin(turn)], axis=1), axis=0))
    path = Path(line)
    inside = rng.uniform(5.0, path.length_m - 5.0, 50)
    aside = rng.uniform(-5.0, 5.0, 50)
    poses = path.poses(inside)
    points = poses[:, :2] + aside[:, None] * np.stack(
        [-np.sin(poses[:, 2]), np.cos(poses[:, 2])], axis=1
    )
    s_m, d_m = path.beside(points)
    whole = shapely.LineString(line)
    assert np.abs(d_m) == pytest.approx(shapely.distance(shapely.points(points), whole), abs=1e-9)
    assert s_m == pytest.approx(shapely.line_locate_point(whole, shapely.points(points)), abs=1e-6)
    assert (np.sign(d_m) == np.sign(aside))[np.abs(aside) > 0.05].all()
