import math
import re
from pathlib import Path

import numpy as np
import pytest

from augment.errors import InvalidDocument
from augment.formats.commonroad.scenario import ASSUMED, CommonRoad
from augment.formats.readers import recognise
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
    network = network.replace('<trafficLightRef ref="50"/>', "")
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
    assert reading.recording.ego[:, 0].tolist() == [0.0, 0.5]
    assert not set(ASSUMED) & set(reading.notes)
    assert read(tmp_path, newer(more="")).moment.item == "70"
    assert "unknown '72'; known: 90, 70, 71" in fault_of(tmp_path, newer(), "72")


def test_a_namespace_of_the_root_changes_nothing(tmp_path: Path) -> None:
    spaced = newer().replace("<commonRoad ", '<commonRoad xmlns="urn:x" xmlns:o="urn:o" ')
    spaced = spaced.replace("</commonRoad>", "<o:lanelet id='9'/></commonRoad>")
    reading = read(tmp_path, spaced)
    assert reading.scene == read(tmp_path, newer()).scene
    assert "first {urn:o}lanelet 9: unknown" in " ".join(reading.notes)


def test_a_file_in_utf_16_is_recognised(tmp_path: Path) -> None:
    file = tmp_path / "made.xml"
    text = newer().replace('"1.0"', '"1.0" encoding="utf-16"')
    file.write_text(text, encoding="utf-16")
    utf_16 = recognise(file).read(file, item=None, frame=None, name="made")
    assert utf_16.scene == read(tmp_path, newer()).scene


def test_the_older_dialect_has_its_own_limits_and_roles(tmp_path: Path) -> None:
    scene = read(tmp_path, older()).scene
    assert scene.lanes[0].speed_limit_mps == 9.5
    assert [agent.type for agent in scene.agents] == [AgentType.VEHICLE]
    assert NO_INTERSECTIONS in read(tmp_path, older()).notes
    assert read(tmp_path, newer()).scene.lanes[0].speed_limit_mps == 11.5


# The cycle of ten steps begins at step 2: red for four of them, green for six.
def test_a_light_shows_its_cycle_to_the_ways_in_its_direction(tmp_path: Path) -> None:
    for direction, step, state in (
        *(("all", 0, TrafficLight.GREEN), ("all", 2, TrafficLight.RED)),
        *(("straight", 2, TrafficLight.RED), ("leftStraight", 2, TrafficLight.RED)),
        ("left", 2, TrafficLight.NONE),
    ):
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


def test_hostile_and_broken_files_are_refused(tmp_path: Path) -> None:
    for text, said in (
        (BOMB, "declares a document type"),
        (OUTSIDE, "declares a document type"),
        ("<osm/>", "is 'osm' of version '', not commonRoad"),
        (newer().replace('timeStepSize="0.1"', 'timeStepSize="-1"'), "number from 0.001 to 10"),
        (newer().replace("<exact>3.0<", "<exact>300<"), "beyond the earth or 100 m/s"),
    ):
        assert said in fault_of(tmp_path, text)


BACK = "<point><x>0</x><y>60</y></point>"


# A good file with one part changed, the note on it, and what is left: lanes, connectors, agents.
@pytest.mark.parametrize(
    ("good", "odd", "said", "left"),
    [
        ("<type>car<", "<type>zeppelin<", "objects (1); first dynamicObstacle 70: unk", (2, 1, 1)),
        ("<color>red<", "<color>blue<", "states of lights (1); first trafficLight 50", (2, 1, 2)),
        ("<x>-1.5</x><y>40", "<x>1e999</x><y>40", "lanelets (2); first lanelet 2", (1, 0, 2)),
        ("<x>-1.5</x><y>40", "<x>-1_5</x><y>40", "lanelets (2); first lanelet 2", (1, 0, 2)),
        ("<x>-1.5</x><y>40", "<x>-1<b>5</b></x><y>40", "lanelets (2); first lan", (1, 0, 2)),
        (">5.0<", "> 5<b>1</b> <", "objects (1); first dynamicObstacle 70.vel", (2, 1, 1)),
        ('ref="3"', 'ref="three"', "a whole number, got 'three'", (2, 1, 2)),
        ("<exact>2</exact>", "<exact>1e7</exact>", "states (1); first dynamicObstacle 70",
         (2, 1, 2)),
        ("<y>90.0</y>", "<y>40.0</y>", "first lanelet 3: a line needs", (1, 1, 2)),
        (">11.5<", ">fast<", "speed limits (1); first trafficSign 40", (2, 1, 2)),
        ("<length>4.4</length>", "", "shapes (2); first dynamicObstacle 70.le", (2, 1, 2)),
        ("<exact>5.0<", "<exact>-5.0<", "drives backwards counts as driving forw", (2, 1, 2)),
        ("</commonRoad>", "<toll id='9'/></commonRoad>", "objects (1); first toll 9", (2, 1, 2)),
        ("sidewalk", "moon", "types of lanelets (1); first lanelet 4: unknown", (3, 1, 2)),
        ("<y>90.0</y></point>", f"<y>90.0</y></point>{BACK}", "lanelet.3: folds back", (1, 1, 2)),
        ('id="3"', 'id="2"', "Of two lanelets with one id the last counts", (1, 1, 2)),
        ("<exact>2</exact>", "<exact>1</exact>", "Of two states with one id the last", (2, 1, 2)),
        ('trafficSignRef ref="40"', 'trafficSignRef ref="41"', "A sign that is named is n",
         (2, 1, 2)),
        ("<laneletType>sidewalk<", "<userOneWay>bicycle</userOneWay><laneletType>urban<",
         "left out: bicycle lanes", (2, 1, 2)),
        ("<laneletType>sidewalk<",
         "<userBidirectional>car</userBidirectional><laneletType>urban<",
         "that cars use both ways", (3, 1, 2)),
        ("<laneletType>sidewalk<", "<userOneWay>yeti</userOneWay><laneletType>urban<",
         "users of lanelets (1); first lanelet 4: unknown 'yeti'", (3, 1, 2)),
        ("</staticObstacle>", f"<trajectory>{state(2, 31, 0)}</trajectory></staticObstacle>",
         "The motion of what is static was left out", (2, 1, 2)),
    ],
)  # fmt: skip
def test_one_bad_part_is_left_out_with_a_note(
    tmp_path: Path, good: str, odd: str, said: str, left: tuple[int, int, int]
) -> None:
    reading = read(tmp_path, newer().replace(good, odd))
    scene = reading.scene
    assert said in " ".join(reading.notes)
    assert (len(scene.lanes), len(scene.connectors), len(scene.agents)) == left


def test_a_limit_is_what_its_sign_and_unit_say(tmp_path: Path) -> None:
    for sign, value, limit_mps in (
        *(("R2-1", "25mph", 11.176), ("274", "30 km/h", 8.333), ("274.1", "30kmh", 8.333)),
        *(("B14", "13.89", 13.89), ("C43", "13,89", 13.89), ("r301", "10 m/s", 10.0)),
        *(("R2-1", "-3", None), ("R2-1", "30 furlongs", None), ("306", "30", None)),
    ):
        text = newer().replace("R2-1", sign).replace("11.5", value)
        assert read(tmp_path, text).scene.lanes[0].speed_limit_mps == limit_mps


@pytest.mark.parametrize(
    ("good", "odd", "light"),
    [
        ("successorsStraight", "outgoingStraight", TrafficLight.GREEN),
        ('<successorsStraight ref="2"/>', "", TrafficLight.GREEN),
        ("intersection", "junction", TrafficLight.GREEN),
        ('<trafficLightRef ref="50"/>', '<stopLine><trafficLightRef ref="50"/></stopLine>',
         "green"),
        ("<direction>all<", "<direction>diagonal<", TrafficLight.GREEN),
        ("</trafficLight>", "<active>false</active></trafficLight>", TrafficLight.UNKNOWN),
        ("cycle", "circle", TrafficLight.UNKNOWN),
        ('trafficLight id="50"', 'trafficLight id="51"', TrafficLight.UNKNOWN),
        ("<direction>all<", "<direction>left<", TrafficLight.NONE),
        ('<trafficLightRef ref="50"/>', "", TrafficLight.NONE),
        ('<trafficLightRef ref="50"/>', '<trafficLightRef ref="L"/>', TrafficLight.UNKNOWN),
    ],
)  # fmt: skip
def test_every_way_to_name_a_light_gives_it_to_what_it_governs(
    tmp_path: Path, good: str, odd: str, light: str
) -> None:
    reading = read(tmp_path, newer().replace(good, odd))
    (connector,) = reading.scene.connectors
    assert connector.traffic_light == light
    notes = " ".join(reading.notes)
    assert ("of unknown state" in notes) == (light == TrafficLight.UNKNOWN)
    idle = light == TrafficLight.NONE or 'id="51"' in odd or 'ref="L"' in odd
    assert ("governs no lane" in notes) == idle


POINT = "<point><x>0</x><y>11</y></point>"
BOX = "<length>2</length><width>1</width><orientation>1</orientation>"
DISC = "<circle><radius>2</radius><center><x>0</x><y>12</y></center></circle>"
CORNERS = ((-3, 10), (3, 10), (0, 16))
TRIANGLE = "".join(f"<point><x>{x}</x><y>{y}</y></point>" for x, y in CORNERS)
SPEED, UP = "<velocity>5</velocity>", "<orientation>1.5708</orientation>"
OVER_THE_END = (
    "<orientation><intervalStart>3</intervalStart><intervalEnd>-3</intervalEnd></orientation>"
)
SPEEDS = "<velocity><intervalStart>4</intervalStart><intervalEnd>6</intervalEnd></velocity>"


# Where the state of step 1 lies, which way it goes and how fast, as commonroad-io has it.
@pytest.mark.parametrize(
    ("position", "values", "expected"),
    [
        (POINT, "<velocity>3</velocity><velocityY>4</velocityY>", (11, 0, 0.9273, 5)),
        (POINT, SPEED, (11, 0, 1.5708, 5)),
        (POINT, UP, (11, 0, 1.5708, 10)),
        (f"<rectangle>{BOX}<center><x>1</x><y>12</y></center></rectangle>",
         f"<velocity>-5</velocity>{UP}", (12, 1, 1.5708, 5)),
        (DISC, SPEEDS + UP, (12, 0, 1.5708, 5)),
        (f"<polygon>{TRIANGLE}</polygon>", SPEED + UP, (12, 0, 1.5708, 5)),
        ("<lanelet ref='2'/>", SPEED + UP, (30, 0, 1.5708, 5)),
        (POINT, SPEED + OVER_THE_END, (11, 0, math.pi, 5)),
    ],
)  # fmt: skip
def test_a_state_may_be_given_in_every_way_of_the_format(
    tmp_path: Path, position: str, values: str, expected: tuple[float, ...]
) -> None:
    values = re.sub("<(velocityY?|orientation)>([-.0-9]+)<", r"<\1><exact>\2</exact><", values)
    text = f"<state><position>{position}</position><time><exact>1</exact></time>{values}</state>"
    made = re.sub("<trajectory>.*</trajectory>", f"<trajectory>{text}</trajectory>", newer())
    recording = read(tmp_path, made).recording
    x, y, heading, speed = recording.tracks[0].states[1]
    assert (x, y, heading, speed) == pytest.approx(
        (expected[0], -expected[1], expected[2] - math.pi / 2, expected[3]), abs=0.01
    )


def test_a_position_that_names_no_lanelet_costs_its_owner_alone(tmp_path: Path) -> None:
    place = "<position><lanelet ref='x&apos;]'/></position>"
    made = re.sub("<position>.*?</position>", place, newer(), count=1)
    reading = read(tmp_path, made)
    assert "objects (1); first dynamicObstacle 70.position" in " ".join(reading.notes)
    assert len(reading.scene.agents) == 1


def test_shapes_of_an_obstacle_become_the_box_around_them(tmp_path: Path) -> None:
    part = (
        "<rectangle><length>{}</length><width>2</width><originXShift>{}</originXShift></rectangle>"
    )
    made = newer().replace(SHAPE, f"<shape>{part.format(4, -1)}{part.format(2, 2)}</shape>", 1)
    car = read(tmp_path, made).scene.agents[0]
    assert (car.length_m, car.width_m, car.x_m) == (6.0, 2.0, 10.0)


@pytest.mark.parametrize(
    ("country", "side"), [("GBR", "left"), ("C-JPN", "left"), ("ZAM", "right"), ("bmu", "left")]
)
def test_a_country_tells_the_side_if_no_lane_does(tmp_path: Path, country: str, side: str) -> None:
    made = newer().replace("<commonRoad ", f'<commonRoad benchmarkID="{country}_Test-1_1_T-1" ')
    assert read(tmp_path, made).scene.traffic_side == side


def test_a_map_without_an_ego_says_so_and_takes_one_on_a_lane(tmp_path: Path) -> None:
    made = newer(more="").replace("<type>car<", "<type>bus<")
    said = fault_of(tmp_path, made)
    assert "no planning problem and no moving car" in said
    assert "as the item: 70 (bus), 71 (parkedVehicle)" in said
    assert read(tmp_path, made, "70").scene.ego.length_m == 4.4
    reading = read(tmp_path, made, "@1,12.5")
    assert (reading.scene.origin.pose.x_m, reading.scene.origin.pose.y_m) == (0.0, -17.5)
    assert len(reading.scene.agents) == 2
    assert "lane: expected a finite number from 0 to 50, got '60'" in fault_of(
        tmp_path, made, "@1,60"
    )
    assert "unknown '9'; known: 1, 2, 3" in fault_of(tmp_path, made, "@9,1")
