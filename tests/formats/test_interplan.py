import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest
import yaml

from augment.errors import Conflict
from augment.formats.interplan.file import TOKENS, parse_file, scene_token
from augment.formats.interplan.runs import MODIFICATIONS
from augment.formats.interplan.writer import write as write_files
from augment.formats.writing import Cell, Loss
from augment.scene.entities import (
    AgentType,
    Modification,
    ScenarioType,
    TrafficAgent,
    without_traffic,
)
from tests.fixtures.shelf import SLUGS, entry, shown_scene, whole_scene
from tests.formats import cells
from tests.formats.interplan_files import entries_of
from tests.formats.round_trips import agent_changes
from tests.scenes import cone, pedestrian, vehicle

UNTOLD = (AgentType.BARRIER, AgentType.CONSTRUCTION_SIGN)
"""interPlan's file has no keys for them."""


def write(cells: Sequence[Cell]) -> tuple[str, tuple[Loss, ...]]:
    written = write_files(cells)
    return written.files[MODIFICATIONS].decode(), written.losses


def cell(slug: str, *added: TrafficAgent, keeps_traffic: bool = False) -> Cell:
    """A scenario of the catalogue with its reference, or with these agents instead."""
    scene = shown_scene(slug)
    change = Modification(added=added or tellable(slug))
    rest: dict[str, Any] = {"modification": change, "keeps_traffic": keeps_traffic}
    shown = scene if keeps_traffic else without_traffic(scene)
    return Cell(name=slug, scene=shown, type=ScenarioType(entry(slug).type), **rest)


def tellable(slug: str) -> tuple[TrafficAgent, ...]:
    return tuple(one for one in entry(slug).reference.added if one.type not in UNTOLD)


def read_again(one: Cell) -> Modification:
    text, _ = write([one])
    scene = without_traffic(one.scene)
    ((found, _),) = entries_of(text, {scene_token(scene.name): scene})
    return found


def first(slug: str) -> TrafficAgent:
    return entry(slug).reference.added[0]


@pytest.mark.parametrize("slug", SLUGS)
def test_a_reference_comes_back_within_a_centimetre_and_a_milliradian(slug: str) -> None:
    found, wanted = read_again(cell(slug)).added, tellable(slug)
    assert [change for change in agent_changes(wanted, found) if change.aspect != "velocity"] == []
    for made, given in zip(found, wanted, strict=True):
        assert made.lane_id == given.lane_id
        assert made.speed_mps == pytest.approx(given.speed_mps, abs=0.02)


def test_plain_yaml_shows_interplans_keys() -> None:
    text, _ = write([cell("roadworks-mill-junction"), cell("jaywalker-terrace-row")])
    document = yaml.safe_load(text)
    by_token = document.pop("modification_details_dictionary")
    assert document == {"accel_max": 1.0, "decel_max": 2.0, "scenario_specifics": None}
    assert list(by_token) == [scene_token("mill-junction"), scene_token("terrace-row")]
    details = by_token[scene_token("mill-junction")]
    zone = details.pop("special_scenario")["0"]
    assert details == {
        "extra_agents_to_spawn": [],
        "roadblock_locations_to_spawn_agents": [],
        "goal": {"left": None, "right": None, "straight": None},
        "spawn_in_intersection": False,
    }
    assert list(zone) == ["type", "cones", "pedestrian"]
    assert zone["type"] == "approaching_construction_zone"
    assert [len(cone) for cone in zone["cones"]] == [2] * 4
    (worker,) = zone["pedestrian"]
    assert math.dist(worker[:2], worker[2:4]) == pytest.approx(1.0, abs=0.001)
    assert worker[4] is None
    assert f'"{scene_token("mill-junction")}":' in text, "some look like numbers"


def test_kept_traffic_that_interplan_removes_is_said_in_report_and_file() -> None:
    one = cell(SLUGS[0], keeps_traffic=True)
    text, losses = write([one])
    (said,) = (loss.text for loss in losses if loss.changes_scene)
    assert f"which this scenario keeps ({len(one.scene.agents)} agents), is gone" in said
    assert f"# lost: {said}\n" in text
    # Not by "config: a1" either: interPlan deletes all vehicles then too.
    assert "config" not in text.partition("accel_max")[2]


def test_several_of_one_scene_are_numbered_and_named_in_comments() -> None:
    same = cell("nudge-plane-tree-street")
    text, _ = write([same, replace(same, name="another")])
    token = scene_token("plane-tree-street")
    assert f"# {token}-s1 plane-tree-street: another" in text
    with pytest.raises(Conflict, match="at most 100"):
        write([same] * 101)


def test_a_name_with_control_characters_leaves_a_file_that_can_be_read() -> None:
    text, _ = write([replace(cell("nudge-plane-tree-street"), name="a\x1b[2J\nb: c")])
    assert "\x1b" not in text
    assert yaml.safe_load(text)["accel_max"] == 1.0


AB = "00000000000000ab"


def test_what_a_modification_can_not_say_is_named() -> None:
    scene = without_traffic(whole_scene("plane-tree-street"))
    x_m, y_m = scene.origin.pose.x_m, scene.origin.pose.y_m
    text = f"""
scenario_specifics: {{}}
colour: red
modification_details_dictionary:
  "{AB}":
    extra_agents_to_spawn: [[0, 0, 3], [0, 5, 3]]
    roadblock_locations_to_spawn_agents: [[0, 0]]
    goal: {{left: null, right: "1, 2", straight: null}}
    spawn_in_intersection: true
    weather: rain
    special_scenario:
      0:
        type: jaywalking_pedestrian
        config: dh
        roadblock_locations_to_spawn_agents: []
        pedestrian:
        - [{x_m}, {y_m}, {x_m + 8}, {y_m}, 12]
        - [{x_m}, {y_m}, {x_m}, {y_m}, null]
"""
    ((found, left_out),) = entries_of(text, {AB: scene})
    assert left_out == [
        "pedestrian 0 starts at iteration 12",
        "pedestrian 1 walks 0 m, which gives it no direction",
    ]
    assert found.added[0].speed_mps == pytest.approx(8.0 / 15.0, abs=0.01)


ODD = {
    "box": vehicle("Agent9", 30.0, 0.5, 0.1, length_m=5.2),
    "velocity": vehicle("Agent9", 30.0, 0.5, speed_mps=3.0),
    "class": vehicle("Agent9", 30.0, 0.5, length_m=9.0),
    "missing": cone("Agent9", 30.0, 0.5, type=AgentType.BARRIER),
    "heading": cone("Agent9", 30.0, 0.5, heading_rad=0.5),
    "walk": pedestrian("Agent9", 30.0, -4.0),
    "short walk": pedestrian("Agent9", 30.0, -4.0, (30.0, -3.0), speed_mps=1.0 / 15.0),
    "fast walk": pedestrian("Agent9", 30.0, -4.0, (30.0, 8.0), speed_mps=2.0),
    "askew walk": pedestrian("Agent9", 30.0, -4.0, (30.0, 8.0), heading_rad=1.5, speed_mps=0.8),
    "hurried worker": pedestrian("Agent9", 30.0, -4.0, speed_mps=1.0),
    "no length": pedestrian("Agent9", 30.0, -4.0, (30.0, -4.0)),
    "another scene": vehicle("Agent9", 1_001.0, 0.5),
}
STILL_THERE = ("box", "heading", "fast walk", "askew walk")
"""What changes no more than sizes, paces and where somebody looks."""


@pytest.mark.parametrize("kind", [ScenarioType.CONSTRUCTION_ZONE, ScenarioType.JAYWALKER])
@pytest.mark.parametrize("odd", list(ODD))
def test_what_interplan_changes_has_a_line_with_its_name(odd: str, kind: ScenarioType) -> None:
    given = cells.cell(added=(ODD[odd], cone("Agent10", 20.0, -1.0)), type=kind)
    text, losses = write([given])
    scene = without_traffic(given.scene)
    ((found, _),) = entries_of(text, {scene_token(scene.name): scene})
    wanted, got = given.modification.added, found.added
    assert len(got) == (1 if odd in ("missing", "another scene") else 2)
    changed = {change.name for change in agent_changes(wanted, got)}
    if odd != "walk" or kind is ScenarioType.JAYWALKER:
        assert changed == {"Agent9"}
    else:
        assert changed == set()  # a worker who stands is what interPlan's step says
    told = [
        loss.text
        for loss in losses
        if "turned at random" not in loss.text and (odd == "box" or "not kept" not in loss.text)
    ]
    assert changed == {text.split()[0] for text in told}
    assert any(loss.changes_scene for loss in losses) == bool(changed and odd not in STILL_THERE)


def test_a_fault_costs_its_special_scenario_or_its_base_token_and_no_more() -> None:
    sound = {"type": "nudge_around_parked_vehicle", "cones": [[1.0, 2.0]]}
    short = sound | {"cones": [[1.0]]}
    document = {
        TOKENS: {
            "0123456789abcdef": {"special_scenario": {"0": sound, "1": short}},
            "fedcba9876543210": {"goal": {"l": "here"}, "special_scenario": {"0": sound}},
            "no token": {"special_scenario": {"0": sound}},
        }
    }
    file, problems = parse_file(document)
    (details,) = file.modification_details_dictionary.values()
    assert [*details.special_scenario] == ["0"]
    places = [place.removeprefix(f"{TOKENS}.") for place, _ in problems]
    named = ["0123456789abcdef", "fedcba9876543210", "no token"]
    assert [place.partition(".")[0] for place in places] == named
    assert places[0].startswith("0123456789abcdef.special_scenario.1.cones[0]")
