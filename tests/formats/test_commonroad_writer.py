"""Scenarios go out as CommonRoad XML, which commonroad-io loads and its schema allows."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from augment.formats.commonroad.writer import write
from augment.geometry.polyline import Polyline
from tests.formats.cells import OF_EACH_TYPE, cell, crossing, moving, recorded_street
from tests.formats.receivers import told_by
from tests.recorded import recorded

NAME = "street--rule.xml"


def test_commonroad_io_loads_what_its_schema_allows(realdata: Path, tmp_path: Path) -> None:
    log, seen = recorded(realdata)
    before, recording = recorded_street()
    cells = {
        "street": cell(),
        "crossing": cell(crossing(), added=OF_EACH_TYPE),
        "recorded": cell(before, recording=recording, keeps_traffic=True, added=()),
        "moving": replace(moving(), stem="street--rule"),
        "log": cell(log, recording=seen, keeps_traffic=True, added=()),
    }
    files = []
    for name, given in cells.items():
        files.append(tmp_path / f"{name}.xml")
        files[-1].write_bytes(write([given]).files[NAME])
    told = dict(zip(cells, told_by(*files), strict=True))
    assert {name: one["faults"] for name, one in told.items()} == {key: [] for key in cells}
    check_street(told["street"])
    check_crossing(told["crossing"])
    assert [one["last"] for one in told["recorded"]["dynamic"]] == [19]
    check_moving(told["moving"])
    assert len(told["log"]["lanelets"]) >= len(log.lanes) + len(log.connectors)


def check_street(told: dict[str, Any]) -> None:
    assert [one["type"] for one in told["static"]] == ["parkedVehicle"] + ["constructionZone"] * 2
    parked = told["static"][0]
    assert [*parked["position"], parked["orientation"]] == pytest.approx([30.25, 0.5, 0.1])
    assert parked["size"] == [4.8, 2.0]
    assert [one["type"] for one in told["dynamic"]] == ["pedestrian"]
    assert told["limits"] == [13.9]
    assert told["starts"] == [[0.0, 0.0, 8.0]]


def check_crossing(told: dict[str, Any]) -> None:
    """Lanes are 1 to 3, connectors 4 and 5."""
    lanelets = told["lanelets"]
    assert lanelets["1"]["successor"] == [4, 5]
    assert lanelets["4"]["successor"] == [2]
    line = Polyline(lanelets["5"]["center"])
    for x_m, y_m in crossing().connectors[1].centerline.points_m:
        assert line.project(x_m, y_m).distance_m < 0.01
    assert sorted(told["lights"]) == ["green", "red"]
    assert told["turns"] == [[[5], [4]]]


def check_moving(told: dict[str, Any]) -> None:
    """All of them move as `find_motion` says, step by step; the door is of unknown type."""
    kinds = ["car"] * 3 + ["pedestrian", "unknown"]
    assert sorted(one["type"] for one in told["dynamic"]) == kinds
    ours = {tuple(one.states[0, :2]): one.states for one in moving().motion.others}
    for one in told["dynamic"]:
        states = ours[tuple(one["position"])]
        rows = np.array(one["states"])
        assert rows[:, 1:] == pytest.approx(states[rows[:, 0].astype(int)], abs=1e-6)
        assert len(rows) == np.isfinite(states[:, 0]).sum() - 1


def test_a_scene_without_lanes_is_refused_and_the_others_are_written() -> None:
    ego = replace(crossing().ego, lane_id=None)
    scene = replace(crossing(), ego=ego, lanes=(), connectors=())
    bare = cell(scene, stem="bare", name="bare by rule", added=())
    made = write([bare, cell()])
    assert set(made.files) == {NAME}
    assert [str(one) for one in made.refused] == [
        "bare by rule: CommonRoad needs at least one lane, and this scene has none"
    ]
