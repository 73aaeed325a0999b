"""What of a scene a prompt shows: by the rule, and no less than a wish needs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from augment.geometry.polyline import Polyline
from augment.prompts.extent import BESIDE_M, extent_of, shown_spans
from augment.prompts.vectors import DEFAULT_RADIUS_M, scene_vectors
from augment.scene.entities import Lane, LaneConnector, TurnType
from augment.variants.pose_tool import PoseTool
from tests.fixtures.shelf import HARD_SLUGS, SLUGS, entry, whole_scene
from tests.scenes import junction, scene, vehicle


def lane(name: str, *points: tuple[float, float]) -> Lane:
    return Lane(id=name, centerline=Polyline(points), width_m=3.5)


@pytest.mark.parametrize(
    ("y_m", "is_shown"),
    [(BESIDE_M - 0.1, True), (BESIDE_M + 0.1, False), (-BESIDE_M - 0.1, False)],
)
def test_what_runs_too_far_beside_the_ego_is_left_out(y_m: float, is_shown: bool) -> None:
    street = scene(
        lanes=(*scene().lanes, lane("Lane3", (-50.0, y_m), (100.0, y_m))),
        agents=(vehicle("Agent2", 20.0, y_m),),
    )
    assert ("Lane3" in shown_spans(street, 80.0)) is is_shown
    assert ("Agent2" in scene_vectors(street, 80.0)["Agents"]) is is_shown
    assert ("Lane3" in PoseTool(street).curves) is is_shown


def test_a_crossing_street_is_cut_where_the_wish_ends_and_goes_far_ahead() -> None:
    crossing = lane("Lane3", (40.0, -70.0), (40.0, 70.0))
    street = scene(lanes=(*scene().lanes, crossing, lane("Lane4", (-60.0, -9.0), (-60.0, 9.0))))
    spans = shown_spans(street, 80.0)
    assert spans["Lane3"] == pytest.approx((70.0 - BESIDE_M, 70.0 + BESIDE_M), abs=0.5)
    assert "Lane4" not in spans


def test_where_the_ego_can_turn_off_is_shown_as_far_as_it_can_drive() -> None:
    spans = shown_spans(junction(), 80.0)
    start_m, end_m = spans["Lane3"]
    assert start_m == 0.0
    assert end_m == pytest.approx(52.0, abs=0.5)


def test_a_turning_lane_beside_the_ego_leads_on_too() -> None:
    ahead = replace(lane("Lane1", (-50.0, 0.0), (20.0, 0.0)), left_neighbor="Lane2")
    beside = lane("Lane2", (-50.0, 3.5), (20.0, 3.5))
    leads = LaneConnector(
        id="Connector1",
        from_lane="Lane2",
        to_lane="Lane3",
        centerline=Polyline([(20.0, 3.5), (28.0, 11.5)]),
        width_m=3.5,
        turn_type=TurnType.LEFT,
    )
    away = lane("Lane3", (28.0, 11.5), (28.0, 70.0))
    street = scene(lanes=(ahead, beside, away), connectors=(leads,), areas=())
    assert shown_spans(street, 80.0)["Lane3"][1] > 50.0


def test_of_connectors_that_lead_the_same_way_one_is_shown() -> None:
    cross = junction()
    first = cross.connectors[0]
    twin = replace(first, id="Connector3", centerline=Polyline([(20.0, 0.4), (36.0, 0.4)]))
    other = replace(first, id="Connector4", centerline=Polyline([(20.0, 0.6), (36.0, 0.6)]))
    spans = shown_spans(replace(cross, connectors=(*cross.connectors, twin, other)), 80.0)
    assert "Connector3" not in spans
    assert "Connector4" in spans


@pytest.mark.parametrize("slug", [*SLUGS, *HARD_SLUGS])
def test_every_place_of_a_reference_is_shown_with_its_lane(slug: str) -> None:
    base, reference = whole_scene(entry(slug).scene), entry(slug).reference
    assert reference is not None
    extent, spans = extent_of(base, DEFAULT_RADIUS_M), shown_spans(base, DEFAULT_RADIUS_M)
    for agent in reference.changed:
        ends = [(agent.x_m, agent.y_m), *([agent.walk_to_m] if agent.walk_to_m else [])]
        assert extent.holds(np.array(ends)).all()
        assert agent.lane_id is None or agent.lane_id in spans


@pytest.mark.parametrize(("y_m", "is_shown"), [(4.9, True), (5.1, False)])
def test_a_connector_that_no_way_of_the_ego_meets_is_left_out(y_m: float, is_shown: bool) -> None:
    """The ego's own way ends before the intersection, its lane leads nowhere."""
    street = scene(lanes=(lane("Lane1", (-50.0, 0.0), (60.0, 0.0)),), areas=())
    beside = LaneConnector(
        id="Connector1",
        from_lane=None,
        to_lane=None,
        centerline=Polyline([(20.0, y_m), (35.0, y_m + 10.0)]),
        width_m=3.5,
        turn_type=TurnType.STRAIGHT,
    )
    crossing = replace(street, connectors=(beside,))
    assert ("Connector1" in shown_spans(crossing, 80.0)) is is_shown
