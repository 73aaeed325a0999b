from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from augment.fake_llm.requests import SpokenMessage
from augment.fake_llm.sight import smooth, task_of
from augment.geometry.polyline import Polyline
from augment.prompts.fill import modifier_messages
from augment.scene.entities import Lane, Scene, TrafficSide
from tests.scenes import cone, junction, scene, vehicle

WISH = "Add a parked car 17 m ahead.\nIt stands 0.4 m left of the centre."


def messages(shown: Scene, wish: str = WISH) -> list[SpokenMessage]:
    return [
        SpokenMessage.model_validate(message.to_document())
        for message in modifier_messages(shown, wish)
    ]


def test_the_scene_and_the_wish_are_read_back() -> None:
    shown = replace(
        junction(),
        agents=(vehicle("Agent2", 12.0, 0.0, 0.1), cone("Agent6", 30.0, 2.0)),
        traffic_side=TrafficSide.LEFT,
        areas=scene().areas,
    )
    task = task_of(messages(shown))
    assert (task.instruction, task.first_new) == (WISH, 7)
    assert task.scene.traffic_side is TrafficSide.LEFT
    assert [a.id for a in task.scene.agents] == ["Agent2", "Agent6"]
    assert task.scene.agents[0] == shown.agents[0]
    assert task.scene.ego.lane_id == "Lane1"
    assert [(w.id, w.from_lane, w.to_lane, w.turn_type) for w in task.scene.connectors] == [
        (w.id, w.from_lane, w.to_lane, w.turn_type) for w in shown.connectors
    ]
    assert [w.width_m for w in task.scene.connectors] == [3.5, 3.5]
    assert [(a.id, a.kind) for a in task.scene.areas] == [(a.id, a.kind) for a in shown.areas]


def test_a_conversation_with_a_second_question_holds_the_same_task() -> None:
    first = messages(scene())
    later = [
        *first,
        SpokenMessage(role="assistant", content="There."),
        SpokenMessage(role="user", content="Your answer could not be read: ..."),
    ]
    assert task_of(later) == task_of(first)


@pytest.mark.parametrize("radius_m", [8.0, 15.0, 40.0])
def test_points_five_metres_apart_give_the_curve_back(radius_m: float) -> None:
    angles = np.linspace(0.0, math.pi / 2.0, 400)
    bend = Polyline(radius_m * np.column_stack([np.sin(angles), 1.0 - np.cos(angles)]))
    seen = smooth(np.round(bend.resampled(5.0).points_m, 2))
    assert seen.length_m == pytest.approx(bend.length_m, abs=0.15)
    for share in (0.1, 0.35, 0.6, 0.9):
        wanted, got = (line.pose_at(share * line.length_m) for line in (bend, seen))
        assert math.hypot(got.x_m - wanted.x_m, got.y_m - wanted.y_m) < 0.15
        assert got.heading_rad == pytest.approx(wanted.heading_rad, abs=math.radians(4.0))


def test_neighbours_are_seen_where_lanes_run_side_by_side() -> None:
    left = Lane(id="Lane3", centerline=Polyline([(-40, 3.5), (90, 3.5)]), width_m=3.5)
    right = Lane(id="Lane4", centerline=Polyline([(-60, -3.4), (70, -3.4)]), width_m=3.3)
    shown = scene(lanes=(scene().lanes[0], left, right))
    lanes = {lane.id: lane for lane in task_of(messages(shown)).scene.lanes}
    assert (lanes["Lane1"].left_neighbor, lanes["Lane1"].right_neighbor) == ("Lane3", "Lane4")
    assert (lanes["Lane3"].left_neighbor, lanes["Lane3"].right_neighbor) == (None, "Lane1")
    assert (lanes["Lane4"].left_neighbor, lanes["Lane4"].right_neighbor) == ("Lane1", None)


def test_a_lane_goes_on_in_the_one_that_begins_where_it_ends() -> None:
    first = Lane(id="Lane1", centerline=Polyline([(-40, 0), (10.004, 0.5)]), width_m=3.5)
    second = Lane(id="Lane2", centerline=Polyline([(10.004, 0.5), (70, 3)]), width_m=3.5)
    lanes = task_of(messages(scene(lanes=(second, first)))).scene.lanes
    assert [(lane.id, lane.successors) for lane in lanes] == [("Lane2", ()), ("Lane1", ("Lane2",))]
