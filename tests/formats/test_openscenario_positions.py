"""Positions of OpenSCENARIO are where formulas have them."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from augment.formats.opendrive.network import START
from augment.formats.openscenario.positions import find_legs
from augment.formats.reading import Reading
from tests.formats.opendrive_maps import LANES, ROAD, WIDTH, by_hand
from tests.formats.openscenario_files import (
    EGO_AT,
    TIMING,
    event,
    follow,
    fork,
    on_route,
    read,
    scenario,
    vertices,
    write,
)


def pose_of_other(reading: Reading) -> list[float]:
    """Where the other's point of reference is in the map's frame; its middle is 1.4 m ahead."""
    (other,) = reading.scene.agents
    origin = reading.scene.origin.pose
    ((x_m, y_m),) = origin.to_parent(np.array([[other.x_m, other.y_m]])).tolist()
    heading_rad = other.heading_rad + origin.heading_rad
    return [x_m - 1.4 * math.cos(heading_rad), y_m - 1.4 * math.sin(heading_rad), heading_rad]


@pytest.mark.parametrize(
    ("position", "expected"),
    [
        ('<WorldPosition x="50" y="1" h="0.5"/>', (50.0, 1.0, 0.5)),
        ('<LanePosition roadId="1" laneId="-2" s="50" offset="0.5"/>', (50.0, -4.75, 0.0)),
        ('<LanePosition roadId="1" laneId="1" s="50"/>', (50.0, 1.75, math.pi)),
        ('<LanePosition roadId="1" laneId="-1" s="50"><Orientation type="relative" h="0.1"/>'
         "</LanePosition>", (50.0, -1.75, 0.1)),
        ('<LanePosition roadId="1" laneId="1" s="50"><Orientation type="absolute" h="0.1"/>'
         "</LanePosition>", (50.0, 1.75, 0.1)),
        ('<RoadPosition roadId="1" s="60" t="-3"/>', (60.0, -3.0, 0.0)),
        ('<RelativeLanePosition entityRef="Ego" dLane="-1" ds="15"/>', (35.0, -5.25, 0.0)),
        ('<RelativeLanePosition entityRef="Ego" dLane="1" dsLane="15" offset="0.2"/>',
         (35.0, 1.95, math.pi)),
        ('<RelativeRoadPosition entityRef="Ego" ds="10" dt="-2"/>', (30.0, -3.75, 0.0)),
        ('<RelativeObjectPosition entityRef="Ego" dx="10" dy="3"/>', (30.0, 1.25, 0.0)),
        ('<RelativeWorldPosition entityRef="Ego" dx="-5" dy="1"/>', (15.0, -0.75, 0.0)),
        # From s = 80 on lane 1, which leads back, and from s = 30 on lane -1.
        (on_route('<FromLaneCoordinates pathS="30" laneId="1" laneOffset="1"/>', (1, 80), (1, 9)),
         (50.0, 2.75, math.pi)),
        (on_route('<FromRoadCoordinates pathS="30" t="-2"/>', (-1, 30), (-1, 90)),
         (60.0, -2.0, 0.0)),
        (on_route('<FromCurrentEntity entityRef="Ego"/>', (-1, 30), (-1, 90)), (20.0, -1.75, 0.0)),
    ],
)  # fmt: skip
def test_a_position_is_where_a_formula_has_it(
    position: str, expected: tuple[float, ...], tmp_path: Path
) -> None:
    reading = read(write(tmp_path, scenario(other_at=position)))
    assert pose_of_other(reading) == pytest.approx(expected, abs=2e-3)
    assert reading.scene.agents[0].size_m == (5.0, 2.0)
    assert reading.scene.ego.speed_mps == 10.0


def test_world_positions_of_carlas_own_frame_are_mirrored(tmp_path: Path) -> None:
    text = scenario(other_at='<WorldPosition x="50" y="1.75" h="0.5"/>')
    text = text.replace("<FileHeader", '<FileHeader description="CARLA:Crossing"')
    reading = read(write(tmp_path, text.replace('y="-1.75"', 'y="1.75"')))
    assert pose_of_other(reading) == pytest.approx([50.0, -1.75, -0.5], abs=2e-3)
    assert any("World positions are CARLA's" in note for note in reading.notes)


def test_a_vertex_of_carlas_own_frame_heads_along_the_way(tmp_path: Path) -> None:
    line = vertices((0, 60), y=1.75) + vertices((5, 60), y=-38.25)
    text = scenario(event(follow(line.replace(' h="0"', ""), TIMING.format("relative"))))
    text = text.replace("<FileHeader", '<FileHeader description="CARLA:Crossing"')
    recording = read(write(tmp_path, text)).recording
    assert recording.tracks[0].states[-1, 2] == pytest.approx(math.pi / 2.0, abs=2e-3)


def test_the_shortest_way_is_taken_not_the_one_of_fewest_roads() -> None:
    lengths_m = {"a": 100.0, "long": 900.0, "b": 10.0, "c": 10.0, "d": 50.0, "goal": 50.0}
    exits = {"a": ["long", "b", "missing"], "long": ["d"], "b": ["c"], "c": ["d"], "d": ["goal"]}
    roads: dict[str, Any] = {
        name: SimpleNamespace(
            id=name, line=SimpleNamespace(length_m=length_m), is_forward=lambda _: True
        )
        for name, length_m in lengths_m.items()
    }
    network: Any = SimpleNamespace(
        elements=roads,
        road=lambda name, _: roads[name],
        list_exits=lambda road, _: [(name, START) for name in exits.get(road.id, ())],
    )
    legs = find_legs(network, [(roads["a"], 20.0, 0.0, -1), (roads["goal"], 5.0, 0.0, -1)], "way")
    assert [leg.road.id for leg in legs] == ["a", "b", "c", "d", "goal"]
    assert sum(leg.to_m - leg.from_m for leg in legs) == 155.0


JOINED = '<link><{} elementType="road" elementId="{}" contactPoint="{}"/></link>'
LINKED = f'<link><predecessor id="{{0}}"/><successor id="{{0}}"/></link>{WIDTH}'


def second_road(contact: str, hdg: str, x: str, lane: str) -> str:
    """Two roads of 100 m, the second met at one of its ends."""
    parts = {"id": "2", "junction": "-1", "x": x, "shape": "<line/>", "more": "", "type": ""}
    lanes = LANES.format(width=LINKED.format(lane), outer="")
    end = "predecessor" if contact == "start" else "successor"
    link = JOINED.format(end, "1", "end")
    second = ROAD.format(**parts, offset="", end="", lanes=lanes, link=link)
    first = JOINED.format("successor", "2", contact)
    turned = second.replace('hdg="0"', f'hdg="{hdg}"')
    return by_hand(width=LINKED.format(lane), link=first, rest=turned)


def renumbered() -> str:
    """A road of 100 m on which a lane begins at 50 m beside the middle, 2 m wide."""
    link = f'<link><successor id="-2"/></link>{WIDTH}'
    first = f'<right><lane id="-1" type="driving">{link}</lane></right>'
    begins = f'<lane id="-1" type="driving">{WIDTH.replace("3.5", "2")}</lane>'
    second = f'<right>{begins}<lane id="-2" type="driving">{WIDTH}</lane></right>'
    return by_hand(lanes=f'<laneSection s="0">{first}</laneSection>'
                         f'<laneSection s="50">{second}</laneSection>')  # fmt: skip


@pytest.mark.parametrize(
    ("roads", "position", "expected"),
    [
        (second_road("start", "0", "100", "-1"),
         '<RelativeLanePosition entityRef="Ego" dLane="0" ds="95"/>', (115.0, -1.75, 0.0)),
        (second_road("end", "3.14159265", "200", "1"),
         '<RelativeLanePosition entityRef="Ego" dLane="0" dsLane="95"/>', (115.0, -1.75, 0.0)),
        (second_road("end", "3.14159265", "200", "1"),
         '<RelativeRoadPosition entityRef="Ego" ds="95" dt="1"/>', (115.0, -0.75, 0.0)),
        (renumbered(), '<RelativeLanePosition entityRef="Ego" dLane="0" ds="60"/>',
         (80.0, -3.75, 0.0)),
        # 40 m along the lane, which lies 1.75 m outside of a circle of 50 m.
        (by_hand(shape='<arc curvature="0.02"/>'),
         '<RelativeLanePosition entityRef="Ego" dLane="0" dsLane="40"/>',
         (51.75 * math.sin(0.4 + 40 / 51.75), 50.0 - 51.75 * math.cos(0.4 + 40 / 51.75),
          0.4 + 40 / 51.75)),
        (by_hand(more='rule="LHT"'), '<RoadPosition roadId="1" s="60" t="-3"/>',
         (60.0, -3.0, 0.0)),
    ],
)  # fmt: skip
def test_a_position_is_counted_along_its_roads(
    roads: str, position: str, expected: tuple[float, ...], tmp_path: Path
) -> None:
    text = scenario(other_at=position)
    if "arc" in roads:
        text = text.replace(EGO_AT, '<LanePosition roadId="1" laneId="-1" s="20"/>')
    file = write(tmp_path, text, **{"roads.xodr": roads})
    assert pose_of_other(read(file)) == pytest.approx(expected, abs=2e-3)


def test_a_place_on_a_route_lies_past_a_junction(tmp_path: Path) -> None:
    inside = '<FromLaneCoordinates pathS="130" laneId="-1"/>'
    at = on_route(inside, (-1, 20), (-1, 80), roads="14")
    reading = read(write(tmp_path, scenario(other_at=at), **{"roads.xodr": fork()}))
    # 80 m to the end of road 1, and 50 m on round (100, 100), 1.75 m outside of the line.
    x_m, y_m = 100.0 + 101.75 * math.sin(0.5), 100.0 - 101.75 * math.cos(0.5)
    assert pose_of_other(reading) == pytest.approx([x_m, y_m, 0.5], abs=2e-3)
