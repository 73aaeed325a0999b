"""Each recorded file, read whole: what is in it, and whether its traffic keeps to its lanes."""

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from augment.formats.readers import recognise
from augment.formats.reading import Reading
from augment.geometry.frames import difference
from augment.scene.codec import recording_to_document, scene_from_document, scene_to_document
from augment.scene.lane_graph import LaneGraph

pytestmark = pytest.mark.realdata

FILES = {
    "av2": "av2_sensor/7fab2350-7eaf-3b7e-a39d-6937a4c1bede",
    "commonroad": "commonroad/USA_Peach-4_8_T-1.xml",
    "scenarionet": "scenarionet/sd_nuscenes_mini_val_scene-0103*.pkl",
    "waymo": "waymo_motion/womd_scenario_input.tfrecord",
}


@cache
def reading(realdata: Path, name: str) -> Reading:
    (path,) = realdata.glob(FILES[name])
    reader = recognise(path)
    assert reader.name == name
    return reader.read(path, item=None, frame=None, name="recorded")


@pytest.mark.parametrize(
    ("name", "lanes", "connectors", "agents", "areas", "steps"),
    [
        *(("av2", 96, 62, 35, 22, 156), ("commonroad", 63, 18, 9, 0, 61)),
        *(("scenarionet", 46, 55, 61, 24, 81), ("waymo", 67, 45, 83, 4, 81)),
    ],
)
def test_all_that_a_file_holds_comes_in(
    realdata: Path, name: str, lanes: int, connectors: int, agents: int, areas: int, steps: int
) -> None:
    made = reading(realdata, name)
    scene, recording = made.scene, made.recording
    found = tuple(map(len, (scene.lanes, scene.connectors, scene.agents, scene.areas)))
    assert found == (lanes, connectors, agents, areas)
    assert len(recording.times_s) == steps
    assert scene_from_document(scene_to_document(scene)) == scene
    recording_to_document(recording)


@pytest.mark.parametrize("name", list(FILES))
def test_moving_vehicles_head_where_their_lane_leads(realdata: Path, name: str) -> None:
    made = reading(realdata, name)
    graph = LaneGraph(made.scene)
    aligned = []
    for track in made.recording.tracks:
        if track.type not in ("VEHICLE", "BUS"):
            continue
        for x_m, y_m, heading_rad, speed_mps in track.states[::3].tolist():
            way_id = graph.under(x_m, y_m, heading_rad) if speed_mps > 2.0 else None
            if way_id is not None:
                line = graph.lane(way_id).centerline
                turn = difference(line.heading_at(line.project(x_m, y_m).s_m), heading_rad)
                aligned.append(abs(turn) < math.radians(30.0))
    assert len(aligned) >= 15
    assert np.mean(aligned) >= 0.95
