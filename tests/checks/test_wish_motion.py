"""Answers of a strong model to six moving scenarios, and careless ones, against their wishes.

Of each answer the numbers of its block alone; on the scenes, sentences and intents of the moving
set. Careless answers copy the example values of the prompt's rules.
"""

import math
from dataclasses import replace
from typing import Any

import pytest

from augment.baselines.rule_placer import place
from augment.checks import FindingKind, Ground, Severity
from augment.checks.registry import check_against_intent
from augment.checks.wish import measure_wish
from augment.metrics.displacement import displacement
from augment.scene.codec import intent_from_parts
from augment.scene.entities import (
    AgentType,
    InterplanRules,
    Modification,
    SceneOptions,
    TrafficAgent,
)
from augment.scene.intent import Intent, VehicleRequest
from augment.scene.intent_parts import Amount, MotionWish, StartWish
from augment.scene.planned_motion import (
    AtTime,
    LanePath,
    MotionPreset,
    NearEgo,
    PlannedMotion,
    PointPath,
)
from augment.simulation.expected import expect_recording
from tests.checks.worlds import faults_against
from tests.fixtures.shelf import ROUNDED_M, entry, shown_scene, whole_scene
from tests.scenes import vehicle

CUT_IN, BRAKING = "cut-in-boulevard-north", "hard-braking-mill-junction"
U_TURN, DOOR, CHILD = "u-turn-quarry-narrows", "door-lime-street", "late-pedestrian-lime-street"
BUS, TURN = "red-light-brewery-crossing", "emergency-stop-theatre-crossing"

ROUND = ((2.55, -0.68), (4.42, -2.55), (5.1, -5.1), (4.42, -7.65), (2.55, -9.52), (0.0, -10.2))
"""Half a circle, from where it begins."""
BACK = ((30.0, -10.2), (-30.0, -10.2))


def agent(x_m: float, y_m: float, heading_rad: float = 0.0, **parts: Any) -> TrafficAgent:
    motion = {name: parts.pop(name) for name in ("path", "speeds", "start") if name in parts}
    parts["motion"] = PlannedMotion(**motion) if motion else None
    return vehicle("New1", x_m, y_m, heading_rad, **parts)


def cutting_in(change_m: float, *speeds: tuple[float, float]) -> TrafficAgent:
    path = LanePath(lane_ids=("Lane2", "Lane1"), change_m=change_m)
    car: dict[str, Any] = {"speed_mps": 12.0, "lane_id": "Lane2", "path": path, "speeds": speeds}
    return agent(8.0, 3.5, start=AtTime(after_s=2.0), **car)


def braking(after_s: float, takes_s: float, length_m: float = 5.9) -> TrafficAgent:
    van: dict[str, Any] = {"length_m": length_m, "speed_mps": 8.5, "lane_id": "Lane1"}
    return agent(16.0, 0.0, start=AtTime(after_s=after_s), speeds=((takes_s, 0.0),), **van)


def turning(
    after_s: float, takes_s: float, *points_m: tuple[float, float], straight_m: float = 0.0
) -> TrafficAgent:
    arc = [(straight_m + x_m, y_m) for x_m, y_m in ((0.0, 0.0), *ROUND)] if straight_m else []
    path = PointPath(points_m=(*arc, *points_m))
    car: dict[str, Any] = {"speed_mps": 8.0, "lane_id": "Lane1", "speeds": ((takes_s, 5.0),)}
    return agent(28.0, 0.0, start=AtTime(after_s=after_s), path=path, **car)


def door(
    place: tuple[float, float, float],
    end: tuple[float, float],
    *speeds: tuple[float, float],
    keeps: bool = True,
) -> TrafficAgent:
    path = PointPath(points_m=(end,), keeps_heading=keeps)
    slab: dict[str, Any] = {"type": AgentType.GENERIC_OBJECT, "width_m": 0.15, "length_m": 1.1}
    return agent(*place, path=path, speeds=speeds, start=NearEgo(within_m=15.0), **slab)


def child(*place: float, **parts: Any) -> TrafficAgent:
    return agent(*place, type=AgentType.PEDESTRIAN, width_m=0.8, length_m=0.9, **parts)


def running(end: tuple[float, float], *place: float) -> TrafficAgent:
    path = PointPath(points_m=(end,))
    return child(*place, path=path, speeds=((0.0, 2.0),), start=NearEgo(within_m=20.0))


def bus(y_m: float, **parts: Any) -> TrafficAgent:
    size: dict[str, Any] = {"type": AgentType.BUS, "width_m": 2.1, "length_m": 7.5}
    return agent(34.3, y_m, 1.571, speed_mps=8.0, lane_id="Lane16", **size, **parts)


def stopping(within_m: float) -> TrafficAgent:
    car: dict[str, Any] = {
        "speed_mps": 3.0,
        "lane_id": "Connector8",
        "speeds": ((3.0 / 7.0, 0.0),),
    }
    return agent(35.75, 16.35, 1.558, start=NearEgo(within_m=within_m), **car)


CROSSING = LanePath(lane_ids=("Lane16", "Connector13", "Lane8"))
RIGHT = {
    "a cut-in over 22 m": (CUT_IN, cutting_in(22.0, (2.5, 7.0))),
    "a cut-in over 24 m": (CUT_IN, cutting_in(24.0, (2.5, 7.0))),
    "who stands 2 s from now": (BRAKING, braking(0.94, 1.0625)),
    "who brakes 2 s from now": (BRAKING, braking(2.0, 1.0625)),
    "a circle after 3 m": (U_TURN, turning(1.0, 0.8, *BACK, straight_m=39.0)),
    "a circle after 2 m": (U_TURN, turning(1.0, 0.6, *BACK, straight_m=38.0)),
    "a door across its car": (DOOR, door((20.87, -4.18, 1.399), (21.06, -3.09), (0.0, 1.1))),
    "a door along its car": (DOOR, door((20.95, -3.71, -0.172), (21.12, -2.72), (0.0, 1.0))),
    "a child that runs": (CHILD, running((37.5, 2.72), 33.56, -9.56, 1.261)),
    "a child elsewhere": (CHILD, running((37.45, 2.74), 33.59, -9.57, 1.267)),
    "a bus over the crossing": (BUS, bus(-33.46, path=CROSSING)),
    "a bus that holds its velocity": (BUS, bus(-33.46)),
    "a careless bus, where one may come from": (BUS, bus(-28.0)),
    "who stops at 32 m round a turn": (TURN, stopping(30.21)),
    "who stops at 32 m as the crow flies": (TURN, stopping(32.0)),
}
CARELESS = {
    "stops in the next lane": (CUT_IN, cutting_in(20.0, (2.0, 0.0))),
    "brakes softly": (BRAKING, braking(2.0, 2.0, 4.8)),
    "goes back and forth": (U_TURN, turning(2.0, 2.0, (36.0, 0.0), (36.0, -6.8), (20.0, -6.8))),
    "never opens": (DOOR, door((20.87, -4.18, 1.399), (21.06, -3.09), (2.0, 0.0), keeps=False)),
    "walks at once": (CHILD, child(33.56, -9.56, 1.261, speed_mps=1.4, walk_to_m=(37.5, 2.72))),
}


def both_readings(intent: Intent) -> Intent:
    """What was asked for of the van: "brakes at 8 m/s² to a standstill, 2 s from now"."""
    (request,) = intent.requests
    assert isinstance(request, VehicleRequest)
    start = StartWish(after_s=Amount(low=2.0, high=2.0), may_end=True)
    motion = replace(request.motion, start=start)
    return replace(intent, requests=(replace(request, motion=motion),))


def wish_m(slug: str, change: Modification) -> float:
    """How far a change that is complete is from the wish of its scenario."""
    intent = entry(slug).intent
    assert intent is not None
    if slug == BRAKING and change != entry(slug).reference:
        intent = both_readings(intent)
    found = measure_wish(Ground.of(shown_scene(slug)), change, intent)
    assert (found.missing, found.surplus) == (0, ())
    (distance_m,) = [value for value in found.distances_m if value] or [0.0]
    return distance_m


def is_wrong(slug: str, agent: TrafficAgent) -> bool:
    intent = entry(slug).intent
    assert intent is not None
    intent = both_readings(intent) if slug == BRAKING else intent
    found = faults_against(shown_scene(slug), Modification(added=(agent,)), intent)
    return any(one.severity is Severity.WRONG for one in found)


@pytest.mark.parametrize("name", RIGHT)
def test_a_right_answer_is_at_its_wish_and_nothing_is_wrong(name: str) -> None:
    slug, made = RIGHT[name]
    assert wish_m(slug, Modification(added=(made,))) <= 0.3
    assert not is_wrong(slug, made)


@pytest.mark.parametrize("name", CARELESS)
def test_a_careless_answer_is_far_off_or_wrong_no_further_than_the_reference(name: str) -> None:
    slug, made = CARELESS[name]
    distance_m = wish_m(slug, Modification(added=(made,)))
    assert distance_m > 1.0 or is_wrong(slug, made)
    assert distance_m > 0.3
    ground = Ground.of(shown_scene(slug))
    found = displacement(Modification(added=(made,)), entry(slug).reference, ground)
    assert distance_m <= found.mean_m + 0.02


@pytest.mark.slow
@pytest.mark.parametrize(
    "slug", ["hard-braking-quarry-narrows", CUT_IN, "u-turn-market-crossing-ahead"]
)
def test_the_distance_grows_and_stays_below_that_to_the_reference(slug: str) -> None:
    ground, reference = Ground.of(shown_scene(slug)), entry(slug).reference
    last_m = 0.0
    for later_s in (3.0, 4.0, 5.0):
        (mover,) = reference.added
        motion = replace(mover.motion, start=AtTime(after_s=later_s))
        change = replace(reference, added=(replace(mover, motion=motion),))
        distance_m = wish_m(slug, change)
        found = displacement(change, reference, ground)
        assert last_m < distance_m <= found.mean_m + 0.02
        last_m = distance_m


def moved(slug: str, **parts: Any) -> TrafficAgent:
    """The reference's only agent, with another motion."""
    (made,) = entry(slug).reference.added
    return replace(made, motion=replace(made.motion, **parts))


def test_who_walks_already_is_not_somebody_who_waits() -> None:
    # 1.5 s early at 3 m/s; he may stand further out, never in the middle of the road.
    slug = "late-pedestrian-boulevard-north"
    made = replace(moved(slug), motion=None, walk_to_m=(45.0, 6.25), speed_mps=3.0)
    assert wish_m(slug, Modification(added=(made,))) > 1.0


def test_a_door_that_stops_on_its_way_is_as_open_as_it_gets() -> None:
    slug = "door-terrace-row"
    further = PointPath(points_m=((28.5, -1.5),), keeps_heading=True)
    assert wish_m(slug, Modification(added=(moved(slug, path=further),))) <= ROUNDED_M


@pytest.mark.parametrize(("radius_m", "most_m"), [(4.4, 1.5), (5.0, 0.3), (5.5, 0.0)])
def test_a_turn_a_little_too_narrow_is_a_little_off(radius_m: float, most_m: float) -> None:
    slug = "u-turn-station-cross"
    turns = [math.pi / 2.0 + step * math.pi / 6.0 for step in range(7)]
    circle = [
        (38.0 + radius_m * math.cos(turn), -6.6 - radius_m * (1.0 - math.sin(turn)))
        for turn in turns
    ]
    y_m = -6.6 - 2.0 * radius_m
    path = PointPath(points_m=(*circle, (69.0, y_m), (99.0, y_m)))
    assert wish_m(slug, Modification(added=(moved(slug, path=path),))) <= most_m


def test_a_turn_too_narrow_by_a_hair_is_off_by_centimetres() -> None:
    """The reference of 4.37 m, made smaller to 4.17 m, where 4.2 m are needed."""
    slug = "u-turn-market-crossing"
    (turned,) = entry(slug).reference.changed
    assert isinstance(turned.motion.path, PointPath)
    x_m, y_m = turned.pose.beside(0.0)
    points = [
        (x_m + 0.95 * (x - x_m), y_m + 0.95 * (y - y_m)) for x, y in turned.motion.path.points_m
    ]
    path = PointPath(points_m=tuple(points))
    assert 0.0 < wish_m(slug, Modification(added=(moved(slug, path=path),))) < 0.15


def test_where_a_motion_begins_is_judged_over_time() -> None:
    # A bus at 10 m/s instead of 8, 12 m ahead where 12 to 16 are admitted: over 6 s it is least
    # far from one that begins further ahead.
    slug = "hard-braking-reservoir-road"
    (made,) = entry(slug).reference.added
    change = Modification(added=(replace(made, x_m=12.0, y_m=0.63, speed_mps=10.0),))
    found = displacement(change, entry(slug).reference, Ground.of(shown_scene(slug)))
    assert wish_m(slug, change) < found.mean_m


def test_by_interplans_rules_a_bus_without_a_motion_runs_no_red_light() -> None:
    authored, change = entry(BUS), Modification(added=(bus(-60.0),))
    options = SceneOptions(interplan=InterplanRules())
    ground = Ground.of(replace(shown_scene(BUS), options=options), expect_recording)
    findings = check_against_intent(ground, change, authored.intent)
    assert FindingKind.ASKED_CROSSING in [one.kind for one in findings if one.is_fault]
    measured = measure_wish(ground, change, authored.intent)
    assert measured.matches[0].distance_m > 1.0


def _ahead(low_m: float, lane: str | None = "own", **more: Any) -> dict[str, Any]:
    return {"distance": {"low_m": low_m}, "relation": "ahead", "lane": lane} | more


_LINE = {"kind": "cones", "shape": "line", "spacing": {"low_m": 5.0}}
_BRAKES = {"preset": "hard_braking", "start": {"after_s": {"low": 1.5}}}
_PARKED: dict[str, Any] = {"kind": "parked vehicle"}


@pytest.mark.parametrize(
    ("name", "request_"),
    [
        # Connectors part under it, lanes beside it run at an angle, and a side road has no edge.
        ("market-crossing", {"spot": _ahead(24.0), "speed_mps": 10.0, "motion": _BRAKES}),
        ("theatre-crossing", {"spot": _ahead(33.0, "oncoming"), "speed_mps": 0.0}),
        ("chapel-corner", {"kind": "walk", "start": "right", "spot": _ahead(34.0, None),
                           "motion": {"preset": "late_pedestrian"}}),
        ("station-cross", {"body": "bus", "speed_mps": 7.0,
                           "motion": {"preset": "red_light", "side": "left"}}),
        ("willow-crescent", {"kind": "door", "spot": {"landmark": _PARKED}}),
        ("station-cross", _LINE | {"spot": _ahead(20.0), "count": 3, "both_sides": True}),
        ("theatre-crossing", _LINE | {
            "spot": _ahead(20.0, lateral={"target": "left lane boundary"}), "count": 4,
            "has_worker": True, "post": "beside the last cones", "post_side": "left"}),
    ],
)  # fmt: skip
def test_what_is_placed_where_ways_part_and_bend_is_what_was_asked_for(
    name: str, request_: dict[str, Any]
) -> None:
    intent = intent_from_parts({"requests": [{"kind": "vehicles", "count": 1} | request_]})
    scene = whole_scene(name)
    change = place(scene, intent).modification
    found = measure_wish(Ground.of(scene), change, intent)
    assert found is not None
    assert max(found.distances_m) <= ROUNDED_M
    assert not [one for one in faults_against(scene, change, intent) if "asked" in one.kind]


def test_who_is_recorded_as_creeping_pulls_out_as_one_who_stands() -> None:
    slug = "pull-out-lime-street"
    base, authored = shown_scene(slug), entry(slug)
    assert authored.intent
    assert authored.reference
    (made,), (asks,) = authored.reference.moved, authored.intent.moves
    assert made.motion
    agents = (replace(a, speed_mps=0.05) if a.id == made.id else a for a in base.agents)
    scene = replace(base, agents=tuple(agents))
    made = replace(made, speed_mps=0.05, motion=replace(made.motion, start=AtTime()))
    wish = Intent(moves=(replace(asks, motion=MotionWish(preset=MotionPreset.PULL_OUT)),))
    found = measure_wish(Ground.of(scene), Modification(moved=(made,)), wish)
    assert found is not None
    assert max(found.distances_m) <= 0.1


def test_who_never_begins_is_off_by_a_number_where_any_moment_is_right() -> None:
    asked = entry(CUT_IN).intent
    (request,) = asked.requests
    assert isinstance(request, VehicleRequest)
    at_any_time = replace(request, motion=replace(request.motion, start=None))
    never = PlannedMotion(path=LanePath(lane_ids=("Lane2",)), start=NearEgo(within_m=0.1))
    change = Modification(added=(replace(cutting_in(22.0), motion=never),))
    intent = replace(asked, requests=(at_any_time,))
    found = measure_wish(Ground.of(shown_scene(CUT_IN)), change, intent)
    assert math.isfinite(found.distances_m[0])
