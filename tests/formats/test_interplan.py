from __future__ import annotations

import math
from dataclasses import replace

import pytest
import yaml

from augment.errors import Conflict, InvalidDocument
from augment.formats.interplan import Cell, ReadEntry, token_of
from augment.formats.interplan_reader import read
from augment.formats.interplan_writer import write
from augment.geometry.angles import difference
from augment.scene.catalogue import ScenarioType
from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.modification import Modification, without_traffic
from tests.fixtures.shelf import SLUGS, entry, shown_scene, whole_scene


def cell(slug: str, *added: TrafficAgent) -> Cell:
    """A scenario of the catalogue with its reference, or with these agents instead."""
    given = entry(slug)
    return Cell(
        name=slug,
        scene=shown_scene(slug),
        type=given.type,
        modification=Modification(added=added) if added else given.reference,
        keeps_traffic=given.keep_traffic,
    )


def read_again(one: Cell) -> ReadEntry:
    text, _ = write([one])
    scene = without_traffic(one.scene)
    (found,) = read(text, {token_of(scene.name): scene})
    return found


def first(slug: str) -> TrafficAgent:
    return entry(slug).reference.added[0]


@pytest.mark.parametrize("slug", SLUGS)
def test_a_reference_comes_back_within_a_centimetre_and_a_milliradian(slug: str) -> None:
    wanted, found = entry(slug), read_again(cell(slug))
    assert found.type is wanted.type
    for made, given in zip(found.modification.added, wanted.reference.added, strict=True):
        assert made.type is given.type
        assert (made.x_m, made.y_m) == pytest.approx((given.x_m, given.y_m), abs=0.01)
        assert abs(difference(made.heading_rad, given.heading_rad)) < 0.001
        assert made.lane_id == given.lane_id
        assert (made.length_m, made.width_m) == (given.length_m, given.width_m)
        assert made.speed_mps == pytest.approx(given.speed_mps, abs=0.02)
        assert (made.walk_to_m is None) == (given.walk_to_m is None)
        if made.walk_to_m is not None and given.walk_to_m is not None:
            assert made.walk_to_m == pytest.approx(given.walk_to_m, abs=0.01)


def test_plain_yaml_shows_interplans_keys() -> None:
    slug = "roadworks-mill-junction"
    text, losses = write([cell(slug), cell("jaywalker-terrace-row")])
    document = yaml.safe_load(text)
    assert list(document) == [
        "accel_max", "decel_max", "scenario_specifics", "modification_details_dictionary",
    ]  # fmt: skip
    by_token = document["modification_details_dictionary"]
    assert list(by_token) == [token_of("mill-junction"), token_of("terrace-row")]
    details = by_token[token_of("mill-junction")]
    assert list(details) == [
        "extra_agents_to_spawn", "roadblock_locations_to_spawn_agents", "goal",
        "spawn_in_intersection", "special_scenario",
    ]  # fmt: skip
    assert details["goal"] == {"left": None, "right": None, "straight": None}
    zone = details["special_scenario"]["0"]
    assert list(zone) == ["type", "cones", "pedestrian"]
    assert zone["type"] == "approaching_construction_zone"
    assert [len(cone) for cone in zone["cones"]] == [2] * 8
    (worker,) = zone["pedestrian"]
    assert math.dist(worker[:2], worker[2:4]) == pytest.approx(1.0, abs=0.001)
    assert worker[4] is None
    kept = by_token[token_of("terrace-row")]["special_scenario"]["0"]
    assert kept["config"] == "a1"
    assert [str(loss) for loss in losses] == [
        "jaywalker-terrace-row: recorded pedestrians, bicycles and objects go, only vehicles stay"
    ]


def test_places_are_in_the_frame_of_the_scenes_origin() -> None:
    slug = "overtake-mill-junction"
    text, _ = write([cell(slug)])
    details = yaml.safe_load(text)["modification_details_dictionary"][token_of("mill-junction")]
    ((x_m, y_m, yaw_rad),) = details["special_scenario"]["0"]["stopped_vehicle"]
    origin = whole_scene("mill-junction").origin.pose
    assert math.dist((x_m, y_m), (origin.x_m, origin.y_m)) == pytest.approx(24.0, abs=0.01)
    assert difference(yaw_rad, origin.heading_rad) == pytest.approx(0.0, abs=0.001)


def test_tokens_are_quoted_because_some_look_like_numbers() -> None:
    text, _ = write([cell(SLUGS[0])])
    assert f'"{token_of(entry(SLUGS[0]).scene)}":' in text


def test_several_of_one_scene_are_numbered_and_named_in_comments() -> None:
    same = cell("nudge-plane-tree-street")
    text, _ = write([same, replace(same, name="another")])
    token = token_of("plane-tree-street")
    assert f"# {token}-s1 plane-tree-street: another" in text
    with pytest.raises(Conflict, match="at most 100"):
        write([same] * 101)


def test_what_the_format_can_not_say_is_reported() -> None:
    car = first("nudge-plane-tree-street")
    walker = replace(first("jaywalker-plane-tree-street"), walk_to_m=None)
    text, losses = write(
        [
            cell(
                "jaywalker-plane-tree-street",
                replace(car, id="Agent2", speed_mps=3.0),
                replace(car, id="Agent3", length_m=9.0),
                replace(car, id="Agent4", type=AgentType.BARRIER),
                replace(walker, id="Agent5"),
            )
        ]
    )
    said = [loss.text for loss in losses]
    assert said[:3] == [
        "Agent2 moves at 3 m/s; there it stands",
        "Agent3 is 9 m long and becomes a bus",
        "Agent4 is left out: there is no key for BARRIER",
    ]
    assert said[3].startswith("Agent5 has no end point")
    details = yaml.safe_load(text)["modification_details_dictionary"]
    special = details[token_of("plane-tree-street")]["special_scenario"]["0"]
    ((x0, y0, x1, y1, _),) = special["pedestrian"]
    # Over the road of 10.2 m, from 0.8 m before its edge.
    assert math.dist((x0, y0), (x1, y1)) == pytest.approx(11.5, abs=0.6)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: [", "is no YAML"),
        ("a: 1", "modification_details_dictionary"),
        (
            "modification_details_dictionary: {'ab': {special_scenario: {'0': {type: parade}}}}",
            "type",
        ),
        (
            "modification_details_dictionary: "
            "{'ab': {special_scenario: {'0': {type: jaywalking_pedestrian, cones: [[1]]}}}}",
            "cones.0",
        ),
    ],
)
def test_a_file_that_breaks_the_format_says_where(text: str, said: str) -> None:
    with pytest.raises(InvalidDocument, match=said):
        read(text, {})


def test_what_a_modification_can_not_say_is_named() -> None:
    scene = without_traffic(whole_scene("plane-tree-street"))
    text = (
        "modification_details_dictionary: {'ab': {special_scenario: {0: {"
        "type: jaywalking_pedestrian, config: dh, roadblock_locations_to_spawn_agents: [], "
        "pedestrian: [[0, 0, 8, 0, 12]]}}}, 'cd': {}}"
    )
    (found,) = read(text, {"ab": scene})
    assert found.id == "ab-s0"
    assert found.type is ScenarioType.JAYWALKER
    assert found.left_out == (
        "config dh",
        "pedestrian 0 starts at iteration 12",
        "key roadblock_locations_to_spawn_agents",
    )
    assert found.modification.added[0].speed_mps == pytest.approx(8.0 / 15.0, abs=0.01)
