"""What of a scene a prompt shows: by the rule, and no less than a wish needs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from augment.geometry.polyline import Polyline
from augment.prompts.extent import BESIDE_M, extent_of, shown_spans
from augment.prompts.fill import input_format
from augment.prompts.names import short_names
from augment.prompts.vectors import DEFAULT_RADIUS_M, LaneFormat, agent_vectors, scene_text
from augment.scene.entities import Lane, LaneConnector, TurnType
from augment.variants.pose_tool import PoseTool
from tests.fixtures.shelf import HARD_SLUGS, SLUGS, entry, whole_scene
from tests.scenes import junction, scene, vehicle
from tests.variants.pose_accuracy import recorded_scenes


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
    assert ("Agent2" in agent_vectors(street, short_names(street), 80.0)) is is_shown
    assert ("Lane3" in PoseTool(street).curves) is is_shown


def test_a_crossing_street_is_cut_where_the_wish_ends_and_goes_far_ahead() -> None:
    crossing = lane("Lane3", (40.0, -70.0), (40.0, 70.0))
    street = scene(lanes=(*scene().lanes, crossing, lane("Lane4", (-60.0, -9.0), (-60.0, 9.0))))
    spans = shown_spans(street, 80.0)
    assert spans["Lane3"] == pytest.approx((70.0 - BESIDE_M, 70.0 + BESIDE_M), abs=0.5)
    assert "Lane4" not in spans


def test_a_larger_radius_shows_what_lies_further_down_the_ego_s_way() -> None:
    long = scene(lanes=(lane("Lane1", (-50.0, 0.0), (300.0, 0.0)),), areas=())
    ahead = scene(lanes=long.lanes, areas=(), agents=(vehicle("Agent2", 140.0, 0.0),))
    ends = [shown_spans(long, radius)["Lane1"][1] - 50.0 for radius in (60.0, 80.0, 160.0)]
    assert ends == pytest.approx([60.0, 80.0, 160.0], abs=0.5)
    assert "Agent2" in agent_vectors(ahead, short_names(ahead), 160.0)


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


def test_without_a_lane_of_the_ego_the_radius_alone_counts() -> None:
    lost = scene(ego=replace(scene().ego, lane_id=None), lanes=(lane("Lane1", (-9, 50), (9, 50)),))
    assert list(shown_spans(lost, 80.0)) == ["Lane1"]


@pytest.mark.parametrize("slug", [*SLUGS, *HARD_SLUGS])
def test_every_place_of_a_reference_is_shown_with_its_lane(slug: str) -> None:
    base, reference = whole_scene(entry(slug).scene), entry(slug).reference
    assert reference is not None
    extent, spans = extent_of(base, DEFAULT_RADIUS_M), shown_spans(base, DEFAULT_RADIUS_M)
    for agent in reference.changed:
        ends = [(agent.x_m, agent.y_m), *([agent.walk_to_m] if agent.walk_to_m else [])]
        assert extent.holds(np.array(ends)).all()
        assert agent.lane_id is None or agent.lane_id in spans


BEFORE = {
    LaneFormat.POLYLINE: {
        "av2": 18_819, "commonroad": 12_224, "scenarionet": 14_471,
    },
    LaneFormat.BEZIER: {
        "av2": 19_000, "commonroad": 10_631, "scenarionet": 14_719,
    },
}  # fmt: skip
"""Characters of the lists when all within the radius was shown, and curves kept to 0.3 m.

Not of Waymo's scene: its intersections were read as plain lanes then, which are shorter to list.
"""


@pytest.mark.realdata
@pytest.mark.parametrize("lanes", list(LaneFormat))
def test_the_lists_of_recorded_scenes_are_nearly_half_as_long(
    realdata: Path, lanes: LaneFormat
) -> None:
    """What the tokens of whole prompts follow from, of which 30 % had to go: see benchmarks."""
    now = {base.name: len(scene_text(base, lanes=lanes)) for base in recorded_scenes(realdata)}
    assert all(now[name] < 0.56 * before for name, before in BEFORE[lanes].items())


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


@pytest.mark.parametrize(("length_m", "is_shown"), [(4.0, True), (30.0, False)])
def test_less_than_5_m_of_a_lane_are_shown_where_they_are_all_of_it(
    length_m: float, is_shown: bool
) -> None:
    stub = lane("Lane3", (40.0, 11.0), (40.0, 11.0 + length_m))
    street = scene(lanes=(*scene().lanes, stub))
    assert ("Lane3" in shown_spans(street, 80.0)) is is_shown


def test_behind_the_ego_half_of_the_radius_counts() -> None:
    back = lane("Lane2", (11.0, 3.5), (-70.0, 3.5))
    ahead = replace(lane("Lane1", (-50.0, 0.0), (10.0, 0.0)), successors=("Lane3",))
    turn = replace(lane("Lane3", (10.0, 0.0), (11.0, 3.5)), successors=("Lane2",))
    spans = shown_spans(scene(lanes=(ahead, turn, back), areas=()), 80.0)
    assert 11.0 - spans["Lane2"][1] == pytest.approx(-40.0, abs=0.5)


@pytest.mark.parametrize("radius_m", [60.0, 80.0])
def test_the_prompt_says_what_is_listed_by_the_radius_that_was_chosen(radius_m: float) -> None:
    told = input_format(radius_m)
    assert f"within {radius_m:g} m of the ego ({radius_m / 2:g} m behind it) and 15 m of" in told
    assert "connectors within 5 m" in told
