"""The entries of the web's legend: what a picture shows, and no more."""

from dataclasses import replace

from augment.render.legend import change_keys, scene_keys
from augment.scene.entities import AgentType, Modification, SceneOptions, TurnType
from tests.scenes import cone, junction, pedestrian, scene, vehicle

VIEW = {"px_per_m": 20.0, "ego_px": [300.0, 400.0], "width": 1200, "height": 800}


def test_traffic_junctions_and_goals_are_named_where_they_are_drawn() -> None:
    moving = vehicle("Agent2", 20.0, 0.0, speed_mps=5.0)
    assert scene_keys(scene(agents=(moving,)), VIEW) >= {"recorded", "motion"}
    far = replace(moving, x_m=500.0)
    assert not scene_keys(scene(agents=(far,)), VIEW) & {"recorded"}
    left = replace(junction(), options=SceneOptions(goal=TurnType.LEFT))
    assert scene_keys(left, VIEW) >= {"junction", "goal"}


def test_a_change_names_its_marks_and_what_lies_outside() -> None:
    change = Modification(
        added=(
            vehicle("Added1", 20.0, 0.0, type=AgentType.BUS),
            cone("Added2", 10.0, 1.0),
            pedestrian("Added3", 15.0, -4.0, (15.0, 4.0)),
        )
    )
    assert change_keys(change, VIEW) == {"changed", "bus", "cone", "person", "walk"}
    away = Modification(added=(cone("Added1", 100.0, 0.0),))
    assert change_keys(away, VIEW) == {"outside"}
