"""Where the rule placer puts what an intent asks for."""

import itertools
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from augment.baselines.rule_placer import Placement, place, sample_family
from augment.checks import Ground, Severity
from augment.checks.registry import check_against_intent
from augment.errors import CannotPlace
from augment.geometry.frames import difference, overlap
from augment.geometry.polyline import Polyline
from augment.scene.entities import (
    AgentType,
    Lane,
    ScenarioType,
    Scene,
    TrafficAgent,
    TrafficSide,
    apply,
    without_traffic,
)
from augment.scene.intent import (
    Body,
    Facing,
    Intent,
    LaneChoice,
    Lateral,
    LateralTarget,
    Move,
    Nearness,
    Pick,
    Relation,
    Shape,
    Side,
    Sight,
    Spot,
    VehicleRequest,
    WalkRequest,
)
from augment.scene.intent_parts import MotionWish
from augment.scene.lane_graph import LaneGraph
from augment.scene.planned_motion import MotionPreset, PlannedMotion, PointPath
from tests.fixtures.shelf import SLUGS, entry, measure_agent, shown_scene
from tests.intents import (
    LEFT_EDGE,
    PAPER,
    RIGHT_EDGE,
    cones,
    crash,
    metres,
    parked,
    spot,
    towards,
    walk,
)
from tests.recorded import recorded
from tests.scenes import curve, pedestrian, scene, vehicle


def added(shown: Scene, intent: Intent, *, seed: int = 0) -> tuple[TrafficAgent, ...]:
    modification = place(shown, intent, seed=seed).modification
    apply(shown, modification)  # raises where the ids don't fit
    return modification.added


def refusal(shown: Scene, intent: Intent) -> str:
    with pytest.raises(CannotPlace) as refused:
        place(shown, intent)
    return str(refused.value)


def three_lanes(side: TrafficSide = TrafficSide.LEFT) -> Scene:
    """Three lanes of the ego's direction, 3 m wide, the ego on the middle one."""
    names = ("Right", "Lane1", "Left")
    lanes = tuple(
        Lane(
            id=name,
            centerline=Polyline([(-50.0, d_m), (100.0, d_m)]),
            width_m=3.0,
            left_neighbor=dict(itertools.pairwise(names)).get(name),
            right_neighbor=dict(zip(names[1:], names, strict=False)).get(name),
        )
        for name, d_m in zip(names, (-3.0, 0.0, 3.0), strict=True)
    )
    return scene(lanes=lanes, areas=(), traffic_side=side)


def test_on_a_straight_lane_it_stands_exactly_where_it_was_asked_for() -> None:
    (car,) = added(scene(), parked())
    assert (car.x_m, car.y_m, car.heading_rad) == (21.4, 0.0, 0.0)
    assert (car.id, car.type, car.lane_id) == ("Agent2", AgentType.VEHICLE, "Lane1")
    assert (car.length_m, car.width_m, car.speed_mps) == (4.8, 2.0, 0.0)


def test_on_a_curve_the_distance_runs_along_the_arc() -> None:
    (car,) = added(curve(40.0), parked())
    angle = (21.4 - 10.0) / 40.0
    assert car.x_m == pytest.approx(10.0 + 40.0 * math.sin(angle), abs=0.01)
    assert car.y_m == pytest.approx(40.0 * (1.0 - math.cos(angle)), abs=0.01)
    assert car.heading_rad == pytest.approx(angle, abs=math.radians(1.0))


def test_the_papers_offset_is_drawn_from_its_range_by_the_seed() -> None:
    offsets = [added(scene(), PAPER, seed=seed)[0].y_m for seed in range(40)]
    assert len(set(offsets)) > 30
    assert 0.0 <= min(offsets) < 0.3
    assert 1.2 < max(offsets) <= 1.5
    assert all(added(scene(), PAPER, seed=seed)[0].x_m == 21.4 for seed in range(5))


def test_sides_are_the_egos_and_the_kerb_is_that_of_the_map() -> None:
    for lateral, y_m in (
        (towards(LEFT_EDGE, how=Nearness.SLIGHTLY), 0.75),
        (towards(RIGHT_EDGE, how=Nearness.SLIGHTLY), -0.75),
        (towards(RIGHT_EDGE), -0.75),
        (towards(RIGHT_EDGE, 1.3), -1.3),
        (towards(LEFT_EDGE, how=Nearness.AT_EDGE), 0.65),
        (towards(LateralTarget.KERB, how=Nearness.AT_EDGE), -0.65),
        (towards(LateralTarget.CENTRE_LINE, how=Nearness.SLIGHTLY), 0.75),
        (towards(LateralTarget.KERB, how=Nearness.HALF_OUT), -1.75),
    ):
        (car,) = added(scene(), parked(lateral=lateral))
        assert (car.x_m, car.y_m) == (21.4, y_m)


def test_where_people_drive_on_the_left_the_kerb_is_on_the_left() -> None:
    (car,) = added(
        scene(traffic_side=TrafficSide.LEFT),
        parked(lateral=towards(LateralTarget.KERB, how=Nearness.AT_EDGE)),
    )
    assert car.y_m == 0.65


def test_a_car_in_the_oncoming_lane_faces_as_its_lane_leads() -> None:
    (car,) = added(scene(), parked(50.0, lane=LaneChoice.ONCOMING, speed_mps=10.0))
    assert (car.x_m, car.y_m, car.lane_id, car.speed_mps) == (50.0, 3.5, "Lane2", 10.0)
    assert abs(car.heading_rad) == pytest.approx(math.pi, abs=1e-4)


def test_a_barrier_lies_across_where_nothing_else_is_said() -> None:
    (barrier,) = added(scene(), parked(20.0, body=Body.BARRIER))
    assert barrier.heading_rad == pytest.approx(math.pi / 2.0, abs=1e-4)


def test_a_place_that_is_taken_is_refused() -> None:
    busy = scene(agents=(vehicle("Agent2", 21.0, 0.0),))
    assert "it would stand in Agent2" in refusal(busy, parked())
    assert "in the ego" in refusal(scene(), parked(2.0))


def on_shoulder(target: LateralTarget) -> Lateral:
    return Lateral(target=target, nearness=Nearness.HALF_OUT, on_shoulder=True)


def test_what_has_no_room_on_the_map_is_refused() -> None:
    for shown, intent, reason in (
        (scene(), parked(160.0), "The lanes end 100 m ahead of the ego"),
        (scene(), parked(-60.0), "The lanes end 50 m behind the ego"),
        (scene(), parked(lane=LaneChoice.LEFT), "no lane on the left"),
        (curve(), parked(lane=LaneChoice.ONCOMING), "no oncoming lane"),
        (scene(), parked(lateral=on_shoulder(LEFT_EDGE)), "no shoulder on the left"),
        (scene(), parked(lateral=towards(LEFT_EDGE, 9.0)), "leaves the lane"),
        (three_lanes(), parked(lateral=on_shoulder(LateralTarget.KERB)), "another lane"),
        (scene(lanes=()), parked(), "stands on no lane"),
        (scene(), cones(90.0, 30, Shape.TAPER), "The lanes end"),
        (scene(), cones(20.0, 5, Shape.TAPER, spacing=metres(0.2)), "stand in each other"),
    ):
        if shown.lanes == ():
            shown = replace(shown, ego=replace(shown.ego, lane_id=None))
        assert reason in refusal(shown, intent)


def opened(intent: Intent, **parts: object) -> Intent:
    (request,) = intent.requests
    return Intent(requests=(replace(request, **parts),))  # type: ignore[arg-type]


def test_what_an_intent_leaves_open_is_never_guessed() -> None:
    for intent, what in (
        (opened(parked(), spot=Spot(lane=LaneChoice.OWN)), "the distance"),
        (opened(parked(), speed_mps=None), "whether they stand or how fast they drive"),
        (opened(parked(), count=None), "the count"),
        (walk(18.0, None), "the side that they come from"),
        (opened(cones(20.0, 5, Shape.RING), shape=None), "the shape"),
        (opened(crash(20.0, 2), count=None), "the count"),
    ):
        assert f"leaves open {what}" in refusal(scene(), intent)


def test_a_distance_from_another_object_runs_from_where_that_one_is() -> None:
    bus = VehicleRequest(spot=spot(20.0), name="bus", body=Body.BUS, count=1, speed_mps=0.0)
    walker = WalkRequest(
        spot=Spot(distance=metres(6.0), relation=Relation.AHEAD, anchor="bus"),
        start=Side.LEFT,
        count=1,
    )
    _, crossing = added(scene(), Intent(requests=(bus, walker)))
    assert crossing.x_m == 26.0


@pytest.mark.parametrize(
    ("side", "start", "end", "heading_rad"),
    [
        (Side.RIGHT, (18.0, -2.25), (18.0, 5.75), math.pi / 2),
        (Side.LEFT, (18.0, 5.75), (18.0, -2.25), -math.pi / 2),
    ],
)
def test_a_pedestrian_crosses_from_edge_to_edge(
    side: Side, start: tuple[float, float], end: tuple[float, float], heading_rad: float
) -> None:
    (walker,) = added(scene(), walk(18.0, side))
    assert walker.type is AgentType.PEDESTRIAN
    assert (walker.x_m, walker.y_m) == pytest.approx(start, abs=0.26)
    assert walker.walk_to_m == pytest.approx(end, abs=0.26)
    assert walker.heading_rad == pytest.approx(heading_rad, abs=1e-4)
    assert walker.speed_mps == pytest.approx(math.dist(start, end) / 15.0, abs=0.03)


def test_a_taper_closes_the_lane_and_a_worker_stands_behind_it() -> None:
    *line, worker = added(
        scene(), cones(20.0, 6, Shape.TAPER, spacing=metres(2.5), start=Side.LEFT, has_worker=True)
    )
    gaps = [math.dist((a.x_m, a.y_m), (b.x_m, b.y_m)) for a, b in itertools.pairwise(line)]
    assert gaps == pytest.approx([2.5] * 5, abs=0.01)
    assert (line[0].x_m, line[0].y_m, line[-1].y_m) == (20.0, 1.5, -1.5)
    assert worker.type is AgentType.PEDESTRIAN
    assert worker.walk_to_m is None
    assert 0.8 < min(math.dist((worker.x_m, worker.y_m), (c.x_m, c.y_m)) for c in line) < 4.0


def test_a_line_of_cones_follows_a_curved_boundary() -> None:
    line = added(curve(40.0), cones(20.0, 4, Shape.LINE, lateral=towards(LEFT_EDGE)))
    radii = [math.hypot(c.x_m - 10.0, c.y_m - 40.0) for c in line]
    assert radii == pytest.approx([38.5] * 4, abs=0.02)


@pytest.mark.parametrize(("count", "apart_m"), [(3, 1.5), (8, 2.5), (7, 2.0)])
def test_a_ring_stays_in_its_lane_and_closes(count: int, apart_m: float) -> None:
    ring = added(scene(), cones(25.0, count, Shape.RING, spacing=metres(apart_m)))
    assert max(abs(c.y_m) for c in ring) <= 1.75
    points = np.array([(c.x_m, c.y_m) for c in ring])
    gaps = np.hypot(*(points - np.roll(points, 1, axis=0)).T)
    assert gaps == pytest.approx(apart_m, abs=0.51)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_crashed_cars_touch_at_most_and_leave_little_room(count: int) -> None:
    cars = added(scene(), crash(25.0, count))
    boxes = [car.box for car in cars]
    assert len(cars) == count
    assert cars[0].x_m == 25.0
    for i, first in enumerate(boxes):
        assert all(overlap(first, second).depth_m == 0.0 for second in boxes[i + 1 :])
    for a, b in itertools.pairwise(cars):
        assert 3.3 < math.dist((a.x_m, a.y_m), (b.x_m, b.y_m)) < 6.0


@pytest.mark.parametrize(
    ("kind", "deed", "heading_rad", "speed_mps", "walks"),
    [
        (Sight.PARKED, {"facing": Facing.AGAINST_LANE}, math.pi, 0.0, False),
        (Sight.PARKED, {"facing": Facing.WITH_LANE, "turn_deg": 30.0}, math.pi / 6.0, 0.0, False),
        (Sight.BICYCLE, {"speed_mps": 2.0}, 0.0, 2.0, False),
        (Sight.BICYCLE, {"facing": Facing.ACROSS, "speed_mps": 1.0}, math.pi / 2.0, 1.0, False),
        (Sight.PEDESTRIAN, {"speed_mps": 2.0}, math.pi / 2.0, 2.0, True),
        (Sight.PEDESTRIAN, {"speed_mps": 0.0}, math.pi / 2.0, 0.0, False),
        (Sight.PEDESTRIAN, {"facing": Facing.WITH_LANE}, 0.0, 1.2, False),
    ],
)
def test_who_is_only_turned_or_slowed_down_stays(
    kind: Sight, deed: dict[str, Any], heading_rad: float, speed_mps: float, walks: bool
) -> None:
    rider = vehicle("Agent3", 40.0, 0.0, type=AgentType.BICYCLE, speed_mps=4.0, width_m=0.7)
    rider = replace(rider, length_m=1.8)
    walker = pedestrian("Agent4", 20.0, -4.0, (20.0, 6.0), speed_mps=1.2)
    shown = scene(agents=(vehicle("Agent2", 25.0, 0.5), rider, walker))
    (moved,) = place(shown, moves(kind, **deed)).modification.moved
    before = next(agent for agent in shown.agents if agent.id == moved.id)
    assert (moved.x_m, moved.y_m, moved.speed_mps) == (before.x_m, before.y_m, speed_mps)
    assert moved.heading_rad == pytest.approx(heading_rad, abs=1e-4)
    assert moved.walk_to_m == (before.walk_to_m if walks else None)


def test_a_motion_goes_on_as_fast_as_is_asked_for_and_a_walk_that_is_to_begin_later_stays() -> (
    None
):
    way = PointPath(points_m=((90.0, 0.0),))
    driven = vehicle("Agent2", 25.0, 0.0, speed_mps=9.0)
    driven = replace(driven, motion=PlannedMotion(path=way, speeds=((0.0, 9.0),)))
    (slower,) = place(
        scene(agents=(driven,)), moves(Sight.MOVING, speed_mps=2.0)
    ).modification.moved
    assert slower.motion == PlannedMotion(path=way)
    walker = pedestrian("Agent4", 20.0, -4.0, (20.0, 6.0), speed_mps=1.2)
    late = MotionWish(preset=MotionPreset.LATE_PEDESTRIAN)
    wish = moves(Sight.PEDESTRIAN, speed_mps=0.0, motion=late)
    (waits,) = place(scene(agents=(walker,)), wish).modification.moved
    assert waits.motion is not None
    assert waits.motion.path == PointPath(points_m=((20.0, 6.0),))


def moves(kind: Sight, **deed: Any) -> Intent:
    return Intent(moves=(Move(who=Pick(kind=kind), **deed),))


def of_type(agents: tuple[TrafficAgent, ...], kind: AgentType) -> list[TrafficAgent]:
    return [agent for agent in agents if agent.type is kind]


@cache
def placed(slug: str) -> Placement:
    """What the rule placer makes of a scenario, worked out once."""
    return place(shown_scene(slug), entry(slug).intent)


def test_every_scenario_of_the_catalogue_is_placed() -> None:
    assert [slug for slug in SLUGS if placed(slug).modification.is_empty] == []


@pytest.mark.parametrize("slug", SLUGS)
def test_the_checks_find_nothing_in_a_placement(slug: str) -> None:
    scene = shown_scene(slug)
    found = check_against_intent(Ground.of(scene), placed(slug).modification, entry(slug).intent)
    assert [one.sentence() for one in found if one.severity is not Severity.FACT] == []


@pytest.mark.parametrize("slug", SLUGS)
def test_what_is_asked_for_is_placed_beside_its_reference(slug: str) -> None:
    reference = entry(slug).reference
    placement = placed(slug)
    apply(shown_scene(slug), placement.modification)
    made = placement.modification.added
    assert [agent.type for agent in made] == [agent.type for agent in reference.added]
    for kind in {agent.type for agent in made} - {AgentType.PEDESTRIAN}:
        pairs = zip(of_type(made, kind), of_type(reference.added, kind), strict=True)
        for number, (agent, wanted) in enumerate(pairs):
            if number > 0 and entry(slug).type is ScenarioType.ACCIDENT_SITE:
                continue  # the intent leaves open where the others stand
            here, there = measure_agent(slug, agent), measure_agent(slug, wanted)
            assert here.ahead_m == pytest.approx(there.ahead_m, abs=1.5)
            assert here.left_m == pytest.approx(there.left_m, abs=1.5)


@pytest.mark.parametrize("slug", [slug for slug in SLUGS if slug.startswith("jaywalker")])
def test_walks_begin_and_end_beside_those_of_the_reference(slug: str) -> None:
    reference = entry(slug).reference
    pairs = zip(
        of_type(placed(slug).modification.added, AgentType.PEDESTRIAN),
        of_type(reference.added, AgentType.PEDESTRIAN),
        strict=True,
    )
    for walker, wanted in pairs:
        assert (walker.x_m, walker.y_m) == pytest.approx((wanted.x_m, wanted.y_m), abs=1.5)
        assert wanted.walk_to_m
        assert walker.walk_to_m == pytest.approx(wanted.walk_to_m, abs=2.0)


@pytest.mark.realdata
@pytest.mark.parametrize("frame", [0, 30, 60])
def test_the_papers_vehicle_stands_on_the_egos_lane(realdata: Path, frame: int) -> None:
    scene = without_traffic(recorded(realdata, frame)[0])
    modification = place(scene, PAPER).modification
    (car,) = modification.added
    assert apply(scene, modification).agents == (car,)
    graph = LaneGraph(scene)
    own = scene.ego.lane_id or graph.under(0.0, 0.0, 0.0)
    start_m = graph.lane(own).centerline.project(0.0, 0.0).s_m
    asked = graph.along(own, start_m, 21.4)
    seen = asked.pose.pose_to_local(car.pose)
    assert seen.x_m == pytest.approx(0.0, abs=0.01)
    assert 0.0 <= seen.y_m <= 1.5
    assert abs(difference(car.heading_rad, asked.pose.heading_rad)) < 1e-4
    assert car.lane_id == asked.lane_id


# Families: numbers drawn from the ranges of an intent, each member placed or refused


def cars(low_m: float, high_m: float) -> Intent:
    place = Spot(distance=metres(low_m, high_m), relation=Relation.AHEAD, lane=LaneChoice.OWN)
    return Intent(requests=(VehicleRequest(spot=place, speed_mps=0.0, count=1),))


def test_each_member_has_a_number_of_the_range_and_stands_where_it_says() -> None:
    members = sample_family(scene(), cars(15.0, 40.0), count=8, seed=3)
    places = []
    for member in members:
        distance = member.intent.requests[0].spot.distance
        assert not distance.is_range
        assert 15.0 <= distance.low_m <= 40.0
        findings = check_against_intent(Ground.of(scene()), member.modification, member.intent)
        assert not [one for one in findings if one.severity is Severity.WRONG]
        places.append(member.modification.added[0].x_m)
        assert places[-1] == pytest.approx(distance.low_m, abs=0.5)
    assert len(set(places)) == 8


def test_a_seed_gives_the_same_family_and_more_of_it_begin_alike() -> None:
    few, many = (sample_family(scene(), cars(15.0, 40.0), count=n, seed=3) for n in (3, 6))
    assert many[:3] == few
    assert sample_family(scene(), cars(15.0, 40.0), count=3, seed=4) != few


def test_a_member_that_fits_nowhere_says_why() -> None:
    members = sample_family(scene(), cars(60.0, 200.0), count=12)  # the lane ends at 100 m
    refused = [member for member in members if member.modification is None]
    assert 0 < len(refused) < 12
    assert all(member.refusal for member in refused)


def test_an_intent_without_a_range_has_no_family() -> None:
    with pytest.raises(CannotPlace, match="range"):
        sample_family(scene(), cars(20.0, 20.0), count=2)
