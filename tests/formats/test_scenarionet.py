import os
import pickle
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from augment.errors import InvalidDocument
from augment.formats.readers import recognise
from augment.formats.reading import Reading
from augment.formats.scenarionet.scenario import ScenarioNet
from augment.scene.codec import scene_to_document
from augment.scene.entities import AreaKind, TrafficLight, TrafficSide, TurnType


def moving(x: float, speed: float, steps: int = 3, **fields: object) -> dict[str, Any]:
    """A track along +x at that speed, a tenth of a second between steps."""
    xs = x + 0.1 * speed * np.arange(steps)
    column = np.ones((steps, 1))
    state = {
        "position": np.column_stack([xs, np.zeros(steps), np.zeros(steps)]),
        "velocity": np.column_stack([np.full(steps, speed), np.zeros(steps)]),
        "heading": np.zeros(steps),
        "valid": np.ones(steps),
        "length": 4.5 * column,
        "width": 1.9 * column,
    }
    return {"type": "VEHICLE", "state": state, "metadata": {}} | fields


def strip(x: float, to: float, **fields: object) -> dict[str, Any]:
    """A lane along +x, 4 m wide."""
    line = np.array([[x, 0.0, 0.0], [to, 0.0, 0.0]])
    ring = np.array([[x, 2.0], [to, 2.0], [to, -2.0], [x, -2.0]])
    return {"type": "LANE_SURFACE_STREET", "polyline": line, "polygon": ring} | fields


def description() -> dict[str, Any]:
    bend = np.array([[30.0, 0.0, 0.0], [38.0, 3.0, 0.0], [40.0, 12.0, 0.0]])
    inner = {"type": "LANE_SURFACE_UNSTRUCTURE", "speed_limit_kmh": 100, "entry_lanes": ["a"]}
    ego = moving(0.0, 10.0)
    ego["state"]["length"], ego["state"]["width"] = ego["state"]["width"], ego["state"]["length"]
    metadata = {
        "sdc_id": "ego", "ts": np.array([0.0, 0.1, 0.2]), "counts": defaultdict(int),
        "dataset": "nuscenes", "map": "singapore-onenorth",
    }  # fmt: skip
    return {
        "id": "made",
        "length": 3,
        "metadata": metadata,
        "tracks": {"ego": ego, "car": moving(20.0, 5.0), "cone": moving(9.0, 0.0, type="OTHER")},
        "dynamic_map_states": {
            "x": {"lane": "x", "state": {"object_state": ["LANE_STATE_GO", "LANE_STATE_STOP", ""]}}
        },
        "map_features": {
            "a": strip(-30.0, 30.0, exit_lanes=["x", "y"]),
            "x": inner | {"polyline": np.array([[30.0, 0.0], [45.0, 0.0]]), "exit_lanes": ["b"]},
            "y": inner | {"polyline": bend, "exit_lanes": []},
            "b": strip(45.0, 80.0),
            "walk": {"type": "ROAD_EDGE_SIDEWALK", "polygon": np.eye(3)[:, :2] * 20.0},
            "line": {"type": "ROAD_LINE_SOLID_SINGLE_WHITE", "polyline": np.zeros((2, 2))},
        },
    }


def store(path: Path, value: object, protocol: int = 4) -> Path:
    file = path / "made.pkl"
    file.write_bytes(pickle.dumps(value, protocol=protocol))
    return file


def read(file: Path, frame: int | None = None, item: str | None = None) -> Reading:
    return ScenarioNet().read(file, item=item, frame=frame, name="made")


def fault_of(file: Path, item: str | None = None) -> str:
    with pytest.raises(InvalidDocument) as caught:
        read(file, 0 if item else None, item)
    return str(caught.value)


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_every_protocol_gives_the_same_scene(tmp_path: Path, protocol: int) -> None:
    reading = read(store(tmp_path, description(), protocol))
    scene, recording = reading.scene, reading.recording
    assert (scene.ego.length_m, scene.ego.width_m) == (4.5, 1.9)
    assert [(agent.x_m, agent.speed_mps) for agent in scene.agents] == [(9.0, 0.0), (20.0, 5.0)]
    assert recording.ego[:, 0].tolist() == [0.0, 1.0, 2.0]
    scene_to_document(scene)


def test_the_map_has_widths_connectors_lights_and_a_side(tmp_path: Path) -> None:
    reading = read(store(tmp_path, description()))
    scene = reading.scene
    street, after = scene.lanes
    assert (street.width_m, street.speed_limit_mps) == (4.0, None)
    assert {(c.turn_type, c.to_lane, c.traffic_light) for c in scene.connectors} == {
        (TurnType.STRAIGHT, after.id, TrafficLight.GREEN),
        (TurnType.LEFT, None, TrafficLight.UNKNOWN),
    }
    assert {c.speed_limit_mps for c in scene.connectors} == {None}
    assert scene.traffic_side is TrafficSide.LEFT
    assert [area.kind for area in scene.areas] == [AreaKind.WALKWAY]
    notes = " ".join(reading.notes)
    for words in ("were swapped", "have no speed limit", "does not allow commercial use"):
        assert words in notes


class Evil:
    """Runs a command when it is unpickled."""

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.system, ("touch /tmp/it-ran",)


def test_hostile_pickles_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "evil.pkl"
    for block, said in (
        (pickle.dumps(Evil()), "system is not on the list"),
        (pickle.dumps(np.zeros(2, dtype=[("a", "f8")])), "are not read"),
        (b"\x80\x04r\xff\xff\xff\xffN.", "can't be unpickled safely"),
        (b"\x80\x04\x82\x01.", "unregistered extension"),
        (pickle.dumps([1, 2]), "scenario: expected an object"),
        (pickle.dumps({"tracks": {}}), "map_features: expected an object"),
    ):
        file.write_bytes(block)
        assert said in fault_of(file)


DOUBTED = moving(9.0, 1.0)["state"] | {"valid": np.full(3, np.nan)}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"tracks": {"tank": moving(9.0, 1.0, type="TANK")}}, "unknown 'TANK'"),
        ({"tracks": {"short": moving(9.0, 1.0, steps=2)}}, "has 2 steps; the scenario has 3"),
        ({"map_features": {"q": {"polyline": []}}}, "q.type: expected a text"),
        ({"map_features": {"q": strip(0, 1, polyline=np.zeros(4))}}, "needs 2 numbers a row"),
        ({"map_features": {"q": strip(0.0, 1e300)}}, "up to 1e+08"),
        ({"map_features": {"q": strip(5.0, 5.0)}},
         "lanes (1); first map_features.q: a line needs"),
        ({"dynamic_map_states": {"q": {"state": {"object_state": ["BLUE"]}}}}, "'BLUE'"),
        ({"dynamic_map_states": {"q": {"state": {"object_state": []}}}}, "lights (1); first dyna"),
        ({"dynamic_map_states": {"q": {"state": {"object_state": [None] * 3}}}}, "governs no la"),
        ({"metadata": {"ts": np.array([0.0, 1e5, 2e5])}}, "up to 100000 s apart"),
        ({"tracks": {"x": moving(9.0, 1.0, state=DOUBTED)}}, "valid and not finite"),
        ({"metadata": {"current_time_index": 9, "x": {(1, 2): 3}}},
         "current times (1); first cur"),
        ({"metadata": {"ts": None}}, "taken as 0.1 s apart"),
    ],
)  # fmt: skip
def test_an_odd_part_is_noted(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    made = description()
    for name, parts in change.items():
        made[name] |= parts
    reading = read(store(tmp_path, made))
    assert said in " ".join(reading.notes)
    assert (len(reading.scene.lanes), len(reading.scene.agents)) == (2, 2)
    made["tracks"]["ego"]["state"]["heading"] = None
    assert "ego is no ego. Not understood" in fault_of(store(tmp_path, made))
    del made["tracks"]["ego"]
    assert "unknown 'ego'; known" in fault_of(store(tmp_path, made))


# A data set of several


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two scenarios, the second in a folder of its own, and an index that nobody needs."""
    root = tmp_path / "set"
    (root / "more").mkdir(parents=True)
    for name, made in (("one", {"id": "one"}), ("more/two", {"id": "two"})):
        file = root / name
        store(root, description() | made).rename(file.with_name(f"sd_{file.name}.pkl"))
    (root / "dataset_summary.pkl").write_bytes(pickle.dumps([1]))
    return root


@pytest.mark.parametrize(("item", "said"), [(None, "two"), ("sd_one.pkl", "one")])
def test_a_scenario_is_named_by_its_file(folder: Path, item: str | None, said: str) -> None:
    assert recognise(folder) is not None
    reading = read(folder, 0, item)
    assert f"by ScenarioNet, {said}," in reading.scene.provenance
    assert reading.moment.item == f"sd_{said}.pkl"


def test_moments_are_those_of_all_scenarios(folder: Path) -> None:
    found = [(one.item, one.frame) for one in ScenarioNet().moments(folder, every_s=0.2)]
    assert found == [(f"sd_{name}.pkl", step) for name in ("two", "one") for step in (0, 2)]


def test_what_is_not_there_is_named(folder: Path) -> None:
    for item in ("sd_x.pkl", "../set/sd_one.pkl"):
        assert "item: unknown" in (told := fault_of(folder, item))
        assert "known: sd_two.pkl, sd_one.pkl" in told
