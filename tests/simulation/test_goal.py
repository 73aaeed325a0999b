from __future__ import annotations

from dataclasses import replace

import pytest

from augment.scene.entities import Point, SceneOptions, TurnType
from augment.scene.lane_graph import LaneGraph
from augment.simulation.road import find_route
from tests.scenes import junction


@pytest.mark.parametrize(
    ("goal", "goal_m", "route"),
    [
        (None, None, ("Lane1", "Connector1", "Lane2")),
        (TurnType.STRAIGHT, None, ("Lane1", "Connector1", "Lane2")),
        (TurnType.LEFT, None, ("Lane1", "Connector2", "Lane3")),
        (TurnType.LEFT, (27.0, 40.0), ("Lane1", "Connector2", "Lane3")),
        (TurnType.STRAIGHT, (27.0, 40.0), ("Lane1", "Connector2", "Lane3")),
        (TurnType.RIGHT, None, ("Lane1", "Connector1", "Lane2")),
    ],
)
def test_a_drive_takes_the_way_to_the_goal_where_there_is_one(
    goal: TurnType | None, goal_m: Point | None, route: tuple[str, ...]
) -> None:
    scene = replace(junction(), options=SceneOptions(goal=goal, goal_m=goal_m))
    assert find_route(scene, LaneGraph(scene), None) == route
