"""Scenarios go out as ScenarioNet's dictionaries, which its receiver takes."""

import pickletools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from augment.formats.scenarionet.writer import write
from tests.formats.cells import cell, crossing
from tests.formats.sanity import check_sanity, loaded
from tests.recorded import recorded

NAME = "sd_scenario_arena_1_street--rule.pkl"


def document(**changes: Any) -> Any:
    return loaded(write([cell(**changes)]).files[NAME])


@pytest.mark.parametrize("before", [None, crossing()], ids=["street", "crossing"])
def test_the_receivers_own_checks_pass(before: Any) -> None:
    check_sanity(document(before=before))


def test_a_real_log_passes_too(realdata: Path) -> None:
    before, recording = recorded(realdata)
    check_sanity(document(before=before, recording=recording, keeps_traffic=True, added=()))


def test_the_pickle_names_nothing_that_numpy_1_lacks() -> None:
    for content in write([cell(before=crossing())]).files.values():
        names = {name for code, name, _ in pickletools.genops(content) if "GLOBAL" in code.name}
        assert names <= {"numpy.core.multiarray _reconstruct", "numpy ndarray", "numpy dtype"}


def test_a_walk_is_written_as_motion() -> None:
    state = document()["tracks"]["Agent5"]["state"]
    assert state["position"][-1, :2] == pytest.approx((70.0, 8.0 - 12.0 * 2.5 / 15.0), abs=0.1)
    moving = np.flatnonzero(np.hypot(*state["velocity"].T) > 0.0)
    assert moving[0] * 0.1 == pytest.approx(2.6, abs=0.11)  # 20 m on, at 8 m/s: 50 m away


def test_gpudrive_converters_find_road_edges_and_stop_points_of_two_numbers() -> None:
    made = document(before=crossing())
    edges = [one for one in made["map_features"].values() if one["type"] == "ROAD_EDGE_BOUNDARY"]
    assert all(edge["polyline"].shape[1] == 3 and len(edge["polyline"]) > 1 for edge in edges)
    inner = np.vstack(
        [one["polyline"] for key, one in made["map_features"].items() if "Connector" in key]
    )[:, None, :2]
    assert edges
    for edge in edges:
        assert np.linalg.norm(inner - edge["polyline"][:, :2], axis=2).min() > 0.3
    assert all(len(light["stop_point"]) == 2 for light in made["dynamic_map_states"].values())
    assert made["dynamic_map_states"]
