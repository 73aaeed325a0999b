import json
import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.errors import ToolError
from augment.geometry.polyline import Polyline
from augment.prompts.vectors import control_points, short_names, with_short_ids
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AreaKind, InterplanRules, Scene, SceneOptions, TurnType
from augment.scene.lane_graph import LaneGraph
from augment.scene.planned_motion import LanePath
from augment.scene.planned_mover import check_lane_path
from augment.variants.pose_tool import PoseTool
from augment.variants.retrieval import OBJECT_TYPES
from tests.fixtures.shelf import whole_scene
from tests.properties import examples
from tests.scenes import curve, junction, lanes, scene, vehicle

JUNCTION = PoseTool(junction())
STREET = PoseTool(scene(agents=(vehicle("Agent2", 12.0, 3.9, math.pi),)))
BEND = PoseTool(curve())


def test_a_distance_from_the_ego_is_measured_along_its_lane() -> None:
    place = BEND.pose_on_lane("Lane1", "Agent1", 10.0 + 40.0 * math.radians(30.0), 1.0)
    assert place.pose.x_m == pytest.approx(10.0 + 39.0 * math.sin(math.radians(30.0)), abs=0.02)
    assert place.pose.y_m == pytest.approx(40.0 - 39.0 * math.cos(math.radians(30.0)), abs=0.02)
    assert math.degrees(place.pose.heading_rad) == pytest.approx(30.0, abs=0.5)
    assert place.start_lateral_m == pytest.approx(0.0, abs=0.01)


def test_the_answer_carries_what_an_agent_of_the_block_needs() -> None:
    assert JUNCTION.answer({"lane": "Lane1", "start": "Agent1", "distance_m": 15}) == {
        **{"x_m": 15.0, "y_m": 0.0, "heading_rad": 0.0, "heading_deg": 0.0, "lane": "Lane1"},
        **{"taken_by": None, "along_m": 50.0, "remaining_m": 5.0, "start_lateral_m": 0.0},
        **{"lane_width_m": 3.5, "edge_left_m": 1.75, "edge_right_m": 1.75},
        **{"next_lanes": ["Connector1", "Connector2"], "route": ["Lane1"]},
    }


def test_a_place_is_taken_by_the_box_that_interplan_will_use() -> None:
    rules = InterplanRules(boxes_m=((9.0, 2.5),))
    street = scene(agents=(vehicle("Agent2", 12.0, 0.0),))
    call = {"lane": "Lane1", "start": "Agent1", "distance_m": 18.5}
    asked = [replace(street, options=SceneOptions(interplan=one)) for one in (None, rules)]
    assert [PoseTool(one).answer(call)["taken_by"] for one in asked] == [None, ["Agent2"]]


def test_the_lane_is_the_one_under_the_place() -> None:
    for lateral_m, lane in (
        *((1.75, "Lane1"), (1.76, "Lane2"), (3.5, "Lane2"), (5.26, None)),
        *((-1.75, "Lane1"), (-1.76, None)),
    ):
        answer = STREET.answer(
            {"lane": "Lane1", "start": "lane", "distance_m": 60, "lateral_m": lateral_m}
        )
        assert answer["lane"] == lane
        assert answer["route"] == ["Lane1"]


def parking_street() -> PoseTool:
    """The street with a bay 2 m deep on the right, the walkway beyond it, and a car in it."""
    street = scene()
    road, walkway, other = street.areas
    bay = replace(road, id="Area4", kind=AreaKind.CARPARK, boundary_m=strip(-3.75, -1.75))
    beyond = replace(walkway, boundary_m=strip(-6.25, -3.75))
    parked = vehicle("Agent2", 20.0, -2.85)
    return PoseTool(replace(street, areas=(road, beyond, other, bay), agents=(parked,)))


def strip(low_m: float, high_m: float) -> tuple[tuple[float, float], ...]:
    return ((-50.0, low_m), (100.0, low_m), (100.0, high_m), (-50.0, high_m))


def test_the_edge_of_the_road_lies_before_its_bays_and_its_walkways() -> None:
    answer = parking_street().answer({"lane": "Lane1", "start": "Agent1", "distance_m": 40})
    assert [answer[f"{name}_left_m"] for name in ("edge", "walkway")] == [5.25, 5.25]
    assert "carpark_left_m" not in answer
    named = [answer[f"{name}_right_m"] for name in ("edge", "carpark", "walkway")]
    assert named == [1.75, 1.75, 3.75]


@pytest.mark.parametrize(
    ("distance_m", "lateral_m", "object_type", "taken_by", "free_m"),
    [
        (20.0, 0.0, "VEHICLE", None, None),
        (20.0, -2.85, "VEHICLE", ["Agent2"], 25.5),
        (18.0, -2.85, "VEHICLE", ["Agent2"], 14.5),
        (24.7, -2.85, "VEHICLE", ["Agent2"], 25.7),
        (24.9, -2.85, "VEHICLE", None, None),
        (23.0, -2.85, "PEDESTRIAN", None, None),
        (20.0, -1.5, "VEHICLE", ["Agent2"], 25.5),
        (20.0, -1.5, "TRAFFIC_CONE", None, None),
        (1.0, 0.0, "TRAFFIC_CONE", ["Agent1"], 3.5),
    ],
)
def test_a_place_that_is_taken_names_who_stands_there_and_the_nearest_free_one(
    distance_m: float, lateral_m: float, object_type: str, taken_by: object, free_m: float | None
) -> None:
    call = {"lane": "Lane1", "start": "Agent1", "distance_m": distance_m, "lateral_m": lateral_m}
    answer = parking_street().answer({**call, "object": object_type})
    assert answer["taken_by"] == taken_by
    assert answer.get("nearest_free_m") == free_m
    if free_m is not None:
        again = parking_street().answer({**call, "object": object_type, "distance_m": free_m})
        assert again["taken_by"] is None


@pytest.mark.slow
@pytest.mark.parametrize("goal", [None, TurnType.STRAIGHT, TurnType.LEFT, TurnType.RIGHT])
@pytest.mark.parametrize("name", ["market-crossing", "theatre-crossing", "orchard-circle"])
def test_the_tool_goes_where_the_checks_measure(name: str, goal: TurnType | None) -> None:
    """Over junctions and around roundabouts "our lane" is one and the same."""
    world = replace(whole_scene(name), options=SceneOptions(goal=goal))
    tool, route = PoseTool(world), EgoRoute.of(world)
    start = short_names(world).lanes[route.lane_id]
    for ahead_m in range(5, 75, 10):
        place = tool.pose_on_lane(start, "Agent1", ahead_m).pose
        gap_m = math.dist((place.x_m, place.y_m), route.position(ahead_m))
        assert gap_m < 0.02, ahead_m


def test_a_distance_runs_on_straight_over_connectors_and_back_again() -> None:
    ahead = JUNCTION.pose_on_lane("Lane1", "lane", 75.0)
    assert ahead.route == ["Lane1", "Connector1", "Lane2"]
    assert ahead.lane == "Lane2"
    assert ahead.along_m == pytest.approx(4.0)
    assert ahead.pose.x_m == pytest.approx(40.0)
    back = JUNCTION.pose_on_lane("Lane2", "lane", -36.0)
    assert back.lane == "Lane1"
    assert back.pose.x_m == pytest.approx(0.0)


def test_control_points_copied_from_the_prompt_are_their_lane() -> None:
    (control,) = control_points(JUNCTION.curves["Lane1"].lane)
    call = {"lane": control, "start": "lane", "distance_m": 75.0}
    assert JUNCTION.answer(call) == JUNCTION.answer({**call, "lane": "Lane1"})


def test_only_what_the_prompt_shows_is_known() -> None:
    near = PoseTool(scene(agents=(vehicle("Agent2", 60.0, 0.0),)), radius_m=30.0)
    assert near.pose_on_lane("Lane1", "lane", 0.0).pose.x_m == pytest.approx(-15.0)
    assert near.pose_on_lane("Lane1", "lane", 45.0).next_lanes == []
    with pytest.raises(ToolError, match="no agent 'Agent2'"):
        near.pose_on_lane("Lane1", "Agent2", 0.0)
    cut = PoseTool(junction(), radius_m=18.0)
    assert cut.curves["Lane1"].after == ()


def test_a_call_that_cannot_be_answered_says_why() -> None:
    for change, said in (
        ({"lane": "Lane9"}, "no lane 'Lane9'. Known: Lane1, Lane2, Lane3, Connector1"),
        ({"lane": [[0, 0], [1, 1]]}, "no lane '[[0, 0], [1, 1]]'"),
        ({"lane": [[0, 0], [1], [2, 2], [3, 3]]}, "lane must be an id, or the control points"),
        ({"lane": [[0, 0]] * 4}, "lane must be an id, or the control points"),
        ({"start": "Agent7"}, "no agent 'Agent7'. Known: Agent1. Or start at"),
        ({"start": 3}, "start: Input should be a valid string"),
        ({"lane": "Lane2", "start": "Agent1"}, "36.0 m before the beginning of it. To start from"),
        ({"distance_m": 300}, "(Lane1 -> Connector1 -> Lane2): from this start distance_m can be"),
        ({"distance_m": -300}, "begin 265.00 m short of that (Lane1): from this start distance_m"),
        ({"distance_m": "20"}, "distance_m[0]: Input should be a valid number, got '20'"),
        ({"distance_m": True}, "distance_m[0]: Input should be a valid number"),
        ({"distance_m": math.nan}, "distance_m[0]: Input should be a finite number"),
        ({"distance_m": 10**400}, "distance_m[0]: Input should be a valid number"),
        ({"distance_m": []}, "distance_m: Value should have at least 1 item"),
        ({"distance_m": [1.0] * 17}, "distance_m: Value should have at most 16 items"),
        ({"distance_m": [1, 2, 3], "lateral_m": [1, 2]}, "make the lists equally long"),
        ({"lateral_m": 31}, "lateral_m[0]: Input should be less than or equal to 30"),
        ({"offset": 1}, "offset: is not a field"),
        ({"object": "TREE"}, "object[0]: String should match pattern '^(VEHICLE|BUS|BICYCLE"),
        ({"object": "EGO_VEHICLE"}, "object[0]: String should match pattern"),
    ):
        call = {"lane": "Lane1", "start": "Agent1", "distance_m": 10.0, **change}
        answer = JUNCTION.answer(call)
        assert list(answer) == ["error"]
        assert said in str(answer["error"])


any_json = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=8,
)


def documents(kind: str, **parts: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    return st.fixed_dictionaries({"kind": st.just(kind), **parts})


STARTS = documents("place", x_m=st.floats(-9, 9), y_m=st.just(0), agent_id=st.text())
ALONG = documents("lanes", lane_ids=st.lists(st.sampled_from(["Lane1", "x"])))
OVER = documents("points", points_m=st.lists(st.tuples(st.floats(-1e6, 1e6), st.just(0))))
MOVES = {
    "path": any_json | ALONG | OVER,
    "speeds": any_json | st.lists(st.tuples(st.floats(0, 60), st.floats(0, 100)), max_size=3),
}


@examples(40)
@given(
    arguments=any_json
    | st.fixed_dictionaries(
        {
            "lane": any_json | st.sampled_from(["Lane1", "Connector2"]),
            "start": any_json | st.sampled_from(["lane", "Agent1"]),
            "distance_m": any_json | st.floats(-200, 200),
        },
        optional={
            "lateral_m": any_json | st.floats(-5, 5),
            "object": any_json | st.sampled_from(OBJECT_TYPES),
            "speed_mps": st.floats(0, 60),
            "after_s": any_json | st.floats(0, 15),
            "motion": st.fixed_dictionaries({}, optional={"start": any_json | STARTS, **MOVES}),
        },
    )
)
def test_whatever_is_called_the_answer_is_json(arguments: object) -> None:
    json.dumps(JUNCTION.answer(arguments), allow_nan=False)


def two_lanes() -> Scene:
    """Lane2 left of Lane1, the same way; Agent2 waits beside them."""
    both = lanes(0.0, 3.5, ends_m=(-50.0, 100.0))
    return scene(lanes=both, agents=(vehicle("Agent2", 40.0, -6.0),))


SETS_OUT = {"lane": "Lane2", "start": "Agent1", "distance_m": 30, "speed_mps": 4}


@pytest.mark.slow
def test_the_lanes_to_follow_are_those_beside_and_those_that_come_next() -> None:
    tool = PoseTool(two_lanes())
    assert tool.answer(SETS_OUT)["lanes_beside"] == ["Lane1"]
    assert "lanes_beside" not in STREET.answer(SETS_OUT)  # Lane2 comes the other way
    for name in ("market-crossing", "orchard-circle"):
        world = with_short_ids(whole_scene(name), short_names(whole_scene(name)))
        tool, graph = PoseTool(world), LaneGraph(world)
        for lane in tool.curves:
            place = tool.pose_on_lane(lane, "lane", 0.0)
            for after in (*place.next_lanes, *(place.lanes_beside or ())):
                check_lane_path(graph, LanePath(lane_ids=(lane, after)))


@pytest.mark.parametrize(
    ("motion", "started_s", "later"),
    [
        (None, None, [(4.0, 46.0, 3.5, 4.0), (15.0, 90.0, 3.5, 4.0)]),
        # The ego, at 8 m/s, is 15 m away after 3.9 s, as in tests/scene/test_planned_motion.py.
        (
            {
                "start": {"kind": "ego_distance", "within_m": 15},
                "path": {"kind": "lanes", "lane_ids": ["Lane2", "Lane1"]},
            },
            3.9,
            # 3.5 m across on 20 m are 0.43 m more of a way (the integral of the quintic).
            [(3.9, 45.6, 3.5, 4.0), (10.0, 69.57, 0.0, 4.0)],
        ),
        # From 4 m/s to a stand within 2 s: 4 m, then nothing.
        ({"speeds": [[2, 0]]}, 0.0, [(1.0, 33.0, 3.5, 2.0), (9.0, 34.0, 3.5, 0.0)]),
        ({"start": {"kind": "place", "agent_id": "Agent2", "x_m": 0, "y_m": 0}}, None, []),
        ({"start": {"kind": "place", "x_m": 16, "y_m": 0, "within_m": 0.1}}, 2.0, []),
    ],
)
def test_where_it_is_later_is_what_its_motion_says(
    motion: object, started_s: float | None, later: list[tuple[float, ...]]
) -> None:
    given = {} if motion is None else {"motion": motion}
    seconds = {"after_s": [row[0] for row in later]} if later else {}
    answer = PoseTool(two_lanes()).answer(SETS_OUT | given | seconds)
    assert answer.get("started_s") == started_s
    found = answer["later"]
    assert isinstance(found, list)
    assert [(at["after_s"], at["x_m"], at["y_m"], at["speed_mps"]) for at in found] == [
        pytest.approx(row, abs=0.06) for row in later
    ]
    for at in found:
        apart_m = math.dist((at["x_m"], at["y_m"]), (8.0 * at["after_s"], 0.0))
        assert at["ego_distance_m"] == pytest.approx(apart_m, abs=0.02) or at["after_s"] > 12.0
        assert at["lane"] == ("Lane1" if at["y_m"] < 1.0 else "Lane2")


@pytest.mark.parametrize(
    ("start", "lateral_m", "place_m", "taken_by"),
    [
        ("Agent2", None, (30.0, 2.6), None),
        ("Agent2", 0.0, (30.0, 3.5), ["Agent2"]),
        ("Agent1", None, (0.0, 0.0), None),
    ],
)
def test_who_is_there_starts_from_its_own_place_and_is_not_in_its_own_way(
    start: str, lateral_m: float | None, place_m: tuple[float, float], taken_by: list[str] | None
) -> None:
    parked = vehicle("Agent2", 30.0, 2.6, 0.0)
    tool = PoseTool(replace(two_lanes(), agents=(parked,)))
    lane = "Lane2" if start == "Agent2" else "Lane1"
    call = {"lane": lane, "start": start, "distance_m": 0, "speed_mps": 4, "after_s": 1}
    answer = tool.answer(call | ({} if lateral_m is None else {"lateral_m": lateral_m}))
    assert (answer["x_m"], answer["y_m"]) == place_m
    assert answer["taken_by"] == taken_by
    assert isinstance(answer["later"], list)
    (later,) = answer["later"]
    assert (later["x_m"], later["y_m"]) == (place_m[0] + 4.0, place_m[1])
    # Both run straight on, the ego at 8 m/s.
    assert later["ahead_m"] == place_m[0] + 4.0 - 8.0


def test_half_a_turn_is_pi_to_either_side() -> None:
    answer = STREET.answer({"lane": "Lane2", "start": "Agent2", "distance_m": 0})
    assert (answer["heading_rad"], answer["heading_deg"]) == (3.142, 180.0)
    turned = replace(two_lanes().lanes[0], centerline=Polyline([(60.0, 1e-9), (-60.0, 0.0)]))
    back = PoseTool(replace(two_lanes(), lanes=(replace(turned, id="Lane1"),)))
    assert back.answer({"lane": "Lane1", "start": "lane", "distance_m": 9})["heading_rad"] == 3.142


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"after_s": 15.1}, "after_s[0]: Input should be less than or equal to 15"),
        ({"after_s": [1] * 17}, "after_s: Value should have at most 16 items"),
        ({"speed_mps": -1}, "speed_mps: Input should be greater than or equal to 0"),
        ({"motion": {"speed": 1}}, "motion.speed: is not a field of this format"),
        ({"motion": {"path": {"kind": "lanes", "lane_ids": ["Lane7"]}}},
         "Agent3: Lane7 is no lane of the scene; its lanes: Lane1, Lane2"),
        ({"motion": {"start": {"kind": "place", "agent_id": "x", "x_m": 0, "y_m": 0}}},
         "Agent3: it waits for x"),
    ],
)  # fmt: skip
def test_what_can_not_be_carried_out_is_told(changes: dict[str, object], said: str) -> None:
    answer = PoseTool(two_lanes()).answer(SETS_OUT | changes)
    assert str(answer["error"]).startswith(said)


def test_past_the_end_of_the_map_nobody_is_anywhere() -> None:
    call = {"lane": "Lane1", "start": "Agent1", "distance_m": 0, "speed_mps": 60, "after_s": 3}
    assert PoseTool(two_lanes()).answer(call)["later"] == [
        {"after_s": 3.0, "error": "it has left the lanes of the map"}
    ]
