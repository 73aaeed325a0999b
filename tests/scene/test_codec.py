import json
import math
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.errors import InvalidDocument
from augment.geometry.polyline import Polyline
from augment.scene import codec, entities
from augment.scene.recording import Recording
from tests.properties import examples
from tests.scenes import cone, junction, pedestrian, scene, vehicle
from tests.simulation.worlds import track

METRES = st.floats(-1000.0, 1000.0)
POINTS = st.tuples(METRES, METRES)
SIZES = st.floats(0.1, 50.0)
LINES = st.lists(st.integers(-9_000, 9_000), min_size=2, max_size=5, unique=True).map(
    lambda numbers: Polyline([(number / 7.0, number**2 / 3e5) for number in numbers])
)
AGENTS = st.builds(
    entities.TrafficAgent,
    id=st.just("Agent2"),
    type=st.sampled_from(
        [kind for kind in entities.AgentType if kind is not entities.AgentType.EGO_VEHICLE]
    ),
    x_m=METRES,
    y_m=METRES,
    heading_rad=st.floats(-math.pi, math.pi),
    width_m=SIZES,
    length_m=SIZES,
    speed_mps=st.floats(0.0, 50.0),
    lane_id=st.sampled_from([None, "Lane1"]),
    walk_to_m=st.none() | POINTS,
)
OPTIONS = st.builds(
    entities.SceneOptions,
    density=st.sampled_from(entities.TrafficDensity),
    goal=st.sampled_from([None, entities.TurnType.LEFT, entities.TurnType.STRAIGHT]),
    goal_m=st.none() | POINTS,
)


@examples(40)
@given(AGENTS, LINES, st.none() | LINES, SIZES, st.none() | SIZES, OPTIONS)
def test_a_scene_survives_the_way_through_json_exactly(
    agent: entities.TrafficAgent,
    line: Polyline,
    boundary: Polyline | None,
    width_m: float,
    limit_mps: float | None,
    options: entities.SceneOptions,
) -> None:
    drawn: dict[str, Any] = {"centerline": line, "left_boundary": boundary, "width_m": width_m}
    first, *lanes = junction().lanes
    given_scene = replace(
        junction(),
        agents=(agent,),
        lanes=(replace(first, **drawn, speed_limit_mps=limit_mps, successors=("Lane2",)), *lanes),
        connectors=tuple(replace(way, **drawn) for way in junction().connectors),
        areas=scene().areas,
        options=options,
    )
    text = json.dumps(codec.scene_to_document(given_scene), allow_nan=False)
    assert codec.scene_from_document(json.loads(text)) == given_scene


@examples(40)
@given(AGENTS, AGENTS)
def test_a_modification_survives_the_way_through_json_exactly(
    first: entities.TrafficAgent, second: entities.TrafficAgent
) -> None:
    moved = replace(second, id="Agent3")
    change = entities.Modification(added=(first,), moved=(moved,), removed=("Agent4",))
    text = json.dumps(codec.modification_to_document(change), allow_nan=False)
    assert codec.modification_from_document(json.loads(text)) == change


def document() -> dict[str, Any]:
    busy = scene(agents=(vehicle("Agent2", 20.0, 0.0), cone("Agent3", 5.0, 1.0)))
    made = codec.scene_to_document(busy)
    made["connectors"] = codec.scene_to_document(junction())["connectors"][:1]
    return deepcopy(made)


def put(made: dict[str, Any], place: list[Any], value: object) -> dict[str, Any]:
    inner: Any = made
    for step in place[:-1]:
        inner = inner[step]
    inner[place[-1]] = value
    return made


BROKEN = [
    (["version"], 2, "version: version 2 is not known; this program reads version 1"),
    (["version"], True, "version: version True"),
    (["format"], "geojson", "format: expected 'scenario-arena/scene', got 'geojson'"),
    (["lanes", 1, "centerline_m", 0, 1], "3.5", "lanes[1].centerline_m[0][1]: "),
    (["lanes", 1, "centerline_m", 0, 1], math.nan, "lanes[1].centerline_m[0][1]: "),
    (["lanes", 1, "centerline_m", 0, 1], 10**400, "lanes[1].centerline_m[0][1]: "),
    (["lanes", 1, "centerline_m", 0], [1.0, 2.0, 3.0], "lanes[1].centerline_m[0]: "),
    (["lanes", 1, "centerline_m"], [[0, 0], [0, 0]], "lanes[1].centerline_m: a line needs"),
    (["lanes", 1, "id"], "Lane1", "lanes[1].id: 'Lane1' is taken already by lanes[0].id"),
    (["lanes", 1, "left_neighbor"], "Lane9", "lanes[1].left_neighbor: 'Lane9' is not a lane"),
    (["lanes", 1, "successors"], ["Lane9"], "lanes[1].successors[0]: 'Lane9' is not a lane"),
    (["lanes", 1, "width_m"], 0, "lanes[1].width_m: "),
    (["lanes", 1, "colour"], "red", "lanes[1].colour: is not a field of this format"),
    (["connectors", 0, "to_lane"], "Lane9", "connectors[0].to_lane: 'Lane9' is not a lane"),
    (["connectors", 0, "traffic_light"], "blue", "connectors[0].traffic_light: "),
    (["areas", 0, "boundary_m"], [[0, 0], [1, 0]], "areas[0].boundary_m: "),
    (["areas", 0, "boundary_m"], [[0, 0], [1, 0], [0, 0]], "areas[0].boundary_m: an area needs"),
    (["agents", 1, "type"], "UNICORN", "agents[1].type: "),
    (["agents", 1, "type"], "EGO_VEHICLE", "agents[1].type: there is one ego"),
    (["agents", 1, "lane_id"], "Lane9", "agents[1].lane_id: 'Lane9' is not a lane"),
    (["agents", 1, "length_m"], math.inf, "agents[1].length_m: "),
    (["agents", 1, "speed_mps"], True, "agents[1].speed_mps: "),
    (["ego", "x_m"], 0.5, "ego.x_m: the ego is the origin"),
    (["ego", "type"], "VEHICLE", "ego.type: the ego is EGO_VEHICLE"),
    (["agents"], None, "agents: "),
    (["options"], {"goal": "u_turn"}, "options.goal: left, right or straight"),
    (["options"], {"density": "dense"}, "options.density: "),
]


@pytest.mark.parametrize(("place", "value", "sentence"), BROKEN)
def test_a_fault_is_named_with_its_place(place: list[Any], value: object, sentence: str) -> None:
    with pytest.raises(InvalidDocument) as caught:
        codec.scene_from_document(put(document(), place, value))
    assert sentence in str(caught.value)


def test_a_missing_field_is_named() -> None:
    made = document()
    del made["lanes"][0]["width_m"]
    with pytest.raises(InvalidDocument) as caught:
        codec.scene_from_document(made)
    assert caught.value.problems == [("lanes[0].width_m", "is missing")]


@pytest.mark.parametrize("thing", [None, 3, "scene", [], [{}]])
def test_what_is_no_object_is_no_scene(thing: object) -> None:
    with pytest.raises(InvalidDocument, match="expected an object"):
        codec.scene_from_document(thing)


def test_all_faults_are_named_at_once() -> None:
    made = put(put(document(), ["ego", "width_m"], -1), ["agents", 0, "x_m"], None)
    with pytest.raises(InvalidDocument) as caught:
        codec.scene_from_document(made)
    assert [place for place, _ in caught.value.problems] == ["ego.width_m", "agents[0].x_m"]


def test_a_list_tells_its_first_fault() -> None:
    made = put(document(), ["lanes", 0, "centerline_m"], [["x", "y"]] * 1000)
    with pytest.raises(InvalidDocument) as caught:
        codec.scene_from_document(made)
    places = [f"lanes[0].centerline_m[0][{n}]" for n in range(2)]
    assert [place for place, _ in caught.value.problems] == places


@pytest.mark.parametrize(("number", "is_read"), [(5_000, True), (5_001, False)])
def test_a_modification_has_at_most_5000_agents(number: int, is_read: bool) -> None:
    one = codec.modification_to_document(entities.Modification(added=(cone("Agent2", 1.0, 0.0),)))
    made = one | {"add": [one["add"][0] | {"id": f"Agent{n}"} for n in range(number)]}
    if is_read:
        assert len(codec.modification_from_document(made).added) == number
    else:
        with pytest.raises(InvalidDocument, match="add: List should have at most 5000 items"):
            codec.modification_from_document(made)


def test_what_could_not_be_read_is_not_written() -> None:
    with pytest.raises(InvalidDocument, match=r"agents\[0\]\.x_m"):
        codec.scene_to_document(scene(agents=(vehicle("Agent2", math.nan, 0.0),)))


def test_a_modification_names_each_agent_once() -> None:
    change = entities.Modification(added=(cone("Agent2", 1.0, 0.0),), removed=("Agent2",))
    with pytest.raises(InvalidDocument, match=r"remove\[0\]: 'Agent2' is taken already by add"):
        codec.modification_to_document(change)


def test_nobody_adds_a_second_ego() -> None:
    given = entities.Modification(added=(cone("Agent2", 1.0, 0.0),))
    change = codec.modification_to_document(given)
    change["add"][0]["type"] = "EGO_VEHICLE"
    with pytest.raises(InvalidDocument, match=r"add\[0\]\.type"):
        codec.modification_from_document(change)


def test_documents_say_their_units() -> None:
    change = entities.Modification(added=(pedestrian("Agent2", 12.0, -4.0, (12.0, 4.0)),))
    (written,) = codec.modification_to_document(change)["add"]
    assert written == {
        **{"id": "Agent2", "type": "PEDESTRIAN", "x_m": 12.0, "y_m": -4.0, "speed_mps": 0.0},
        **{"heading_rad": math.pi / 2, "width_m": 0.791, "length_m": 0.9},
        "walk_to_m": [12.0, 4.0],
    }


def recording() -> Recording:
    """Three steps; Agent2 is not seen at the second."""
    states = np.array([[9.0, 1.0, 3.1, 2.0], [np.nan] * 4, [8.6, 1.0, 3.1, 2.0]])
    return Recording(
        times_s=np.array([0.0, 0.1, 0.2]),
        ego=np.array([[0.0, 0.0, 0.0, 1.0], [0.1, 0.0, 0.0, 1.0], [0.2, 0.01, 0.1, 1.0]]),
        tracks=(track(vehicle("Agent2", 9.0, 1.0), states),),
    )


def test_a_recording_survives_the_way_through_json_exactly() -> None:
    given = recording()
    text = json.dumps(codec.recording_to_document(given), allow_nan=False)
    back = codec.recording_from_document(json.loads(text))
    assert np.array_equal(back.times_s, given.times_s)
    assert np.array_equal(back.ego, given.ego)
    assert np.array_equal(back.tracks[0].states, given.tracks[0].states, equal_nan=True)
    assert back.tracks[0].agent_id == "Agent2"
    assert json.loads(text)["tracks"][0]["states"][1] is None


def test_a_broken_recording_names_the_place() -> None:
    for fields, place in (
        ({"times_s": [0.1, 0.2, 0.3]}, "times_s[0]"),
        ({"times_s": [0.0, 0.2, 0.2]}, "times_s[2]"),
        ({"times_s": [0.0, 0.1]}, "ego"),
        ({"ego": [[0.0, 0.0, 0.0, 1.0]]}, "ego"),
        ({"columns": ["x_m", "y_m", "speed_mps", "heading_rad"]}, "columns[2]"),
        ({"version": 3}, "version"),
    ):
        with pytest.raises(InvalidDocument) as caught:
            codec.recording_from_document(codec.recording_to_document(recording()) | fields)
        assert place in [where for where, _ in caught.value.problems]


def test_half_a_state_is_no_state() -> None:
    given = recording()
    given.tracks[0].states[0, 1] = np.nan
    with pytest.raises(InvalidDocument, match=r"tracks\[0\]\.states\[0\]\[1\]"):
        codec.recording_to_document(given)
