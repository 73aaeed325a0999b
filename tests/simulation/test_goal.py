from __future__ import annotations

from dataclasses import replace

import pytest

from augment.prompts.vectors import scene_text
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import Point, SceneOptions, TrafficDensity, TurnType
from augment.scene.lane_graph import LaneGraph
from augment.simulation.route import find_route
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


def test_distances_run_along_the_way_to_the_goal() -> None:
    scene = replace(junction(), options=SceneOptions(goal=TurnType.LEFT))
    route = EgoRoute.of(scene)
    assert route
    assert route.lane_ids == ("Lane1", "Connector2", "Lane3")


def test_a_prompt_says_density_and_goal_where_a_scenario_has_them() -> None:
    plain = junction()
    options = SceneOptions(density=TrafficDensity.HIGH, goal=TurnType.LEFT)
    added = set(scene_text(replace(plain, options=options)).split("\n\n")) - set(
        scene_text(plain).split("\n\n")
    )
    assert added == {
        "The traffic around the ego has a high density.",
        "The ego's goal: its way turns left where the lanes first part.",
    }
