"""How the rule placer places people who cross, cones and crashed cars."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from augment.geometry.frames import overlap
from augment.scene.entities import AgentType
from augment.scene.intent import Shape, Side
from tests.baselines.placing import added
from tests.intents import LEFT_EDGE, cones, crash, metres, towards, walk
from tests.scenes import curve, scene


@pytest.mark.parametrize(
    ("side", "start", "end", "heading_rad"),
    [
        (Side.RIGHT, (18.0, -2.25), (18.0, 5.75), math.pi / 2),
        (Side.LEFT, (18.0, 5.75), (18.0, -2.25), -math.pi / 2),
    ],
)
def test_a_pedestrian_crosses_from_edge_to_edge(
    side: Side, start: tuple[float, float], end: tuple[float, float], heading_rad: float
) -> None:
    (walker,) = added(scene(), walk(18.0, side))
    assert walker.type is AgentType.PEDESTRIAN
    assert walker.walk_to_m is not None
    assert (walker.x_m, walker.y_m) == pytest.approx(start, abs=0.26)
    assert walker.walk_to_m == pytest.approx(end, abs=0.26)
    assert walker.heading_rad == pytest.approx(heading_rad, abs=1e-4)
    assert walker.speed_mps == pytest.approx(math.dist(start, end) / 15.0, abs=0.03)


def test_a_taper_closes_the_lane_and_a_worker_stands_behind_it() -> None:
    *line, worker = added(
        scene(), cones(20.0, 6, Shape.TAPER, spacing=metres(2.5), start=Side.LEFT, has_worker=True)
    )
    gaps = [math.dist((a.x_m, a.y_m), (b.x_m, b.y_m)) for a, b in itertools.pairwise(line)]
    assert gaps == pytest.approx([2.5] * 5, abs=0.01)
    assert (line[0].x_m, line[0].y_m, line[-1].y_m) == (20.0, 1.5, -1.5)
    assert worker.type is AgentType.PEDESTRIAN
    assert worker.walk_to_m is None
    assert 0.8 < min(math.dist((worker.x_m, worker.y_m), (c.x_m, c.y_m)) for c in line) < 4.0


def test_a_line_of_cones_follows_a_curved_boundary() -> None:
    line = added(curve(40.0), cones(20.0, 4, Shape.LINE, lateral=towards(LEFT_EDGE)))
    radii = [math.hypot(c.x_m - 10.0, c.y_m - 40.0) for c in line]
    assert radii == pytest.approx([38.5] * 4, abs=0.02)


@pytest.mark.parametrize(("count", "apart_m"), [(3, 1.5), (8, 2.5), (7, 2.0)])
def test_a_ring_stays_in_its_lane_and_closes(count: int, apart_m: float) -> None:
    ring = added(scene(), cones(25.0, count, Shape.RING, spacing=metres(apart_m)))
    assert max(abs(c.y_m) for c in ring) <= 1.75
    points = np.array([(c.x_m, c.y_m) for c in ring])
    gaps = np.hypot(*(points - np.roll(points, 1, axis=0)).T)
    assert gaps == pytest.approx(apart_m, abs=0.51)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_crashed_cars_touch_at_most_and_leave_little_room(count: int) -> None:
    cars = added(scene(), crash(25.0, count))
    boxes = [car.box for car in cars]
    assert len(cars) == count
    assert cars[0].x_m == 25.0
    for i, first in enumerate(boxes):
        assert all(overlap(first, second).depth_m == 0.0 for second in boxes[i + 1 :])
    for a, b in itertools.pairwise(cars):
        assert 3.3 < math.dist((a.x_m, a.y_m), (b.x_m, b.y_m)) < 6.0
