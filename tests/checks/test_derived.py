"""What a drawing asks for: the drawing itself has to answer it."""

from dataclasses import replace

import pytest

from augment.baselines.rule_placer import place
from augment.checks.derived import classify_change, describe_change
from augment.checks.ground import Ground
from augment.checks.registry import check_against_intent
from augment.scene.codec import intent_to_document
from augment.scene.entities import AgentType, Modification, ScenarioType
from augment.scene.intent_statements import list_statements
from augment.scene.planned_motion import PlannedMotion
from tests.checks.test_asked_motions import WISHES
from tests.fixtures.shelf import HARD_SLUGS, SLUGS, entry, shown_scene
from tests.scenes import scene, vehicle

HARD_TO_TELL = {"brewery-crossing-pile-up", "windmill-circle-groups"}
PARKED = vehicle("Agent2", 20.0, -1.0)
DRIVING = replace(vehicle("Agent3", 40.0, 3.5, 3.14159), speed_mps=7.0)
BICYCLE = replace(vehicle("Added1", 9.0, 0.0), type=AgentType.BICYCLE, speed_mps=3.0)


def test_references_of_the_catalogue_answer_what_is_derived_from_them() -> None:
    unanswered = set()
    for slug in (*SLUGS[::3], *HARD_SLUGS[::3], *HARD_TO_TELL):
        given, here = entry(slug), shown_scene(slug)
        if given.reference.is_empty:
            continue
        sentence, intent = describe_change(ScenarioType(given.type), given.reference, here)
        assert sentence.endswith(".")
        assert intent is not None
        assert intent_to_document(intent)["requests"] is not None
        found = check_against_intent(Ground.of(here), given.reference, intent)
        unanswered |= {slug} if any(one.is_fault for one in found) else set()
    assert unanswered == HARD_TO_TELL


@pytest.mark.parametrize(
    ("change", "words", "statements"),
    [
        (
            Modification(added=(vehicle("Added1", 12.0, 0.0),)),
            "a parked vehicle 12.0 m ahead of the ego along its lane, in the ego's lane",
            ("vehicle: 12 m ahead of the ego", "vehicle: in the own lane", "vehicle: stands"),
        ),
        (
            Modification(added=(BICYCLE,)),
            "a bicycle 9.0 m ahead of the ego along its lane, in the ego's lane, "
            "in the lane's direction, driving at 3.0 m/s",
            ("bicycle: 9 m ahead of the ego", "bicycle: moves at 3 m/s"),
        ),
        (
            Modification(moved=(vehicle("Agent2", 30.0, 0.0),)),
            "move the nearest parked vehicle ahead of the ego to 30.0 m ahead of the ego",
            ("parked vehicle 1 ahead of the ego: 30 m ahead of the ego",),
        ),
        (
            Modification(removed=("Agent3",)),
            "remove the nearest moving vehicle ahead of the ego",
            ("moving vehicle 1 ahead of the ego: goes",),
        ),
    ],
)
def test_what_is_added_moved_and_removed_is_said(
    change: Modification, words: str, statements: tuple[str, ...]
) -> None:
    here = scene(agents=(PARKED, DRIVING))
    sentence, intent = describe_change(None, change, here)
    assert sentence.startswith("Change the scene: ")
    assert words in sentence
    assert intent is not None
    assert set(statements) <= set(list_statements(intent))


@pytest.mark.parametrize(
    ("walk_to_m", "lead"),
    [((12.0, -4.0), "Let somebody cross the road"), (None, "Change the scene")],
)
def test_only_who_walks_crosses(walk_to_m: tuple[float, float] | None, lead: str) -> None:
    person = replace(vehicle("Added1", 12.0, 4.0), type=AgentType.PEDESTRIAN, walk_to_m=walk_to_m)
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
    assert intent is not None
    (asked,), (told,) = ([*one.requests, *one.moves] for one in (asked_for, intent))
    wanted, got = (getattr(one, "motion", None) for one in (asked, told))
    assert wanted is not None
    assert got is not None
    assert (got.preset, got.side) == (wanted.preset, wanted.side)
    for part in ("start", "speed_mps", "braking_mps2", "duration_s"):
        assert getattr(wanted, part) in (None, getattr(got, part))
    assert f"then: {got.preset.label.lower()}" in sentence
    assert classify_change(change, base) == wanted.preset
    found = check_against_intent(Ground.of(base), change, intent)
    assert not [one for one in found if one.is_fault and one.kind.startswith("asked")]


def test_a_motion_that_is_no_preset_stays_outside_the_fields() -> None:
    car = replace(DRIVING, id="Added1", motion=PlannedMotion(speeds=((3.0, 9.0),)))
    _, intent = describe_change(None, Modification(added=(car,)), scene())
    assert intent is not None
    assert intent.beyond == ("the motion of Added1",)
