import math
from pathlib import Path

import numpy as np
import pytest

from augment.errors import InvalidDocument
from augment.formats.commonroad.scenario import ASSUMED, CommonRoad
from augment.formats.reading import Reading
from augment.formats.road_map import NO_INTERSECTIONS
from augment.scene.codec import scene_to_document
from augment.scene.entities import AgentType, AreaKind, TrafficLight, TurnType


def bound(name: str, *pairs: tuple[float, float]) -> str:
    points = "".join(f"<point><x>{x}</x><y>{y}</y></point>" for x, y in pairs)
    return f"<{name}>{points}</{name}>"


def lanelet(number: int, start: tuple[float, float], end: tuple[float, float], more: str) -> str:
    """3 m wide, from start to end."""
    along = math.atan2(end[1] - start[1], end[0] - start[0])
    dx, dy = -1.5 * math.sin(along), 1.5 * math.cos(along)
    left = bound("leftBound", *((x + dx, y + dy) for x, y in (start, end)))
    right = bound("rightBound", *((x - dx, y - dy) for x, y in (start, end)))
    return f'<lanelet id="{number}">{left}{right}{more}</lanelet>'


def state(x: float, y: float, step: int, speed: float = 5.0, tag: str = "state") -> str:
    return (
        f"<{tag}><position><point><x>{x}</x><y>{y}</y></point></position>"
        f"<orientation><exact>1.5707963</exact></orientation><time><exact>{step}</exact></time>"
        f"<velocity><exact>{speed}</exact></velocity></{tag}>"
    )


SHAPE = "<shape><rectangle><length>4.4</length><width>1.8</width></rectangle></shape>"
NETWORK = (
    lanelet(1, (0, -30), (0, 20), '<successor ref="2"/><trafficLightRef ref="50"/>{limit}')
    + lanelet(2, (0, 20), (0, 40), '<predecessor ref="1"/><successor ref="3"/>')
    + lanelet(3, (0, 40), (0, 90), '<predecessor ref="2"/>')
    + lanelet(4, (3.5, -30), (3.5, 90), "<laneletType>sidewalk</laneletType>")
)
LIGHT = (
    '<trafficLight id="50"><cycle><cycleElement><duration>4</duration><color>red</color>'
    "</cycleElement><cycleElement><duration>6</duration><color>green</color></cycleElement>"
    "<timeOffset>2</timeOffset></cycle><direction>{direction}</direction></trafficLight>"
    '<intersection id="60"><incoming id="61"><incomingLanelet ref="1"/>'
    '<successorsStraight ref="2"/></incoming></intersection>'
)
PROBLEM = f'<planningProblem id="90">{state(0, 0, 0, 3.0, "initialState")}</planningProblem>'
HEAD = '<?xml version="1.0"?><commonRoad commonRoadVersion="{version}" timeStepSize="0.1">'


def newer(direction: str = "all", more: str = PROBLEM) -> str:
    limit = '<trafficSignRef ref="40"/>'
    sign = (
        '<trafficSign id="40"><trafficSignElement><trafficSignID>R2-1</trafficSignID>'
        "<additionalValue>11.5</additionalValue></trafficSignElement></trafficSign>"
    )
    car = (
        f'<dynamicObstacle id="70"><type>car</type>{SHAPE}{state(0, 10, 0, 5.0, "initialState")}'
        f"<trajectory>{state(0, 10.5, 1)}{state(0, 11, 2)}</trajectory></dynamicObstacle>"
        f'<staticObstacle id="71"><type>parkedVehicle</type>{SHAPE}'
        f"{state(1, 30, 0, 0.0, 'initialState')}</staticObstacle>"
    )
    body = NETWORK.format(limit=limit) + sign + LIGHT.format(direction=direction) + car + more
    return HEAD.format(version="2020a") + body + "</commonRoad>"


def older() -> str:
    car = (
        f'<obstacle id="70"><role>dynamic</role><type>car</type>{SHAPE}'
        f"{state(0, 10, 0, 5.0, 'initialState')}<trajectory>{state(0, 10.5, 1)}</trajectory>"
        "</obstacle>"
    )
    network = NETWORK.format(limit="<speedLimit>9.5</speedLimit>")
    return HEAD.format(version="2018b") + network + car + PROBLEM + "</commonRoad>"


def read(path: Path, text: str, item: str | None = None, frame: int | None = None) -> Reading:
    file = path / "made.xml"
    file.write_text(text)
    return CommonRoad().read(file, item=item, frame=frame, name="made")


def fault_of(path: Path, text: str, item: str | None = None) -> str:
    with pytest.raises(InvalidDocument) as caught:
        read(path, text, item)
    return str(caught.value)


def test_a_planning_problem_is_an_ego_without_a_drive(tmp_path: Path) -> None:
    reading = read(tmp_path, newer())
    scene, recording = reading.scene, reading.recording
    assert recording is not None
    assert np.isnan(recording.ego[1:]).all()
    assert (scene.ego.speed_mps, scene.ego.lane_id) == (3.0, "Lane1")
    assert set(ASSUMED) <= set(reading.notes)
    car, parked = scene.agents
    assert (car.x_m, car.y_m, car.length_m, car.speed_mps) == (10.0, 0.0, 4.4, 5.0)
    assert (parked.x_m, parked.y_m, parked.type) == (30.0, -1.0, AgentType.VEHICLE)
    moved = next(track for track in recording.tracks if track.agent_id == car.id)
    assert moved.states[:, 0].tolist() == [10.0, 10.5, 11.0]
    scene_to_document(scene)


def test_a_recorded_vehicle_can_be_the_ego(tmp_path: Path) -> None:
    reading = read(tmp_path, newer(more=""), "70", 1)
    assert reading.recording is not None
    assert reading.recording.ego[:, 0].tolist() == [0.0, 0.5]
    assert not set(ASSUMED) & set(reading.notes)
    assert read(tmp_path, newer(more="")).moment.item == "70"
    assert "unknown '72'; known: 90, 70" in fault_of(tmp_path, newer(), "72")


def test_the_older_dialect_has_its_own_limits_and_roles(tmp_path: Path) -> None:
    scene = read(tmp_path, older()).scene
    assert scene.lanes[0].speed_limit_mps == 9.5
    assert [agent.type for agent in scene.agents] == [AgentType.VEHICLE]
    assert NO_INTERSECTIONS in read(tmp_path, older()).notes
    assert read(tmp_path, newer()).scene.lanes[0].speed_limit_mps == 11.5


# The cycle of ten steps begins at step 2: red for four of them, green for six.
@pytest.mark.parametrize(
    ("direction", "step", "state"),
    [
        ("all", 0, TrafficLight.GREEN),
        ("all", 2, TrafficLight.RED),
        ("straight", 2, TrafficLight.RED),
        ("leftStraight", 2, TrafficLight.RED),
        ("left", 2, TrafficLight.NONE),
    ],
)
def test_a_light_shows_its_cycle_to_the_ways_in_its_direction(
    tmp_path: Path, direction: str, step: int, state: TrafficLight
) -> None:
    scene = read(tmp_path, newer(direction), "70", step).scene
    (connector,) = scene.connectors
    assert (connector.traffic_light, connector.turn_type) == (state, TurnType.STRAIGHT)
    assert connector.from_lane == "Lane1"


def test_sidewalks_are_areas_and_no_lanes(tmp_path: Path) -> None:
    scene = read(tmp_path, newer()).scene
    assert [area.kind for area in scene.areas] == [AreaKind.WALKWAY]
    assert len(scene.lanes) == 2


BOMB = (
    '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">'
    '<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]><commonRoad>&b;</commonRoad>'
)
OUTSIDE = '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><commonRoad>&a;</commonRoad>'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (BOMB, "declares a document type"),
        (OUTSIDE, "declares a document type"),
        ("<osm/>", "is 'osm' of version '', not commonRoad"),
        (newer().replace('timeStepSize="0.1"', 'timeStepSize="-1"'), "is no step"),
        (newer().replace("<type>car<", "<type>zeppelin<"), "unknown 'zeppelin'"),
        (newer().replace("<color>red<", "<color>blue<"), "unknown 'blue'"),
        (newer().replace("<x>-1.5</x>", "<x>1e999</x>"), "finite number"),
        (newer().replace('ref="3"', 'ref="three"'), "whole number, got 'three'"),
        (newer().replace("<exact>2</exact>", "<exact>1e7</exact>"), "a time step lies from"),
    ],
)
def test_hostile_and_broken_files_are_refused(tmp_path: Path, text: str, said: str) -> None:
    assert said in fault_of(tmp_path, text)
