"""Studies with targets, repeats, attention checks and automatic ties, as rows."""

from __future__ import annotations

from collections import Counter
from io import StringIO

import pytest
from django.core.management import CommandError, call_command

from arena.errors import NothingToPlan
from arena.models import Study
from arena.pairing.plan import plan
from arena.services.handing_over import hand_over
from arena.services.plans import pictures_of
from arena.services.replanning import plan_batch
from arena.services.studies import PlanOptions, open_study, rules_of
from augment.errors import UnknownName
from augment.models import Augmentation, Contestant, Scenario
from augment.scene.codec import modification_to_document
from augment.scene.modification import Modification
from augment.services.scenarios.attention import draw_checks
from tests.scenes import vehicle
from tests.study_rows import KINDS, Cast, a_study, cast_of, contestant, picture, rows_planned

pytestmark = pytest.mark.django_db


def opened(cast: Cast, votes: int = 12, **options: object) -> Study:
    return open_study(
        name="Round 1",
        votes_per_expert=votes,
        seed=7,
        options=PlanOptions(**options),  # type: ignore[arg-type]
        **cast,
    )


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
    study = opened(cast_of(), repeat_share=0.25)
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
    study = opened(with_checks(), check_share=0.25)
    checks = study.matchups.filter(kind="check")
    assert len(checks) == 6
    for row in checks.select_related("left__contestant", "right__contestant"):
        shown = {row.left.contestant.kind, row.right.contestant.kind}
        assert shown == {"reference", "check"}
    assert not study.contestants.filter(kind="check").exists()
    assert study.matchups.exclude(kind="check").filter(left__contestant__kind="check").count() == 0


def test_a_study_whose_checks_nobody_has_drawn_is_not_opened() -> None:
    cast = with_checks(6)
    Augmentation.objects.filter(contestant__kind="check").delete()
    with pytest.raises(NothingToPlan, match=r"expert: 3; .* for one: 0.*Draw missing"):
        opened(cast, check_share=0.25)
    assert not Study.objects.exists()
    assert not opened(cast).matchups.filter(kind="check").exists()


@pytest.mark.parametrize(("scenarios", "opens"), [(2, False), (3, True)])
def test_each_check_needs_a_scenario_of_its_own(scenarios: int, opens: bool) -> None:
    cast = with_checks(6)
    Scenario.objects.filter(slug__in=cast["scenarios"][scenarios:]).update(reference=None)
    kind = {"contestant__kind": "check"}
    Augmentation.objects.filter(scenario__slug__in=cast["scenarios"][scenarios:], **kind).delete()
    if opens:
        study = opened(cast, check_share=0.25)
        assert study.matchups.filter(kind="check").count() == 3 * 2
        return
    with pytest.raises(NothingToPlan, match=r"each expert: 3; .* the study has 2\. Ask for fewer"):
        opened(cast, check_share=0.25)


def test_checks_that_the_adaptive_part_will_show_are_asked_for_at_once() -> None:
    cast = with_checks(2)
    with pytest.raises(NothingToPlan, match="each expert: 3"):
        opened(cast, votes=6, check_share=0.5, adaptive_share=0.5)


def test_the_command_says_that_there_are_no_checks_where_nobody_asked_for_any() -> None:
    cast, told = cast_of(), StringIO()
    words = ["open_study", "Round 1", "--contestants", *cast["contestants"]]
    words += ["--scenarios", *cast["scenarios"], "--experts", *cast["experts"]]
    words += ["--votes-per-expert", "12", "--seed", "7"]
    with pytest.raises(CommandError, match="Ask for fewer"):
        call_command(*words, "--checks", "25")
    for share in ("nan", "inf", "51"):
        with pytest.raises(CommandError, match="attention checks goes from 0 to 50%"):
            call_command(*words, "--checks", share)
    call_command(*words, stdout=told)
    assert "No attention checks: nobody has drawn pictures" in told.getvalue()


def test_check_pictures_are_drawn_once_by_a_command() -> None:
    cast = with_checks(2)
    assert draw_checks(scenarios=cast["scenarios"]) == []
    call_command("draw_checks", "all")
    rows = Augmentation.objects.filter(contestant__kind="check")
    assert (rows.count(), rows.filter(image="").count()) == (2, 0)
    heap = [one for row in rows for one in (row.modification or {})["add"]]
    assert {(one["x_m"], one["y_m"]) for one in heap} == {(0.0, 0.0)}, "across the ego"


def test_an_attention_check_is_nobody_to_be_rated() -> None:
    cast = with_checks(2)
    cast["contestants"] = [*cast["contestants"], "attention-check"]
    with pytest.raises(UnknownName, match="Unknown contestant 'attention-check'"):
        opened(cast, votes=4)


def test_targets_by_contestant_are_met_in_the_rows() -> None:
    targets = (("ann", 20), ("bob", 15), ("cid", 13))
    study = opened(cast_of(), appearances=targets)
    shown = Counter(study.matchups.values_list("left__contestant__slug", flat=True))
    shown += Counter(study.matchups.values_list("right__contestant__slug", flat=True))
    assert shown == dict(targets)


def test_targets_that_do_not_add_up_leave_nothing_behind() -> None:
    with pytest.raises(NothingToPlan, match=r"49 appearances, .* 48"):
        opened(cast_of(), appearances=(("ann", 25), ("bob", 14), ("cid", 10)))
    assert not Study.objects.exists()


def test_every_rule_is_kept_and_gives_the_same_rows_again() -> None:
    rules: dict[str, float] = {"repeat_share": 0.25, "check_share": 0.25}
    study = Study.objects.get(pk=opened(with_checks(), 12, **rules).pk)
    assert rows_planned(study) == [
        (m.expert, m.position, m.kind, m.scenario, m.left, m.right)
        for m in plan(rules_of(study)).matchups
    ]
    assert study.rules["planner"] == "balanced-2"


def test_a_study_opened_before_these_rules_is_read_without_them() -> None:
    study = a_study()
    old = ("entries", "experts", "votes_per_expert", "seed", "scenario_gap")
    study.rules = {name: study.rules[name] for name in old}
    assert (rules_of(study).repeat_share, rules_of(study).checks) == (0.0, ())


def test_later_pictures_of_the_contestants_do_not_enter_an_open_study() -> None:
    study = a_study()
    before = {cell: row.pk for cell, row in pictures_of(study).items()}
    place, ann = Scenario.objects.get(slug="place-1"), Contestant.objects.get(slug="ann")
    later = picture(place, ann)
    assert {cell: row.pk for cell, row in pictures_of(study).items()} == before
    assert later.pk not in before.values()


def test_the_command_opens_a_study_with_its_rules_and_says_what_it_planned() -> None:
    cast = with_checks()
    out = StringIO()
    given = ["open_study", "Round 1", "--votes-per-expert", "12", "--seed", "1"]
    for option, names in cast.items():
        given += [f"--{option}", *names]  # type: ignore[misc]
    targets = ["ann vs bob=14", "bob vs cid = 10"]
    call_command(
        *given,
        "--targets",
        *targets,
        "--repeats",
        "25",
        "--checks",
        "10",
        "--both-miss",
        stdout=out,
    )
    said = "24 votes, 6 hidden repeats, 2 attention checks; 0 votes are planned later."
    assert said in out.getvalue()
    assert Study.objects.get().allow_both_miss
    assert not Study.objects.get().allow_text
    with pytest.raises(CommandError, match="is no target"):
        call_command(*given, "--targets", "ann lots")


def test_checks_drawn_in_another_window_stay_out_of_an_open_study() -> None:
    study = opened(with_checks(), votes=12, check_share=0.5, adaptive_share=0.5)
    eva = study.experts.get(username="eva")
    shown = {place for place, who in pictures_of(study) if who == "attention-check"}
    assert len(shown) == 8
    for row in Augmentation.objects.filter(contestant__kind="check")[:4]:
        Augmentation.objects.filter(pk=row.pk).update(image=f"bev/1-new/{row.pk}.png")
    kept = {place for place, who in pictures_of(study) if who == "attention-check"}
    assert len(kept) == 4
    old = study.matchups.filter(expert=eva, kind="check")
    had = set(old.values_list("scenario__slug", flat=True))
    assert plan_batch(study=study, expert=eva) > 0
    new = old.filter(batch__gt=0)
    assert {row.scenario.slug for row in new} <= kept - had
    giver = hand_over(study=study, username="eva", to=["finn"])
    assert sum(giver.values()) > 0


def test_checks_are_opened_with_pictures_of_the_window_of_the_others() -> None:
    cast = with_checks()
    old = Augmentation.objects.filter(contestant__kind="check").order_by("pk")
    names = {row.image for row in old}
    for row in old:
        late = picture(row.scenario, row.contestant, image=f"bev/1-new/{row.pk}.png")
        assert late.finished_at is not None
    study = opened(cast, check_share=0.25)
    checks = study.matchups.filter(kind="check").select_related("left__contestant")
    drawn = {r.left_image if r.left.contestant.kind == "check" else r.right_image for r in checks}
    assert drawn
    assert drawn <= names
