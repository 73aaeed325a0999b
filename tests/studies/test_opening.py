"""How a study is opened: alike pairs, repeats, checks, samples, and the stored plan."""

import uuid
from collections import Counter

import pytest
from django.contrib.auth.models import Group, User
from django.core.management import call_command
from django.urls import reverse
from django.utils import timezone

from arena.errors import NothingToPlan
from arena.models import Study
from arena.pairing.plan import plan
from arena.results.exports.preferences import preference_sheet
from arena.results.queries.votes import Filters, last_vote_id, vote_set
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from arena.studies.services.planning import frozen_pictures, frozen_rules
from arena.studies.services.taking_part import hand_over
from arena.voting.services.pictures import SampleRule, draw_sample
from augment.errors import Conflict, UnknownName
from augment.models import Augmentation, Contestant, Event, GenerationJob, Scenario
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.scenarios.pictures import draw_checks
from tests.opening import open_study
from tests.scenes import vehicle
from tests.study_rows import (
    KINDS,
    Cast,
    cast_of,
    contestant,
    expert,
    picture,
    scenario,
    vote,
    vote_all,
    write_changes,
)
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def test_an_open_study_has_the_plan_that_its_stored_rules_give_again(study: Study) -> None:
    assert study.state == Study.State.OPEN
    assert study.opened_at is not None
    per_expert = Counter(study.matchups.values_list("expert__username", flat=True))
    assert per_expert == {"eva": 9, "finn": 9}
    event = Event.objects.get(verb="open")
    assert event.object_code == str(study.code)
    assert event.after == {"name": "Round 1", "matchups": 18, "seed": 7}
    study.refresh_from_db()
    planned = plan(frozen_rules(study))
    stored = study.matchups.order_by("expert__username", "position").values_list(
        "expert__username",
        "position",
        "scenario__slug",
        "left__contestant__slug",
        "right__contestant__slug",
    )
    assert list(stored) == [
        (m.expert, m.position, m.scenario, m.left, m.right) for m in planned.matchups
    ]
    assert study.rules["scenario_gap_kept"] == 5
    old = ("entries", "experts", "votes_per_expert", "seed", "scenario_gap")
    study.rules = {name: study.rules[name] for name in old}
    assert (frozen_rules(study).repeat_share, frozen_rules(study).checks) == (0.0, ())


@pytest.mark.parametrize("state", [Augmentation.State.DONE, Augmentation.State.UNREADABLE])
def test_the_latest_picture_takes_part_also_of_an_unreadable_answer(state: str) -> None:
    cast = cast_of(contestants=("ann", "bob"), scenarios=1)
    place, ann = Scenario.objects.get(), Contestant.objects.get(slug="ann")
    latest = picture(place, ann, state=state)
    picture(place, ann, state=Augmentation.State.FAILED, image="")
    study = open_study(name="Round 1", votes_per_expert=1, seed=1, **cast)
    shown = {pk for pair in study.matchups.values_list("left", "right") for pk in pair}
    assert latest.pk in shown


def test_identical_pictures_are_never_shown() -> None:
    cast = cast_of(contestants=("ann", "bob"), scenarios=3)
    for slug in cast["contestants"]:
        place = Scenario.objects.get(slug="place-1")
        picture(place, Contestant.objects.get(slug=slug), image="bev/empty.png")
    study = open_study(name="Round 1", votes_per_expert=2, seed=1, **cast)
    shown = set(study.matchups.values_list("scenario__slug", flat=True))
    assert shown == {"place-0", "place-2"}
    assert study.rules["identical"] == [["place-1", "ann", "bob"]]


def test_missing_pictures_are_named_and_nothing_is_stored() -> None:
    cast = cast_of()
    Augmentation.objects.filter(contestant__slug="cid", scenario__slug="place-3").delete()
    Augmentation.objects.filter(contestant__slug="bob", scenario__slug="place-0").update(
        state="failed", finished_at=timezone.now()
    )
    with pytest.raises(NothingToPlan, match=r"of bob on place-0, cid on place-3\. Generate"):
        open_study(name="Round 1", votes_per_expert=4, seed=1, **cast)
    assert not Study.objects.exists()


def test_simulated_contestants_take_part_only_when_allowed() -> None:
    cast = cast_of(kind=KINDS.SIMULATED)
    with pytest.raises(Conflict, match="contestant ann, contestant bob"):
        open_study(name="Round 1", votes_per_expert=2, seed=1, **cast)
    allowed = open_study(name="Round 1", votes_per_expert=2, seed=1, allow_simulated=True, **cast)
    assert allowed.allow_simulated


def test_who_may_know_the_contestants_is_not_asked_to_vote() -> None:
    cast = cast_of()
    finn = User.objects.get(username="finn")
    finn.groups.add(Group.objects.get_or_create(name="researcher")[0])
    with pytest.raises(UnknownName, match=r"Unknown expert 'finn'. Known: eva"):
        open_study(name="Round 1", votes_per_expert=3, seed=7, **cast)


PLACES_M = {"ann": 20.0, "bob": 20.1, "cid": 20.3}


def opened_alike(*, show_alike: bool = True, scenarios: int = 4) -> Study:
    cast = cast_of(scenarios=scenarios, experts=("eva",))
    for row in Augmentation.objects.select_related("contestant"):
        car = vehicle("New1", PLACES_M[row.contestant.slug], 0.0)
        row.modification = modification_to_document(Modification(added=(car,)))
        row.save(update_fields=["modification"])
    return open_study(
        name="Round 1", votes_per_expert=2 * scenarios, seed=7, show_alike=show_alike, **cast
    )


def pairs_shown(study: Study) -> set[frozenset[str]]:
    rows = study.matchups.values_list("left__contestant__slug", "right__contestant__slug")
    return {frozenset(sides) for sides in rows}


def test_pairs_within_the_tolerance_are_ties_that_nobody_sees() -> None:
    study = opened_alike(show_alike=False)
    assert pairs_shown(study) == {frozenset({"ann", "cid"}), frozenset({"bob", "cid"})}
    again = plan(frozen_rules(study))
    assert len(again.matchups) == study.matchups.count()
    for matchup in study.matchups.all():
        vote(matchup, "left")
    found = vote_set(study, filters=Filters(), last=last_vote_id(study))
    ties = [line for line in found.counted if line.kind == "automatic"]
    # Eva judged each of the eight pairs that can be shown once, so she ties each of the four.
    assert {(tie.left, tie.right, tie.outcome) for tie in ties} == {("ann", "bob", "equal")}
    assert [tie.item for tie in ties] == [f"place-{number}" for number in range(4)]
    assert {tie.judge_name for tie in ties} == {found.counted[0].judge_name}


def test_a_tenth_of_them_is_shown_and_their_share_of_ties_is_told() -> None:
    study = opened_alike(show_alike=False, scenarios=20)
    shown = study.rules["alike_shown"]
    assert [pair[1:] for pair in shown] == [["ann", "bob"]] * 2
    assert len(study.rules["identical"]) == 18
    study = hand_in(study)
    (remark,) = [one for one in rate(study=study, rounds=20).results.board.warnings if "18" in one]
    seen = study.matchups.filter(left__contestant__slug__in=["ann", "bob"])
    seen = seen.filter(right__contestant__slug__in=["ann", "bob"])
    number = seen.count()
    assert number > 0
    assert f"Of {number} votes on 2 such pairs that were shown all the same, {number} " in remark
    assert remark.endswith("are ties (100 %).")


def hand_in(study: Study) -> Study:
    """Whoever is far off loses; alike ones tie."""
    for number, matchup in enumerate(study.matchups.all()):
        slugs = {matchup.left.contestant.slug, matchup.right.contestant.slug}
        vote(matchup, "equal" if slugs == {"ann", "bob"} else ("left", "right")[number % 2])
    return close_study(study=study)


def opened_by(cast: Cast, votes: int = 12, **options: object) -> Study:
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
    study = opened_by(cast_of(), repeats=25)
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
    study = opened_by(with_checks(), checks=25)
    checks = study.matchups.filter(kind="check")
    assert len(checks) == 6
    for row in checks.select_related("left__contestant", "right__contestant"):
        shown = {row.left.contestant.kind, row.right.contestant.kind}
        assert shown == {"reference", "check"}
    assert not study.contestants.filter(kind="check").exists()
    assert study.matchups.exclude(kind="check").filter(left__contestant__kind="check").count() == 0


def test_checks_drawn_in_another_window_stay_out_of_an_open_study() -> None:
    study = opened_by(with_checks(), votes=12, checks=25)
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


WHO = ("ann", "bob", "cid")
DRAWN = [2, 0, 2, 1, 2, 1]


def sampled(samples: int = 3, places: int = 6, name: str = "big", **columns: object) -> None:
    """A job of three contestants with so many samples of each scenario."""
    job = GenerationJob.objects.create(name=name, samples=samples)
    for slug in WHO:
        if not Contestant.objects.filter(slug=slug).exists():
            contestant(slug)
    for number in range(places):
        if not Scenario.objects.filter(slug=f"place-{number}").exists():
            scenario(f"place-{number}")
    Augmentation.objects.bulk_create(
        Augmentation(
            job=job,
            scenario=place,
            contestant=who,
            sample=sample,
            state=Augmentation.State.DONE,
            modification={},
            image=f"bev/{uuid.uuid4().hex}.png",
            finished_at=timezone.now(),
            **columns,
        )
        for place in Scenario.objects.order_by("slug")[:places]
        for who in Contestant.objects.filter(slug__in=WHO)
        for sample in range(1, samples + 1)
    )


def opened_of(seed: int = 7, votes: int = 9, places: int = 6, **rules: object) -> Study:
    for username in ("eva", "finn"):
        expert(username)
    return open_study(
        name="Round 1",
        contestants=WHO,
        scenarios=[f"place-{number}" for number in range(places)],
        experts=["eva", "finn"],
        votes_per_expert=votes,
        seed=seed,
        **rules,
    )


def shown(study: Study) -> set[tuple[str, int, int]]:
    rows = study.matchups.values_list("scenario__slug", "left__sample", "right__sample")
    return set(rows)


def test_one_sample_of_each_scenario_is_drawn_by_the_seed() -> None:
    # The rule is written down in docs/using.md; these were worked out with sha256sum.
    assert [draw_sample(7, f"place-{n}", 3) for n in range(6)] == DRAWN
    sampled()
    found = shown(opened_of())
    assert found == {(f"place-{n}", DRAWN[n] + 1, DRAWN[n] + 1) for n in range(6)}


def test_samples_are_pictures_of_their_own_in_all_that_is_counted() -> None:
    sampled(samples=2, places=2)
    write_changes()
    for number in range(2):
        same = Augmentation.objects.filter(scenario__slug=f"place-{number}", sample=1)
        same.exclude(contestant__slug="cid").update(image=f"bev/{number:032}.png")
    study = opened_of(votes=10, places=2, samples=SampleRule.ALL)
    study.rules["alike_shown"] = [["place-0#2", "ann", "bob"]]
    study.save()
    study = vote_all(study)
    results = rate(study=study, rounds=10).results
    assert results.trust.agreement
    assert (results.trust.agreement.units, results.trust.tie_share) == (10, 0.0)
    assert "Of 2 votes on 1 such pairs" in " ".join(results.board.warnings)
    columns = [*(sheet := preference_sheet(study)).columns]
    rows = [dict(zip(columns, row, strict=True)) for row in sheet.rows]
    named = {str(row[f"augmentation_{side}"]) for row in rows if row["settled"] for side in "ab"}
    assert [row.sample for row in Augmentation.objects.filter(code__in=named)] == [1] * 4


def test_options_are_not_mixed_under_one_contestant() -> None:
    sampled(samples=1, name="cool", options={"temperature": 0.2, "seed": 1})
    sampled(samples=1, name="hot", places=3, options={"temperature": 0.9, "seed": 1})
    with pytest.raises(Conflict) as refused:
        opened_of()
    said = str(refused.value)
    assert "were made with different options" in said
    assert "in the jobs cool, hot" in said
    assert not Study.objects.exists()


def test_a_study_shows_the_jobs_that_it_names(capsys: pytest.CaptureFixture[str]) -> None:
    sampled(samples=1, name="cool", options={"temperature": 0.2})
    sampled(samples=1, name="hot", options={"temperature": 0.9})
    for username in ("eva", "finn"):
        expert(username)
    call_command(
        *("open_study", "Round 1", "--contestants", *WHO, "--scenarios", "all", "--experts"),
        *("eva", "finn", "--votes-per-expert", "6", "--seed", "1", "--jobs", "cool"),
    )
    assert "It shows augmentations of 'cool'" in capsys.readouterr().out
    study = Study.objects.get()
    assert {row.left.job.name for row in study.matchups.all()} == {"cool"}
    assert [job["name"] for job in study.rules["jobs"]] == ["cool"]
    assert study.rules["options"]["ann"] == {"temperature": 0.2}
    page = signed_in(people()["admin"]).get(reverse("study", args=[study.code]))
    assert "Shown are augmentations of" in page.content.decode()
