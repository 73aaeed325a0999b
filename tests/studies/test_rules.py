"""Studies with repeats, attention checks and automatic ties, as rows."""

import pytest

from arena.models import Study
from arena.studies.services.planning import frozen_pictures, frozen_rules
from arena.studies.services.taking_part import hand_over
from augment.models import Augmentation, Scenario
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.scenarios.pictures import draw_checks
from tests.opening import open_study
from tests.scenes import vehicle
from tests.study_rows import KINDS, Cast, a_study, cast_of, contestant, picture

pytestmark = pytest.mark.django_db


def opened(cast: Cast, votes: int = 12, **options: object) -> Study:
    return open_study(name="Round 1", votes_per_expert=votes, seed=7, **options, **cast)


def with_checks(scenarios: int = 8) -> Cast:
    """A cast whose scenarios have references, drawn by the contestant reference, and checks."""
    cast = cast_of(scenarios=scenarios)
    change = modification_to_document(Modification(added=(vehicle("Agent2", 20.0, 0.0),)))
    Scenario.objects.update(reference=change)
    reference = contestant("reference", KINDS.REFERENCE)
    for place in Scenario.objects.all():
        picture(place, reference)
    drawn = draw_checks(scenarios=cast["scenarios"])
    assert len(drawn) == scenarios
    for row in Augmentation.objects.all():  # a picture each, all in one window
        Augmentation.objects.filter(pk=row.pk).update(image=f"bev/{row.pk}.png")
    return cast


def test_repeats_point_to_what_they_show_again_with_sides_swapped() -> None:
    study = opened(cast_of(), repeats=25)
    repeats = study.matchups.filter(kind="repeat").select_related("repeat_of")
    assert len(repeats) == 6
    for row in repeats:
        first = row.repeat_of
        assert first is not None
        assert (first.left_id, first.right_id) == (row.right_id, row.left_id)
        assert (first.expert_id, first.kind) == (row.expert_id, "main")
        assert first.position < row.position
        assert not {first.left_token, first.right_token} & {row.left_token, row.right_token}
    assert study.matchups.filter(kind="main").count() == 24, "repeats come on top of the quota"


def test_checks_show_the_reference_against_a_broken_one() -> None:
    study = opened(with_checks(), checks=25)
    checks = study.matchups.filter(kind="check")
    assert len(checks) == 6
    for row in checks.select_related("left__contestant", "right__contestant"):
        shown = {row.left.contestant.kind, row.right.contestant.kind}
        assert shown == {"reference", "check"}
    assert not study.contestants.filter(kind="check").exists()
    assert study.matchups.exclude(kind="check").filter(left__contestant__kind="check").count() == 0


def test_a_study_opened_before_these_rules_is_read_without_them() -> None:
    study = a_study()
    old = ("entries", "experts", "votes_per_expert", "seed", "scenario_gap")
    study.rules = {name: study.rules[name] for name in old}
    assert (frozen_rules(study).repeat_share, frozen_rules(study).checks) == (0.0, ())


def test_checks_drawn_in_another_window_stay_out_of_an_open_study() -> None:
    study = opened(with_checks(), votes=12, checks=25)
    shown = {place for place, who in frozen_pictures(study) if who == "attention-check"}
    assert len(shown) == 8
    for row in Augmentation.objects.filter(contestant__kind="check")[:4]:
        Augmentation.objects.filter(pk=row.pk).update(image=f"bev/1-new/{row.pk}.png")
    kept = {place for place, who in frozen_pictures(study) if who == "attention-check"}
    assert len(kept) == 4
    old = study.matchups.filter(expert__username="finn", kind="check")
    had = set(old.values_list("scenario__slug", flat=True))
    assert hand_over(study=study, username="eva", to=["finn"]) == {"finn": 12}
    new = old.filter(batch__gt=0)
    assert {row.scenario.slug for row in new} <= kept - had
