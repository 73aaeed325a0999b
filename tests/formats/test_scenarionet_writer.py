"""Scenarios go out as ScenarioNet's dictionaries, which its receiver takes."""

from __future__ import annotations

import pickletools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from augment.formats.scenarionet.writer import MAPPING_FILE, SUMMARY_FILE, write
from augment.scene.entities import AgentType
from augment.scene.lane_graph import AnyLane, LaneGraph
from tests.formats.cells import OF_EACH_TYPE, cell, crossing, recorded_street
from tests.formats.sanity import check_sanity, loaded
from tests.recorded import recorded

NAME = "sd_scenario_arena_1_street--rule.pkl"


def document(**changes: Any) -> Any:
    return loaded(write([cell(**changes)]).files[NAME])


@pytest.mark.parametrize("before", [None, crossing()], ids=["street", "crossing"])
def test_the_receivers_own_checks_pass(before: Any) -> None:
    check_sanity(document(before=before))


def test_the_checks_pass_for_agents_that_come_and_go() -> None:
    before, recording = recorded_street()
    check_sanity(
        document(before=before, recording=recording, keeps_traffic=True, added=OF_EACH_TYPE)
    )


def test_a_real_log_passes_too(realdata: Path) -> None:
    before, recording = recorded(realdata)
    check_sanity(document(before=before, recording=recording, keeps_traffic=True, added=()))


def test_the_pickle_names_nothing_that_numpy_1_lacks() -> None:
    for content in write([cell(before=crossing())]).files.values():
        names = {name for code, name, _ in pickletools.genops(content) if "GLOBAL" in code.name}
        assert names <= {"numpy.core.multiarray _reconstruct", "numpy ndarray", "numpy dtype"}


def test_the_same_cells_give_the_same_bytes() -> None:
    assert write([cell()]).files == write([cell()]).files


def test_places_headings_sizes_and_speeds_are_kept() -> None:
    given = cell(before=crossing())
    made = document(before=crossing())
    for agent in given.after.everyone:
        state = made["tracks"][agent.id]["state"]
        assert state["valid"][0]
        assert state["position"][0, :2] == pytest.approx((agent.x_m, agent.y_m), abs=1e-9)
        assert state["heading"][0] == pytest.approx(agent.heading_rad, abs=1e-9)
        assert (state["length"][0], state["width"][0]) == (agent.length_m, agent.width_m)
        assert np.hypot(*state["velocity"][0]) == pytest.approx(agent.speed_mps)
    assert made["metadata"]["sdc_id"] == "Agent1"


def test_lanes_links_limits_and_lights_are_kept() -> None:
    given, made = cell(before=crossing()).after, document(before=crossing())
    graph, features = LaneGraph(given), made["map_features"]
    ways: list[AnyLane] = [*given.lanes, *given.connectors]
    for way in ways:
        feature = features[way.id]
        assert np.allclose(feature["polyline"][:, :2], way.centerline.points_m)
        assert set(feature["exit_lanes"]) == set(graph.successors(way.id))
        assert set(feature["entry_lanes"]) == set(graph.predecessors(way.id))
        limit = feature.get("speed_limit_kmh")
        assert limit == (None if way.speed_limit_mps is None else way.speed_limit_mps * 3.6)
    lights = {
        light["lane"]: set(light["state"]["object_state"])
        for light in made["dynamic_map_states"].values()
    }
    assert lights == {
        "Connector1": {"TRAFFIC_LIGHT_GREEN"},
        "Connector2": {"TRAFFIC_LIGHT_RED"},
    }
    assert features["Area1"]["type"] == "CROSSWALK"
    assert features["Area3"]["type"] == "ROAD_EDGE_SIDEWALK"


def test_recorded_motion_is_written_for_as_long_as_it_was_seen() -> None:
    before, recording = recorded_street()
    made = document(before=before, recording=recording, keeps_traffic=True, added=())
    gone, late = made["tracks"]["Agent2"]["state"], made["tracks"]["Agent3"]["state"]
    assert gone["valid"].tolist() == [True] * 20 + [False] * 11
    assert gone["position"][19, 0] == pytest.approx(20.0 + 10.0 * 1.9)
    assert late["valid"].tolist() == [False] * 10 + [True] * 21
    assert made["tracks"]["Agent1"]["state"]["position"][30, 0] == pytest.approx(24.0)


def test_a_walk_is_written_as_motion() -> None:
    state = document()["tracks"]["Agent5"]["state"]
    assert state["position"][-1, :2] == pytest.approx((70.0, 8.0 - 12.0 * 2.5 / 15.0), abs=0.1)
    moving = np.flatnonzero(np.hypot(*state["velocity"].T) > 0.0)
    assert moving[0] * 0.1 == pytest.approx(2.6, abs=0.11)  # 20 m on, at 8 m/s: 50 m away


def test_what_is_lost_has_a_line() -> None:
    lines = [str(loss) for loss in write([cell(before=crossing(), added=OF_EACH_TYPE)]).losses]
    for words in (
        "Area2: left out: there is no type for a carpark area",
        "drive on the left",
        f"a {AgentType.BUS} becomes a VEHICLE",
        f"a {AgentType.CONSTRUCTION_SIGN} becomes a TRAFFIC_OBJECT",
        "the ego was not recorded",
        "origin",
    ):
        assert any(words in line for line in lines), (words, lines)


def test_the_folder_has_its_two_index_files() -> None:
    files = write([cell()]).files
    assert set(loaded(files[SUMMARY_FILE])) == set(loaded(files[MAPPING_FILE])) == {NAME}
