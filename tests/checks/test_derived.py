"""What a drawing asks for: the drawing itself has to answer it."""

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import pytest

from augment.baselines.rule_placer import place
from augment.checks.derived import classify_change, describe_change
from augment.checks.finding import FindingKind
from augment.checks.ground import Ground
from augment.checks.registry import findings_on
from augment.checks.wish import measure_wish
from augment.geometry.frames import Pose, difference, overlap
from augment.scene.codec import intent_to_document
from augment.scene.entities import (
    LENGTH_WIDTH_M,
    AgentType,
    Modification,
    ScenarioType,
    Scene,
    TrafficAgent,
    TurnType,
)
from augment.scene.intent_statements import list_statements
from augment.scene.lane_graph import LaneGraph
from augment.scene.planned_motion import MotionPreset, PlannedMotion
from augment.scene.presets import PresetNumbers, with_preset
from tests.checks.test_asked_motions import WISHES
from tests.checks.worlds import faults_against
from tests.fixtures import shelf
from tests.recorded import recorded_moments
from tests.scenes import junction, lane, pedestrian, scene, vehicle

PARKED = vehicle("Agent2", 20.0, -1.0)
DRIVING = vehicle("Agent3", 40.0, 3.5, 3.14159, speed_mps=7.0)
BICYCLE = vehicle("Added1", 9.0, 0.0, type=AgentType.BICYCLE, speed_mps=3.0)
KINDS = (
    *(AgentType.VEHICLE, AgentType.TRAFFIC_CONE, AgentType.BUS, AgentType.BARRIER),
    *(AgentType.BICYCLE, AgentType.PEDESTRIAN, AgentType.CONSTRUCTION_SIGN),
)
SHARES = (0.3, 0.8, 0.45, 0.6, 0.2)
"""Of the length of a lane."""
LEFT_M = (0.0, 0.8, -0.6, -3.2, 4.1)
TURNED_RAD = (0.0, math.pi, -1.2, 0.5)


def list_poses(here: Scene) -> Iterator[Pose]:
    """Straight ahead of the ego; then on every lane near it, beside it and turned against it."""
    yield replace(here.ego.pose, x_m=20.0, y_m=0.0)
    lines = [lane.centerline for lane in LaneGraph(here).lanes.values()]
    for number, (share, line) in enumerate((share, one) for share in SHARES for one in lines):
        pose = line.pose_at(share * line.length_m, LEFT_M[number % len(LEFT_M)])
        if math.hypot(pose.x_m, pose.y_m) < 60.0:
            yield pose.turn(TURNED_RAD[number % len(TURNED_RAD)])


def draw_objects(here: Scene, most: int) -> Iterator[TrafficAgent]:
    """Objects of every kind where nothing stands and the checks have nothing against them."""
    ground, poses, drawn = Ground.of(here), list(list_poses(here)), list[TrafficAgent]()
    step = max(1, len(poses) // (3 * most))
    for number, pose in enumerate(poses[::step]):
        kind = KINDS[number % len(KINDS)]
        length_m, width_m = LENGTH_WIDTH_M[kind]
        size = {"length_m": length_m, "width_m": width_m}
        place = (pose.x_m, pose.y_m, pose.heading_rad)
        agent = vehicle(f"Added{number}", *place, type=kind, **size)
        is_free = not any(overlap(agent.box, one.box).depth_m for one in (*here.everyone, *drawn))
        found = findings_on(ground, Modification(added=(agent,))) if is_free else ()
        if is_free and not any(one.is_fault for one in found):
            drawn.append(agent)
            yield agent


def place_as_drawn(name: str, here: Scene, most: int) -> list[str]:
    """Where a drawing, its sentence's intent and what is placed by that differ."""
    drawn = tuple(islice(draw_objects(here, most), most))
    assert len(drawn) > 1
    sentence, intent = describe_change(None, Modification(added=drawn), here)
    assert intent is not None, sentence
    assert not intent.beyond
    placed = place(here, intent).modification.added
    assert sorted(one.type for one in placed) == sorted(one.type for one in drawn)
    wish = measure_wish(Ground.of(here), Modification(added=drawn), intent)
    assert (wish.missing, wish.surplus) == (0, ())
    assert max(wish.distances_m) < 0.15, f"{name}: {wish} in “{sentence}”"
    return [
        f"{name}: {agent.type} {agent.pose} in “{sentence}”"
        for agent in drawn
        if not any(_answers(agent, one) for one in placed)
    ]


def _answers(drawn: TrafficAgent, placed: TrafficAgent) -> bool:
    """Within 0.3 m and 6 degrees: whole degrees below 5 are as the lane leads."""
    turned_deg = abs(math.degrees(difference(placed.heading_rad, drawn.heading_rad)))
    turns = {AgentType.TRAFFIC_CONE: (), AgentType.PEDESTRIAN: (), AgentType.BARRIER: (0, 180)}
    wanted_deg = turns.get(drawn.type, (0, 180) if "SIGN" in drawn.type else (0,))
    is_turned = not wanted_deg or any(abs(turned_deg - one) < 6.0 for one in wanted_deg)
    near = math.dist(drawn.pose.beside(0.0), placed.pose.beside(0.0)) < 0.3
    return near and is_turned and drawn.type is placed.type


@pytest.mark.slow
def test_what_is_drawn_in_the_catalogue_is_placed_again_by_its_own_sentence() -> None:
    problems = [
        problem
        for name in (*shelf.SCENES, *shelf.HARD_SCENES)
        for problem in place_as_drawn(name, shelf.whole_scene(name), 6)
    ]
    assert not problems


@pytest.mark.slow
@pytest.mark.realdata
def test_what_is_drawn_on_recorded_moments_is_placed_again_by_its_sentence(realdata: Path) -> None:
    moments = list(recorded_moments(realdata, every_s=1.0))
    chosen = [moment for number, moment in enumerate(moments) if number % 7 < 4]
    assert len(chosen) == 20
    problems = [problem for title, here in chosen for problem in place_as_drawn(title, here, 6)]
    assert not problems


@pytest.mark.slow
def test_references_of_the_catalogue_answer_what_is_derived_from_them() -> None:
    unanswered = set()
    for slug in (*shelf.SLUGS[::3], *shelf.HARD_SLUGS[::3], "brewery-crossing-pile-up"):
        given, here = shelf.entry(slug), shelf.shown_scene(slug)
        if given.reference.is_empty:
            continue
        sentence, intent = describe_change(ScenarioType(given.type), given.reference, here)
        assert sentence.endswith(".")
        assert intent_to_document(intent)["requests"] is not None
        unanswered |= {slug} if faults_against(here, given.reference, intent) else set()
    assert not unanswered


@pytest.mark.parametrize(
    ("change", "words", "statements"),
    [
        (Modification(added=(vehicle("Added1", 12.0, 0.0),)),
         "a parked vehicle 12.0 m ahead of the ego along its lane, in the ego's lane",
         ("vehicle: 12 m ahead of the ego", "vehicle: in the own lane", "vehicle: stands")),
        (
            Modification(added=(BICYCLE,)),
            "a bicycle 9.0 m ahead of the ego along its lane, in the ego's lane, "
            "in the lane's direction, driving at 3.0 m/s",
            ("bicycle: 9 m ahead of the ego", "bicycle: moves at 3 m/s"),
        ),
        (Modification(moved=(vehicle("Agent2", 30.0, 0.0, 0.5, speed_mps=4.0),)),
         "move the nearest parked vehicle ahead of the ego to 30.0 m ahead of the ego along its "
         "lane, in the ego's lane, turned 29 degrees to the left of the lane's direction, driving "
         "at 4.0 m/s.",
         ("parked vehicle 1 ahead of the ego: 30 m ahead of the ego",)),
        (Modification(moved=(pedestrian("Agent4", 14.0, 0.0, (14.0, 5.0), heading_rad=0.9),)),
         "move the nearest pedestrian ahead of the ego to 14.0 m ahead of the ego along its lane, "
         "in the ego's lane, walking to 14.0 m ahead of the ego along its lane, in the oncoming",
         ("not in any field: “the motion of Agent4”",)),
        (Modification(removed=("Agent3",)), "remove the nearest moving vehicle ahead of the ego",
         ("moving vehicle 1 ahead of the ego: goes",)),
    ],
)  # fmt: skip
def test_what_is_added_moved_and_removed_is_said(
    change: Modification, words: str, statements: tuple[str, ...]
) -> None:
    here = scene(agents=(PARKED, DRIVING, pedestrian("Agent4", 12.0, 6.0)))
    sentence, intent = describe_change(None, change, here)
    assert sentence.startswith("Change the scene: ")
    assert words in sentence
    assert set(statements) <= set(list_statements(intent))
    assert not [
        one for one in faults_against(here, change, intent) if one.kind.startswith("asked")
    ]


def test_a_walk_from_the_middle_of_the_lane_begins_there_again() -> None:
    person = pedestrian("Added1", 12.0, 0.0, walk_to_m=(12.5, -5.0))
    sentence, intent = describe_change(None, Modification(added=(person,)), scene())
    assert "from 12.0 m ahead of the ego along its lane, in the middle of the ego's" in sentence
    (placed,) = place(scene(), intent).modification.added
    assert (placed.pose.beside(0.0), placed.walk_to_m) == ((12.0, 0.0), (12.5, -5.0))


def test_who_has_no_name_leaves_words_alone() -> None:
    """An intent without him would call the drawing itself wrong."""
    here = scene(agents=(PARKED, vehicle("Agent3", 40.0, 30.0)))
    change = Modification(added=(vehicle("Added1", 12.0, 0.0),), removed=("Agent3",))
    sentence, intent = describe_change(None, change, here)
    assert "remove Agent3" in sentence
    assert intent is None


def test_a_way_of_its_own_that_comes_back_is_not_behind_the_ego() -> None:
    base = scene()
    here = replace(base, lanes=(*base.lanes, lane("Lane9", [(80.0, 40.0), (-20.0, 40.0)])))
    sentence, _ = describe_change(None, Modification(added=(vehicle("Added1", 30.0, 40.0),)), here)
    assert "30.0 m back along Lane9 from its point nearest to the ego, in Lane9" in sentence


def test_of_crossing_lanes_a_heading_of_zero_tells_which_is_meant() -> None:
    base, ends = (
        scene(),
        {"Lane8": [(30.0, 20.0), (30.0, 60.0)], "Lane9": [(0.0, 40.0), (60.0, 40.0)]},
    )
    here = replace(base, lanes=(*base.lanes, *(lane(name, line) for name, line in ends.items())))
    change = Modification(added=(vehicle("Added1", 30.2, 40.8, 0.0),))
    assert "in Lane9, 0.8 m left of its centre" in describe_change(None, change, here)[0]


def test_who_starts_late_crosses_the_egos_way_wherever_it_waits() -> None:
    """It waits on a branch, and the middle of its walk is there too."""
    here = replace(junction(), options=replace(junction().options, goal=TurnType.LEFT))
    waits = with_preset(
        MotionPreset.LATE_PEDESTRIAN,
        here,
        vehicle("Added1", 34.0, 0.0, type=AgentType.PEDESTRIAN),
        PresetNumbers(),
    )
    change = Modification(added=(waits,))
    sentence, intent = describe_change(None, change, here)
    assert re.search("walks from .* along its lane, .* to .* along its lane", sentence)
    assert not [
        one for one in faults_against(here, change, intent) if one.kind.startswith("asked")
    ]


def test_a_side_of_the_oncoming_lane_is_that_of_the_ego() -> None:
    change = Modification(added=(vehicle("Added1", 12.0, 4.5, math.pi),))
    sentence, _ = describe_change(None, change, scene())
    assert "1.0 m left of its centre, seen as the ego drives" in sentence


def test_what_stands_on_a_branch_is_counted_along_the_way_to_it() -> None:
    """The route turns left at x = 20 m, and a barrier stands straight on from there."""
    barrier = vehicle("Added1", 45.0, 0.6, type=AgentType.BARRIER)
    person = pedestrian("Added2", 40.0, 3.0, walk_to_m=(40.0, -5.0))
    change, base = Modification(added=(barrier, person)), junction()
    here = replace(base, options=replace(base.options, goal=TurnType.LEFT))
    sentence, intent = describe_change(None, change, here)
    for words in (
        "a barrier 45.0 m ahead of the ego along the way to Lane2, in Lane2, 0.6 m left of its",
        "who walks from 40.0 m ahead of the ego along the way to Lane2, beside Lane2, 3.0 m left",
    ):
        assert words in sentence
    assert "barrier: 45 m ahead of the ego on the way to Lane2" in list_statements(intent)
    assert faults_against(here, change, intent) == []
    measured = findings_on(Ground.of(here), Modification(added=(replace(barrier, y_m=0.5),)))
    assert "is 45.0 m ahead of the ego along the way to Lane2 and" in measured[0].sentence()
    placed = {one.type: one for one in place(here, intent).modification.added}
    assert placed[AgentType.BARRIER].pose == barrier.pose
    assert placed[AgentType.PEDESTRIAN].pose.beside(0.0) == pytest.approx((40.0, 3.0))
    assert placed[AgentType.PEDESTRIAN].walk_to_m == person.walk_to_m
    far = Modification(added=(replace(barrier, x_m=50.0, y_m=-2.0), replace(person, y_m=6.0)))
    assert [one.kind for one in faults_against(here, far, intent)] == [
        *(FindingKind.ASKED_DISTANCE, FindingKind.ASKED_ACROSS, FindingKind.ASKED_ACROSS)
    ]


def test_only_who_walks_crosses() -> None:
    for walk_to_m, lead in (
        ((12.0, -4.0), "Let somebody cross the road"),
        ((12.0, 9.0), "Change the scene"),  # away from the road
        (None, "Change the scene"),
    ):
        person = vehicle("Added1", 12.0, 4.0, type=AgentType.PEDESTRIAN, walk_to_m=walk_to_m)
        change = Modification(added=(person,))
        sentence, _ = describe_change(ScenarioType.JAYWALKER, change, scene())
        assert sentence.startswith(lead)


def test_a_drawing_without_a_lane_for_the_ego_has_words_alone() -> None:
    change = Modification(added=(vehicle("Added1", 12.0, 2.0),))
    sentence, intent = describe_change(ScenarioType.NUDGE, change, scene(lanes=()))
    assert "12.0 m ahead of the ego and 2.0 m to its left" in sentence
    assert intent is None


@pytest.mark.parametrize("name", sorted(WISHES))
def test_a_motion_that_was_placed_is_derived_as_it_was_asked_for(name: str) -> None:
    base, asked_for = WISHES[name]
    change = place(base, asked_for).modification
    sentence, intent = describe_change(None, change, base)
    (asked,), (told,) = ([*one.requests, *one.moves] for one in (asked_for, intent))
    wanted, got = (getattr(one, "motion", None) for one in (asked, told))
    assert (got.preset, got.side) == (wanted.preset, wanted.side)
    for part in ("start", "speed_mps", "braking_mps2", "duration_s"):
        assert getattr(wanted, part) in (None, getattr(got, part))
    assert f"then: {got.preset.label.lower()}" in sentence
    assert classify_change(change, base) == wanted.preset
    found = faults_against(base, change, intent)
    assert not [one for one in found if one.kind.startswith("asked")]


def test_a_motion_that_is_no_preset_stays_outside_the_fields() -> None:
    car = replace(DRIVING, id="Added1", motion=PlannedMotion(speeds=((3.0, 9.0),)))
    _, intent = describe_change(None, Modification(added=(car,)), scene())
    assert intent.beyond == ("the motion of Added1",)
