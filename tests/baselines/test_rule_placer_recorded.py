from __future__ import annotations

from pathlib import Path

import pytest

from augment.baselines.rule_placer import place
from augment.geometry.frames import difference
from augment.scene.entities import apply, without_traffic
from augment.scene.lane_graph import LaneGraph
from tests.intents import PAPER
from tests.recorded import recorded

pytestmark = pytest.mark.realdata


@pytest.mark.parametrize("frame", [0, 30, 60])
def test_the_papers_vehicle_stands_on_the_egos_lane(realdata: Path, frame: int) -> None:
    scene = without_traffic(recorded(realdata, frame)[0])
    modification = place(scene, PAPER).modification
    (car,) = modification.added
    assert apply(scene, modification).agents == (car,)
    graph = LaneGraph(scene)
    own = scene.ego.lane_id or graph.under(0.0, 0.0, 0.0)
    assert own is not None
    start_m = graph.lane(own).centerline.project(0.0, 0.0).s_m
    asked = graph.along(own, start_m, 21.4)
    assert asked is not None
    seen = asked.pose.pose_to_local(car.pose)
    assert seen.x_m == pytest.approx(0.0, abs=0.01)
    assert 0.0 <= seen.y_m <= 1.5
    assert abs(difference(car.heading_rad, asked.pose.heading_rad)) < 1e-4
    assert car.lane_id == asked.lane_id
