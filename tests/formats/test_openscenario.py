"""OpenSCENARIO files are read: places and motions as formulas have them, the rest is noted."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from augment.errors import InvalidDocument
from augment.formats.apart import UntrustedInput
from augment.formats.openscenario.parameters import resolve_text
from augment.formats.openscenario.scenario import OpenScenario
from augment.formats.openscenario.writer import write as write_scenarios
from augment.formats.reading import Reading
from augment.formats.writing import Cell
from augment.scene.entities import AgentType, Modification, TrafficLight
from tests.formats.cells import cell, recorded_street, ruled
from tests.formats.opendrive_maps import by_hand
from tests.formats.openscenario_files import (
    AFTER,
    BOX,
    BRAKES,
    CAR,
    CHANGE,
    FOLLOW,
    GAP,
    RIGHT,
    STEP,
    TIMING,
    by_entity,
    by_time,
    catalog,
    event,
    moves,
    read,
    route,
    scenario,
    speed,
    write,
)
from tests.formats.test_archive import folder_as_zip
from tests.formats.test_opendrive import JUNCTION, SIGNAL
from tests.formats.test_openscenario_positions import pose_of_other
from tests.formats.test_openscenario_writer import scene_of_motions
from tests.scenes import vehicle


def test_an_expression_has_the_value_of_the_standard() -> None:
    for text, value in (
        *(("plain", "plain"), ("$v", "7.5"), ("${$v * 2 + 1}", "16"), ("${-$v % 2}", "-1.5")),
        ("${round(pow($v, 2)) + max(1, 2)}", "58"),
        *(("${$on and $v > 7}", "true"), ("${not $on}", "false")),
        *(("${sqrt(16) / 8}", "0.5"), ("${round(2.5) + round(-0.5)}", "2")),
    ):
        assert resolve_text(text, {"v": "7.5", "on": "true"}, "here") == value


def test_an_expression_without_a_value_is_refused() -> None:
    for text, says in (
        ("$w", "unknown parameter 'w'; known here: v"),
        *(("${$v", "needs ${...}"), ("${1 / 0}", "has no value")),
        *(("${9 ** 9 ** 9 ** 9}", "has no value"), ("${__import__('os')}", "has no value")),
        ("${$v.real}", "more than numbers"),
        ("${" + "(" * 300 + "1" + ")" * 300 + "}", "at most 500 characters"),
        ("${'a' * 10}", "more than numbers"),
    ):
        with pytest.raises(InvalidDocument, match=re.escape(says)):
            resolve_text(text, {"v": "7.5"}, "here")


def test_parameters_hold_in_what_declares_them(tmp_path: Path) -> None:
    declared = "".join(
        f'<ParameterDeclaration name="{name}" parameterType="double" value="{value}"/>'
        for name, value in (("s", "30"), ("v", "${$s / 10}"))
    )
    head = f"<ParameterDeclarations>{declared}</ParameterDeclarations>"
    at = '<LanePosition roadId="1" laneId="${-1}" s="${$s + 20}"/>'
    reading = read(write(tmp_path, scenario(head=head, other_at=at, other_does=(speed("$v"),))))
    assert pose_of_other(reading) == pytest.approx([50.0, -1.75, 0.0], abs=2e-3)
    assert reading.scene.agents[0].speed_mps == 3.0


def test_a_catalogs_entry_has_the_box_that_was_assigned(tmp_path: Path) -> None:
    entry = (
        '<Vehicle name="lorry" vehicleCategory="bus"><ParameterDeclarations><ParameterDeclaration '
        'name="long" parameterType="double" value="9"/></ParameterDeclarations>'
        + BOX.replace('"5"', '"$long"')
        + "</Vehicle>"
    )
    assigned = '<ParameterAssignment parameterRef="$long" value="$long"/>'
    refers = '<CatalogReference catalogName="Cars" entryName="{}">{}</CatalogReference>'
    other = refers.format("lorry", f"<ParameterAssignments>{assigned}</ParameterAssignments>")
    head = (
        '<ParameterDeclarations><ParameterDeclaration name="long" value="12"/>'
        "</ParameterDeclarations><CatalogLocations><VehicleCatalog>"
        '<Directory path="a/b/c/d/e/f"/></VehicleCatalog></CatalogLocations>'
    )
    # Another of the name is not the one that is meant.
    files = {"sub/cars.xosc": catalog(entry.replace('width="2"', 'width="3"'))}
    files |= {"a/b/c/d/e/f/cars.xosc": catalog(entry)}
    file = write(tmp_path, scenario(other=other, head=head), **files)
    (agent,) = read(file).scene.agents
    assert (agent.type, agent.size_m) == (AgentType.BUS, (12.0, 2.0))
    for wrong, says in (
        (refers.format("van", ""), "catalog Cars: unknown 'van'; known: lorry"),
        (other.replace("Cars", "Vans"), "catalog Vans: is not in the folder of the scenario"),
    ):
        reading = read(write(tmp_path, scenario(other=wrong)))
        assert any(says in note for note in reading.notes)
        assert not reading.scene.agents


def test_an_entry_of_a_catalog_may_name_another(tmp_path: Path) -> None:
    refers = '<CatalogReference catalogName="{}" entryName="{}"/>'
    inner = f"<TrajectoryRef>{refers.format('Ways', 'way')}</TrajectoryRef>"
    follow = FOLLOW.format("", TIMING.format("relative"))
    action = f"{follow[: follow.index('<Trajectory ')]}{inner}{follow[follow.index('<TimeRef') :]}"
    maneuver = f'<Maneuver name="goes">{event(action, by_time(1))}</Maneuver>'
    shape = f"<Shape><Polyline>{TWO}</Polyline></Shape>"
    files = {
        "ways.xosc": catalog(f'<Trajectory name="way">{shape}</Trajectory>', "Ways"),
        "moves.xosc": catalog(maneuver, "Moves"),
    }
    text = scenario().replace('<Maneuver name="m"></Maneuver>', refers.format("Moves", "goes"))
    reading = read(write(tmp_path, text, **files))
    assert reading.recording.tracks[0].states[-1, 0] == pytest.approx(68 + 1.4 - 21.4, abs=0.01)
    circle = f'<Trajectory name="way">{inner}</Trajectory>'
    files["ways.xosc"] = catalog(circle, "Ways")
    notes = read(write(tmp_path, text, **files)).notes
    assert any("catalog entry way: lies too deep" in note for note in notes)


THING = f'<MiscObject miscObjectCategory="{{}}">{BOX}</MiscObject>'


def test_a_category_is_a_class_of_ours(tmp_path: Path) -> None:
    for body, kind in (
        (CAR, AgentType.VEHICLE),
        (CAR.replace('"car">', '"motorbike">'), AgentType.BICYCLE),
        (f'<Pedestrian pedestrianCategory="pedestrian">{BOX}</Pedestrian>', AgentType.PEDESTRIAN),
        (THING.format("barrier"), AgentType.BARRIER),
        (THING.format("obstacle"), AgentType.GENERIC_OBJECT),
    ):
        (agent,) = read(write(tmp_path, scenario(other=body))).scene.agents
        assert agent.type is kind


RELATIVE = (
    f"<LongitudinalAction><SpeedAction>{STEP}<SpeedActionTarget><RelativeTargetSpeed "
    'entityRef="Ego" value="{}" speedTargetValueType="{}"/></SpeedActionTarget></SpeedAction>'
    "</LongitudinalAction>"
)


@pytest.mark.parametrize(("value", "kind", "mps"), [(-2, "delta", 8.0), (0.5, "factor", 5.0)])
def test_a_speed_may_be_relative(value: float, kind: str, mps: float, tmp_path: Path) -> None:
    does = RELATIVE.format(value, kind)
    (agent,) = read(write(tmp_path, scenario(other_does=(does,)))).scene.agents
    assert agent.speed_mps == mps


PLACE = '<Position><WorldPosition x="{}" y="1.75"/></Position>'
SHARP = f'<Clothoid curvature="0" curvaturePrime="1e7" length="40">{PLACE.format(60)}</Clothoid>'
TWO = "".join(f'<Vertex time="{n}">{PLACE.format(60 + 8 * n)}</Vertex>' for n in range(2))


@pytest.mark.parametrize(
    ("made", "note"),
    [
        (scenario(event("<ControllerAction/>"), event("<ControllerAction/>", name="more")),
         "left out: ControllerAction (2); first event acts."),
        (scenario(event(BRAKES, by_entity(GAP.format(20, "false").replace(
            "<RelativeD", '<D').replace(" entity", ' alongRoute="true" entity')))),
         "A distance along roads is taken as the one between places"),
        (scenario(other_does=(RELATIVE.format(-2, "delta").replace(
            "Speed entity", 'Speed continuous="1" entity'),)),
         "A speed that is kept relative to somebody is taken once"),
        (scenario(event("<RoutingAction><AcquirePositionAction/></RoutingAction>")),
         "left out: AcquirePositionAction (1); first event acts."),
        (scenario(event("<RoutingAction><AssignRouteAction/></RoutingAction>")),
         "needs a Route of two waypoints"),
        (scenario(event(BRAKES, by_entity('<StandStillCondition duration="1"/>', "Ego"))),
         "its conditions never hold in 15 s"),
        # CARLA's own player looks at an event's conditions once its act has begun.
        (scenario(event(BRAKES, by_entity(GAP.format(10, "false")))).replace(
            by_time(0), by_time(9)).replace('y="-1.75"', 'y="1.75"').replace(
            'revMinor="1"', 'revMinor="1" description="CARLA:"'), "never hold in 15 s"),
        (scenario(event(BRAKES, by_entity("<OffroadCondition duration='1'/>"))),
         "event acts: unknown 'OffroadCondition'"),
        (scenario(other=CAR.replace('"car">', '"hovercraft">')),
         "The category hovercraft is not known"),
        (scenario(event(BRAKES, by_entity('<SpeedCondition value="99" rule="greaterThan"/>'))),
         "its conditions never hold"),
        (scenario(event(CHANGE.format("time", 2, RIGHT.replace("-1", "1")))),
         "there is no lane in its direction to change to"),
        (scenario(event(CHANGE.format("time", 2, RIGHT.replace("-1", "-3")))),
         "road 1.lane: unknown '-4'; known: 1, -1, -2"),
        (scenario(event(FOLLOW.format(TWO, "<None/>").replace(
            "<FollowTrajectoryAction", '<FollowTrajectoryAction initialDistanceOffset="far"'))),
         "event acts.initialDistanceOffset: expected a finite number"),
        (scenario(event(FOLLOW.format("", "<None/>"))), "Polyline: needs two vertices at least"),
        (scenario(event(FOLLOW.format(TWO, TIMING.format("relative").replace('"1"', '"-1"')))),
         "needs times that ascend"),
        (scenario(event(FOLLOW.format("", "<None/>").replace("<Polyline></Polyline>", SHARP))),
         "curvature at its end: expected a finite number from -10 to 10"),
        (scenario(event(speed("${bad + _ + $v}"))), "SpeedAction.value: expected a finite"),
        (scenario(event(speed("${bad + _ + $v}"))),
         "AbsoluteTargetSpeed.value: unknown parameter 'v'"),
        (scenario(other_does=(speed("fast"),)), "speeds (1); first speed of Other.value"),
        (scenario(other=CAR.replace("</Vehicle>", "<Trailer/></Vehicle>")), "A trailer was left"),
        (scenario(event(CHANGE.format("time", 2, RIGHT).replace(
            "<LaneChangeAction>", '<LaneChangeAction targetLaneOffset="0.5">'))),
         "The offset after a lane change was left out"),
        (scenario(event(BRAKES, AFTER.replace("acts", "x"))), "event acts: unknown 'x'"),
        (scenario(event(BRAKES), event(speed(9), by_time(70), "late")),
         "event late: begins over 60 s after the first"),
        (scenario(event(speed(-3))), "backwards, is not read"),
        (scenario(event(BRAKES.replace("linear", "hold"))), "event acts: unknown 'hold'"),
        (scenario(event(BRAKES, by_entity(GAP.format(20, "false")).replace(
            "<Condition>", '<Condition conditionEdge="latched">'))), "unknown 'latched'"),
        (scenario(event(CHANGE.format("time", 2, RIGHT), by_time(50)), other_does=(speed(40),)),
         "event acts: is past the map when it begins"),
        (scenario(*(event(speed(n), by_time(n), name=f"{n}") for n in range(30))),
         "motions (1); first speeds: List should have at most 50"),
        (scenario(other_at='<GeoPosition/>'), "entity Other: unknown 'GeoPosition'"),
        (scenario(other_at='<LanePosition roadId="1" laneId="-1" s="900"/>'),
         "road 1.s: expected a finite number from -0.01 to 400.01"),
        (scenario(other_at='<RelativeObjectPosition entityRef="Other" dx="1" dy="0"/>'),
         "refers to itself in a circle"),
        (scenario(other='<MiscObject miscObjectCategory="tree"/>'), "A tree was left out"),
        (scenario(other=f'{CAR}</ScenarioObject><ScenarioObject name="Other">{CAR}'),
         "Of two entities with one id the last counts"),
        (scenario(other_does=("<ControllerAction/>",)), "ControllerAction at t0 was left out"),
        (scenario(event(BRAKES, by_entity('<SpeedCondition value="1" rule="greaterThan"/>')
                        .replace("<Condition>", '<Condition conditionEdge="rising">'))),
         "its conditions never hold"),
        (scenario(event(BRAKES).replace("<Event", '<Event maximumExecutionCount="3"')),
         "What may happen several times happens once"),
        (scenario(event(BRAKES)).replace("</Act>", "<StopTrigger><ConditionGroup>"
                                         f"{by_time(9)}</ConditionGroup></StopTrigger></Act>"),
         "The condition that stops an act was left out"),
        (scenario(more="<VariableDeclaration/>"), "VariableDeclaration was left out"),
        (scenario(event(BRAKES)).replace('"Other"/></Actors>', '"X"/></Actors>'),
         "Events of somebody who is not there were left out"),
        (scenario(event(BRAKES, by_time(2).replace("greater", "more"))), "unknown 'moreThan'"),
        (scenario(event(BRAKES), event(BRAKES, AFTER.replace("completeState", "skipTransition"))),
         "unknown 'skipTransition'; known: startTransition"),
        (scenario(event(BRAKES, by_entity(GAP.format(30, "maybe")))), "unknown 'maybe'; known"),
        (scenario(event(CHANGE.format("time", 2, RIGHT).replace("sinusoidal", "linear"))),
         "A linear lane change became a smooth one"),
        (scenario(more="<GlobalAction><EnvironmentAction/></GlobalAction>"),
         "EnvironmentAction at t0 was left out"),
    ],
)  # fmt: skip
def test_what_is_left_out_is_noted_with_its_place(made: str, note: str, tmp_path: Path) -> None:
    notes = read(write(tmp_path, made)).notes
    assert any(note in text for text in notes), notes


def test_a_scenario_that_can_not_be_read_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "inner"
    folder.mkdir()
    (tmp_path / "out.xodr").write_text("<OpenDRIVE/>")
    for made, says in (
        (scenario(logic="Town03"), "the map 'Town03' is not beside the scenario"),
        (scenario(logic="../out.xodr"), "the map '../out.xodr' is not beside"),
        (scenario(logic="/etc/passwd"), "is not beside"),
        (scenario(logic=""), "names no LogicFile"),
        (scenario(logic="ü" * 200), "the map 'üüüü"),
        (scenario(ego="A"), "nobody is called Ego or ego or EGO or hero"),
        (scenario().replace('Minor="1"', 'Minor="9"'), "of version '1.9'"),
        (scenario(logic="$map"), "LogicFile.filepath: unknown parameter 'map'"),
        (catalog(""), "has no Storyboard"),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]><OpenSCENARIO>&b;</OpenSCENARIO>", "a document type"),
    ):
        with pytest.raises(InvalidDocument, match=re.escape(says)):
            read(write(folder, made))


def test_the_ego_is_who_is_asked_for(tmp_path: Path) -> None:
    file = write(tmp_path, scenario())
    items = [moment.item for moment in OpenScenario().moments(file, every_s=1.0)]
    assert items == ["Ego", "Other"]
    asked = read(file, "Other")
    assert asked.scene.origin.x_m == pytest.approx(81.4)
    put = read(file, "@1,-2,30")
    assert put.scene.origin.x_m == pytest.approx(30.0)
    assert len(put.scene.agents) == 2
    with pytest.raises(InvalidDocument, match="item: unknown 'Nobody'; known: Ego, Other"):
        read(file, "Nobody")


PHASES = "".join(
    f'<Phase name="{state}"><TrafficSignalState trafficSignalId="7" state="{state}"/></Phase>'
    for state in ("green", "red")
)


@pytest.mark.parametrize(
    ("action", "controller", "light", "note"),
    [
        ('StateAction name="7" state="red"', "", TrafficLight.RED, ""),
        ('StateAction name="7" state="on;off;off"', "", TrafficLight.RED, ""),
        ("", "", TrafficLight.GREEN, ""),
        ('ControllerAction trafficSignalControllerRef="c" phase="red"', "", TrafficLight.RED, ""),
        ('ControllerAction trafficSignalControllerRef="c" phase="x"', "", TrafficLight.UNKNOWN,
         "controller: unknown 'x'; known: green, red"),
        ("", 'delay="5" reference="d"', TrafficLight.UNKNOWN, "controller: c begins later"),
    ],
)  # fmt: skip
def test_a_light_shows_what_its_controller_or_action_says(
    action: str, controller: str, light: TrafficLight, note: str, tmp_path: Path
) -> None:
    wraps = "<GlobalAction><InfrastructureAction><TrafficSignalAction>"
    said = f"{wraps}<TrafficSignal{action}/></TrafficSignalAction></InfrastructureAction>"
    text = scenario(more=f"{said}</GlobalAction>" if action else "").replace(
        "</RoadNetwork>",
        f'<TrafficSignals><TrafficSignalController name="c" {controller}>{PHASES}'
        "</TrafficSignalController></TrafficSignals></RoadNetwork>",
    )
    roads = {"roads.xodr": by_hand(end=SIGNAL, rest=JUNCTION)}
    reading = read(write(tmp_path, text, **roads))
    lights = {way.traffic_light for way in reading.scene.connectors}
    assert lights == {light, TrafficLight.NONE}
    assert any(note in text for text in reading.notes)


# There and back


def write_and_read(given: Cell, folder: Path) -> Reading:
    made = write_scenarios([given]).files
    for name, content in made.items():
        (folder / name).write_bytes(content)
    return read(next(folder / name for name in made if name.endswith(".xosc")))


def recorded_cell() -> Cell:
    before, recording = recorded_street()
    return cell(before, recording=recording, keeps_traffic=True, added=())


@pytest.mark.parametrize("make", [cell, scene_of_motions, recorded_cell, ruled])
def test_our_own_files_come_back_whole(make: object, tmp_path: Path) -> None:
    given: Cell = make()  # type: ignore[operator]
    reading = write_and_read(given, tmp_path)
    back = moves(reading)
    ours = {reading.names.get(m.agent.id, "Agent1"): m for m in (back.ego, *back.others)}
    for movement in (given.motion.ego, *given.motion.others):
        agent = movement.agent
        if math.hypot(agent.x_m, agent.y_m) > 150.0:
            continue
        read_back = ours[agent.id]
        assert read_back.agent.size_m == pytest.approx(agent.size_m, abs=1e-3)
        steps = len(movement.states)
        gaps_m = np.hypot(*(movement.states[:, :2] - read_back.states[:steps, :2]).T)
        here = ~np.isnan(movement.states[:, 0])
        assert (here == ~np.isnan(read_back.states[:steps, 0])).all(), agent.id
        # Past a corner that lies between two written points it cuts at most 2 cm.
        assert np.nanmax(gaps_m) < 0.02, agent.id
        assert np.nanpercentile(gaps_m, 95) < 0.01, agent.id
        if read_back.started_s is not None:
            assert read_back.started_s == pytest.approx(movement.started_s, abs=0.01)
    assert len(reading.scene.lanes) == len(given.scene.lanes)
    for lane, before in zip(reading.scene.lanes, given.scene.lanes, strict=True):
        assert lane.width_m == pytest.approx(before.width_m, abs=0.01)


def test_an_edit_of_a_zip_is_written_back_without_touching_others(tmp_path: Path) -> None:
    change = event(CHANGE.format("time", 3, RIGHT), by_time(1))
    lorry = f'<Vehicle name="lorry" vehicleCategory="bus">{BOX.replace("5", "12")}</Vehicle>'
    refers = '<CatalogReference catalogName="Cars" entryName="lorry"/>'
    taken = f"<AssignRouteAction><Route>{route((-1, 20), (-1, 90))}</Route></AssignRouteAction>"
    does = f"<PrivateAction>{speed(10)}</PrivateAction>"
    routed = f"{does}<PrivateAction><RoutingAction>{taken}</RoutingAction></PrivateAction>"
    text = scenario(change, other=refers, other_does=(speed(8),)).replace(does, routed, 1)
    (tmp_path / "in").mkdir()
    write(tmp_path / "in", text, **{"sub/cars.xosc": catalog(lorry)})
    packed = UntrustedInput(path=folder_as_zip(tmp_path / "in.zip", tmp_path / "in"))
    _, source = packed.read(item=None, frame=None, name="made")
    assert any("own events and route were left out" in note for note in source.notes)
    before = moves(source)
    added = (vehicle("Agent9", 30.0, -3.5, 0.0),)
    given = cell(source.scene, added=added, keeps_traffic=True, recording=source.recording)
    (tmp_path / "out").mkdir()
    after = write_and_read(given, tmp_path / "out")
    assert {a.size_m: a.type for a in after.scene.agents} == {
        (12.0, 2.0): AgentType.BUS,
        added[0].size_m: AgentType.VEHICLE,
    }
    (kept,) = (m for m in moves(after).others if m.agent.type is AgentType.BUS)
    steps = min(len(kept.states), len(before.others[0].states))
    gaps_m = np.hypot(*(kept.states[:steps, :2] - before.others[0].states[:steps, :2]).T)
    assert np.nanmax(gaps_m) < 0.01
    assert replace(given, modification=Modification()).after == source.scene
