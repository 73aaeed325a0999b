"""Scenes go out and come back the same, to 1 cm and 0.001 rad, or a line says what is not."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from augment.formats import own_json, writers
from augment.formats.readers import READERS
from augment.formats.reading import Reading
from augment.formats.roads import RADIUS_M
from augment.formats.writing import Cell
from augment.geometry.polyline import Polyline
from augment.scene.codec import modification_from_document, recording_from_document
from augment.scene.entities import (
    AgentType,
    AnyLane,
    Lane,
    Modification,
    ScenarioType,
    Scene,
    SceneOptions,
    TrafficAgent,
    TrafficDensity,
    TrafficLight,
    TrafficSide,
    TurnType,
)
from augment.scene.planned_motion import PlannedMotion
from tests.fixtures.shelf import entry, whole_scene
from tests.formats.cells import OF_EACH_TYPE, cell, crossing, moving, recorded_street, ruled
from tests.formats.round_trips import Change, changes
from tests.scenes import connector, lane, vehicle

WRITERS = {name: writers.WRITERS[name] for name in ("commonroad", "scenarionet")}

SAID: dict[str, dict[str, str]] = {
    "commonroad": {
        "side": "on which side people drive",
        "ego motion": "of the ego's motion only start and end are written",
        "box": "its box of",
        "class": "NAME: a (cone|sign) becomes a constructionZone",
        "missing": "NAME: a barrier becomes a roadBoundary",
        "later": "NAME: is left out: it appears after t0",
        "walk": "NAME: the walk or motion is written as it goes",
        "area": "NAME: left out: a .* area is no lanelet",
        "turn": "NAME: (a U-turn becomes a turn to the left|its turn type is not said)",
        "way": "of lanes the edges alone go out",
        "width": "of lanes the edges alone go out",
    },
    "scenarionet": {
        "class": "NAME: a (BUS|CONSTRUCTION_SIGN) becomes a (VEHICLE|TRAFFIC_OBJECT)",
        "walk": "NAME: the walk or motion is written as it goes",
        "area": "NAME: left out: there is no type for a",
        "turn": "NAME: the turn type is not said",
        "light": "NAME: that it has no light is not said",
        "edge": "the edges of lanes are written as outlines",
        "width": "note: .* lanes have no boundaries",
    },
}
"""What of a change the writer or the reader has to say; NAME stands for what is changed."""


def authored(slug: str) -> Cell:
    """A scenario of the catalogue with all of its scene's traffic."""
    given = entry(slug)
    scene = whole_scene(given.scene)
    first = len(scene.everyone) + 1
    added = [
        replace(agent, id=f"Agent{number}")
        for number, agent in enumerate(given.reference.added, start=first)
    ]
    change = Modification(added=tuple(added))
    rest: dict[str, Any] = {"type": ScenarioType(given.type), "modification": change}
    return Cell(name=slug, stem=slug, scene=scene, keeps_traffic=True, **rest)


def knot() -> Scene:
    """What no scene of the catalogue has: odd turns, lights, widths, ends, neighbours."""
    base = crossing()
    ahead, turning = base.connectors
    left = TurnType.LEFT
    lanes = (
        replace(base.lanes[0], right_neighbor="Lane4", speed_limit_mps=8.33),
        replace(base.lanes[1], successors=("Lane5",), speed_limit_mps=27.7777),
        replace(base.lanes[2], width_m=1.6),
        replace(base.lanes[0], id="Lane4", left_neighbor="Lane1", centerline=moved(0.0, -3.5)),
        Lane(
            id="Lane5",
            centerline=Polyline([(100.0, 0.0), (120.0, 1.0)]),
            width_m=4.25,
            left_boundary=Polyline([(100.0, 2.0), (110.0, 3.0), (120.0, 3.0)]),
            right_boundary=Polyline([(100.0, -2.0), (120.0, -1.0)]),
        ),
        lane("Lane6", [(60.0, -10.0), (80.0, -40.0)]),
    )
    line = [(20.0, -3.5), (20.03, -3.49), (60.0, -10.0)]
    connectors = (
        replace(ahead, turn_type=TurnType.RIGHT, traffic_light=TrafficLight.YELLOW),
        replace(turning, turn_type=TurnType.U_TURN, traffic_light=TrafficLight.UNKNOWN),
        connector("Connector3", "Lane4", "Lane6", line, width_m=3.0, speed_limit_mps=5.0),
        connector(
            "Connector4", None, "Lane3", [(8.0, 8.0), (28.0, 8.0)], width_m=3.0, turn_type=left
        ),
    )
    return replace(base, lanes=lanes, connectors=connectors)


def moved(x_m: float, y_m: float) -> Polyline:
    return Polyline(crossing().lanes[0].centerline.points_m + np.array([x_m, y_m]))


def near() -> tuple[TrafficAgent, ...]:
    """One of each type, of a box and a heading of its own, within reach."""
    return tuple(
        replace(
            agent,
            x_m=-60.0 + 15.0 * number,
            y_m=6.123,
            heading_rad=0.3456 * number - 1.0,
            length_m=agent.length_m + 0.1 * number,
        )
        for number, agent in enumerate(OF_EACH_TYPE)
    )


UNTOLD = (AgentType.BARRIER, AgentType.CONSTRUCTION_SIGN)
STREET, RECORDING = recorded_street()
CAST = {
    **{
        slug: authored(slug)
        for slug in (
            "crash-station-cross",
            "roadworks-market-crossing",
            "jaywalker-chapel-corner",
            "roadworks-reservoir-road",
            "overtake-willow-crescent",
        )
    },
    "street": cell(stem="street"),
    "crossing": cell(crossing(), added=near(), stem="crossing"),
    "knot": cell(knot(), stem="knot", added=(vehicle("Agent9", 400.0, 0.0),)),
    "moving": moving(),
    "recorded": cell(STREET, recording=RECORDING, keeps_traffic=True, added=(), stem="recorded"),
}


def there_and_back(name: str, given: Cell, folder: Path) -> tuple[Reading, list[str]]:
    """The scene as it comes back, and every line about it."""
    made = WRITERS[name]([given])
    assert made.refused == ()
    (file,) = (key for key in made.files if given.stem in key)
    path = folder / file
    path.write_bytes(made.files[file])
    reading = READERS[name].read(path, item=None, frame=None, name="back")
    lines = [loss.text for loss in made.losses]
    return reading, [*lines, *(f"note: {note}" for note in reading.notes)]


def is_said(change: Change, name: str, lines: list[str]) -> bool:
    words = SAID[name].get(change.aspect)
    if words is None:
        return False
    if "NAME:" in words:
        names = words.replace("NAME:", rf"(?:.*, )?{change.name}(?:, .*)?:", 1)
        return any(re.match(names, line) for line in lines)
    pattern = words.replace("NAME", rf"\b{change.name}\b")
    return any(re.search(pattern, line) for line in lines)


def far_ids(scene: Scene) -> set[str]:
    """What the readers leave out of every format, as it lies too far away."""
    ways: list[AnyLane] = [*scene.lanes, *scene.connectors]
    far = {one.id for one in ways if one.centerline.project(0.0, 0.0).distance_m > RADIUS_M}
    return far | {one.id for one in scene.agents if np.hypot(one.x_m, one.y_m) > RADIUS_M}


@pytest.mark.parametrize("name", list(WRITERS))
@pytest.mark.parametrize("key", list(CAST))
def test_what_comes_back_otherwise_has_a_line(name: str, key: str, tmp_path: Path) -> None:
    given = CAST[key]
    reading, lines = there_and_back(name, given, tmp_path)
    far = far_ids(given.after)
    left = [note for note in reading.notes if "m from the ego were left out" in note]
    assert [note.split()[0] for note in left] == ([str(len(far))] if far else [])
    unsaid = [
        change
        for change in changes(given, reading)
        if change.name not in far
        and not (change.aspect in ("successors", "to") and far)
        and not is_said(change, name, lines)
    ]
    assert unsaid == []


@pytest.mark.parametrize("name", list(WRITERS))
def test_what_both_formats_can_say_comes_back(name: str, tmp_path: Path) -> None:
    """Ways, limits, lights, turns, neighbours of a whole junction: nothing but areas changes."""
    whole = CAST["roadworks-market-crossing"]
    told = [one for one in whole.modification.added if one.type not in UNTOLD]
    given = replace(whole, modification=Modification(added=tuple(told)))
    reading, _ = there_and_back(name, given, tmp_path)
    found = {change.aspect for change in changes(given, reading)}
    assert (
        found
        == {"commonroad": {"area", "class", "ego motion"}, "scenarionet": {"area", "edge"}}[name]
    )


def test_our_own_left_hand_traffic_comes_back_from_scenarionet(tmp_path: Path) -> None:
    reading, _ = there_and_back("scenarionet", CAST["crossing"], tmp_path)
    assert reading.scene.traffic_side is TrafficSide.LEFT
    assert "made for a test" in reading.scene.provenance


def test_what_of_a_motion_is_lost_is_named() -> None:
    said = {
        "commonroad": {
            "Agent2, Agent3: sets out at a fixed time, not when its trigger fires",
            "Agent5: has a motion but never sets out: its trigger does not fire",
            "Agent4: moves, so it becomes one of unknown type",
            "Agent4: moves without turning; its speed is written as if along its heading",
        },
        "openscenario": {
            "Agent5: has a motion but never sets out: its trigger does not fire",
            "Agent4: moves, and players may leave obstacles standing",
        },
        "interplan": {
            f"Agent{number} has a motion of its own, which interPlan and nuPlan don't know"
            for number in (2, 3, 5, 6)
        }
        | {"Agent4 is left out: there is no key for a GENERIC_OBJECT there"},
    }
    for name, lines in said.items():
        losses = writers.WRITERS[name]([moving()]).losses
        assert lines <= {loss.text for loss in losses}, name
        changed = {one.text for one in losses if one.changes_scene}
        assert all(("motion" in line or "left out" in line) == (line in changed) for line in lines)


@pytest.mark.parametrize("name", list(WRITERS))
def test_whom_interplans_rules_move_goes_out_so_or_is_named(name: str, tmp_path: Path) -> None:
    given = ruled()
    reading, lines = there_and_back(name, given, tmp_path)
    x_m = given.expected.tracks[0].states[50, 0]
    assert x_m > 30.0 + 5.0 * 5.0 + 5.0, "it speeds up to the limit"
    cars = [one for one in reading.recording.tracks if one.type is AgentType.VEHICLE]
    assert [car.states[50, 0] for car in cars] == pytest.approx([x_m], abs=0.01)
    assert {
        "Agent3: is left out: by interPlan's rules it is never there",
        "Agent2, Agent4, Agent5: goes as interPlan's rules move it beside this ego, for whom "
        "nobody brakes",
    } <= set(lines)


def test_whom_interplans_rules_move_nobody_recorded() -> None:
    files = writers.WRITERS["json"]([replace(ruled(), recording=RECORDING.ego_alone)]).files
    (written,) = (text for name, text in files.items() if name.endswith(".recording.json"))
    assert recording_from_document(json.loads(written)).tracks == ()


def test_a_recorded_agent_that_is_given_a_motion_is_lost_in_interplan_by_name() -> None:
    (ahead,) = STREET.agents
    brakes = replace(ahead, motion=PlannedMotion(speeds=((1.0, 0.0),)))
    given = cell(STREET, recording=RECORDING, modification=Modification(moved=(brakes,)))
    (loss,) = writers.WRITERS["interplan"]([given]).losses
    assert (loss.text, loss.changes_scene) == (
        "Agent2 is given a motion; interPlan can only add",
        True,
    )


def test_our_own_json_keeps_density_goal_and_motions(tmp_path: Path) -> None:
    options = SceneOptions(density=TrafficDensity.LOW, goal=TurnType.LEFT, goal_m=(20.0, 5.5))
    moves = moving()
    given = replace(moves, scene=replace(moves.scene, options=options))
    for name, text in own_json.write([given]).files.items():
        (tmp_path / name).write_bytes(text)
    for name in ("before", "scene"):
        path = tmp_path / f"{given.stem}.{name}.json"
        read = READERS["json"].read(path, item=None, frame=0, name=given.scene.name)
        assert read.scene == (given.scene if name == "before" else given.after)
    change = json.loads((tmp_path / f"{given.stem}.modification.json").read_text())
    assert modification_from_document(change) == given.modification
