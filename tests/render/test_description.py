"""The text description: right answers, and that it tells no more than the picture."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.render.bev import draw
from augment.render.camera import camera_for
from augment.render.legend import CHANGED, GONE, DescribedAgent, change_keys, describe, scene_keys
from augment.scene.entities import AgentType, Modification, SceneOptions, TrafficAgent, TurnType
from tests.properties import examples
from tests.scenes import cone, junction, pedestrian, scene, vehicle

STREET = scene(agents=(vehicle("Agent2", 20.04, -3.46), vehicle("Agent3", -12.0, 3.5, math.pi)))


def line_of(agent: TrafficAgent) -> DescribedAgent:
    (line,) = describe(STREET, Modification(added=(agent,)))
    return line


@pytest.mark.parametrize(
    ("x_m", "y_m", "ahead_m", "left_m"),
    [
        (21.44, -1.96, 21.4, -2.0),
        (-8.26, 3.5, -8.3, 3.5),
        (0.04, -0.04, 0.0, 0.0),
        (150.0, 40.0, 150.0, 40.0),  # outside the picture
    ],
)
def test_places_are_metres_ahead_and_left_to_one_decimal(
    x_m: float, y_m: float, ahead_m: float, left_m: float
) -> None:
    line = line_of(vehicle("new", x_m, y_m))
    assert (line.ahead_m, line.left_m) == (ahead_m, left_m)
    assert "-0.0" not in (str(line.ahead_m), str(line.left_m))


@pytest.mark.parametrize(
    ("degrees", "told"),
    [(0, 0), (2.4, 0), (-2.4, 0), (2.6, 5), (31, 30), (-90, -90), (178, 180), (-178, 180)],
)
def test_headings_are_told_in_steps_of_five_degrees(degrees: float, told: int) -> None:
    assert line_of(vehicle("new", 10.0, 0.0, math.radians(degrees))).heading_deg == told
    assert line_of(vehicle("new", 10.0, 0.0, math.radians(degrees + 360))).heading_deg == told


def test_who_walks_has_the_end_of_the_walk_in_place_of_a_speed() -> None:
    walker = pedestrian("new", 12.0, 5.0, walk_to_m=(12.04, -4.96))
    line = line_of(replace(walker, speed_mps=1.4))
    assert (line.walk_to_m, line.speed_mps, line.heading_deg) == ((12.0, -5.0), None, -90)
    still = line_of(pedestrian("new", 12.0, 5.0, walk_to_m=(12.05, 5.0)))
    assert (still.walk_to_m, still.speed_mps) == (None, 0.0)


def test_the_nearest_come_first_then_the_kinds_then_what_is_gone() -> None:
    bus = replace(vehicle("a", 6.0, 8.0), type=AgentType.BUS)
    change = Modification(
        added=(vehicle("z", 10.0, 0.0), bus, cone("m", -3.0, 0.0)), removed=("Agent2", "Agent3")
    )
    told = [(line.change, line.kind, line.ahead_m) for line in describe(STREET, change)]
    assert told == [
        (CHANGED, "TRAFFIC_CONE", -3.0),
        (CHANGED, "BUS", 6.0),
        (CHANGED, "VEHICLE", 10.0),
        (GONE, "VEHICLE", -12.0),
        (GONE, "VEHICLE", 20.0),
    ]


def test_moving_an_agent_is_told_like_taking_it_away_and_adding_another() -> None:
    """Their pictures are the same, so their texts are."""
    moved = Modification(moved=(vehicle("Agent2", 30.0, 0.0),))
    replaced = Modification(added=(vehicle("new", 30.0, 0.0),), removed=("Agent2",))
    assert describe(STREET, moved) == describe(STREET, replaced)
    camera = camera_for(STREET, None)
    assert draw(STREET, moved, camera) == draw(STREET, replaced, camera)


# --- Properties --------------------------------------------------------------------------------

METRES = st.floats(-60.0, 60.0)
AGENTS = st.lists(
    st.builds(
        TrafficAgent,
        id=st.just("any"),
        type=st.sampled_from([kind for kind in AgentType if kind is not AgentType.EGO_VEHICLE]),
        x_m=METRES,
        y_m=METRES,
        heading_rad=st.floats(-3.1, 3.1),
        width_m=st.just(1.0),
        length_m=st.just(2.0),
        speed_mps=st.floats(0.0, 20.0),
        walk_to_m=st.none() | st.tuples(METRES, METRES),
    ),
    max_size=6,
)


def changed(agents: list[TrafficAgent], names: str = "abcdef") -> Modification:
    named = zip(agents, names, strict=False)
    return Modification(added=tuple(replace(agent, id=name) for agent, name in named))


@examples(60)
@given(AGENTS, st.randoms(use_true_random=False))
def test_neither_ids_nor_their_order_leave_a_trace(
    agents: list[TrafficAgent], rng: object
) -> None:
    shuffled = list(agents)
    rng.shuffle(shuffled)  # type: ignore[attr-defined]
    told = describe(STREET, changed(agents))
    assert describe(STREET, changed(shuffled, "zyxwvu")) == told


VIEW = {"px_per_m": 20.0, "ego_px": [300.0, 400.0], "width": 1200, "height": 800}


def test_traffic_junctions_and_goals_are_named_where_they_are_drawn() -> None:
    moving = replace(vehicle("Agent2", 20.0, 0.0), speed_mps=5.0)
    assert scene_keys(scene(agents=(moving,)), VIEW) >= {"recorded", "motion"}
    far = replace(moving, x_m=500.0)
    assert not scene_keys(scene(agents=(far,)), VIEW) & {"recorded"}
    left = replace(junction(), options=SceneOptions(goal=TurnType.LEFT))
    assert scene_keys(left, VIEW) >= {"junction", "goal"}


def test_a_change_names_its_marks_and_what_lies_outside() -> None:
    change = Modification(
        added=(
            replace(vehicle("Added1", 20.0, 0.0), type=AgentType.BUS),
            cone("Added2", 10.0, 1.0),
            pedestrian("Added3", 15.0, -4.0, (15.0, 4.0)),
        )
    )
    assert change_keys(change, VIEW) == {"changed", "bus", "cone", "person", "walk"}
    away = Modification(added=(cone("Added1", 100.0, 0.0),))
    assert change_keys(away, VIEW) == {"outside"}
