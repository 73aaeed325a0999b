"""Displacement and scores of stored rows; the street's cones are at (20, 0.5) and (25, -0.5)."""

import math

import pytest
from pytest_django import DjangoAssertNumQueries

from augment.metrics.displacement import MISS_M, displacement
from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from augment.scene.codec import modification_to_document, recording_to_document
from augment.scene.entities import Modification
from augment.scene.planned_motion import AtTime, LanePath, NearEgo, PlannedMotion, Trigger
from augment.services.judging.analyses import augmentation_lines
from augment.services.judging.displacement import By, Group, MissingReason, groups, of_job
from augment.services.judging.metric_scores import MetricScores, metric_scores
from tests.drives import driven
from tests.jobs import rows
from tests.metrics.test_over_time import recorded_at, starts
from tests.scene.test_planned_motion import two_lanes, with_motion
from tests.scenes import cone, vehicle
from tests.study_rows import contestant, picture, scenario

pytestmark = pytest.mark.django_db

NEAR = Modification(added=(cone("Agent2", 20.0, 1.5), cone("Agent3", 25.0, 1.5)))  # 1 m and 2 m


def ended(
    job: GenerationJob,
    scenario: Scenario,
    contestant: Contestant,
    *,
    state: str = Augmentation.State.DONE,
    change: Modification = NEAR,
) -> Augmentation:
    is_done = state == Augmentation.State.DONE
    made, image = (change, "bev/x.png") if is_done else (None, "")
    return rows.add_answer(job, scenario, contestant, made, state=state, image=image)


def a_job() -> GenerationJob:
    return GenerationJob.objects.create(name="Round 1")


def only(found: list[Group]) -> Group:
    assert len(found) == 1
    return found[0]


def test_a_job_is_summed_up_per_contestant() -> None:
    job, one, two = a_job(), rows.add_scenario("one"), rows.add_scenario("two")
    ann = rows.add_kind("ann", Contestant.Kind.SIMULATED)
    ended(job, one, ann)
    ended(job, two, ann, state="unreadable")
    group = only(groups(of_job(job), by=By.CONTESTANT))
    assert (group.heading, group.contestant.slug) == ("ann", "ann")
    assert (group.summary.augmentations, group.summary.n) == (2, 2)
    assert (group.summary.missing, group.summary.surplus) == (2, 0)
    assert group.summary.box.mean_m == pytest.approx(1.5)


def test_what_cannot_be_measured_says_why_and_counts_nowhere() -> None:
    job, ann = a_job(), rows.add_kind("ann")
    ended(job, rows.add_scenario("bare", reference=None), ann)
    ended(job, rows.add_scenario("broken"), ann, state="failed")
    odd = ended(job, rows.add_scenario("odd"), ann)
    Augmentation.objects.filter(pk=odd.pk).update(modification={})
    found = of_job(job)
    assert {one.row.scenario.slug: one.why_not for one in found} == {
        "bare": MissingReason.NO_REFERENCE,
        "broken": MissingReason.UNFINISHED,
        "odd": MissingReason.UNREADABLE_ROW,
    }
    assert groups(found, by=By.TYPE) == []


def moving(slug: str) -> Scenario:
    """A car starts 15 m before a recorded ego at 4 m/s: after 3.9 s, were it 8 m/s after 2.0 s."""
    reference = modification_to_document(starts(NearEgo(within_m=15.0)))
    row = rows.add_scenario(
        slug, scene=two_lanes(), reference=reference, intent=None, intent_origin=""
    )
    row.base_scene.recording = recording_to_document(recorded_at(4.0))
    row.base_scene.save()
    return row


def test_what_moves_is_followed_beside_the_recorded_ego_whose_scene_is_read_once(
    django_assert_num_queries: DjangoAssertNumQueries,
) -> None:
    job, one, still = a_job(), moving("one"), rows.add_scenario("still")
    begins: dict[str, Trigger] = {"ann": AtTime(after_s=3.9), "bea": NearEgo(within_m=3.0)}
    for slug, start in begins.items():
        ended(job, one, rows.add_kind(slug, Contestant.Kind.RULE), change=starts(start))
        ended(job, still, rows.add_kind(f"{slug}-2"))
    # Rows, their scenarios and contestants; keys of rows and of scenarios, what is stored; rows
    # with theirs, one scene; what is stored then. The same of distances to the wish.
    with django_assert_num_queries(17):
        of_job(job)
    with django_assert_num_queries(9):  # read from the store
        found = of_job(job)
    over_time = [line.displacement.over_time for line in found if line.displacement is not None]
    assert over_time[0].average_m == pytest.approx(0.0)
    # 5 (t - 3.9) from 3.9 s on.
    assert over_time[1].average_m == pytest.approx(0.5 * sum(range(22)) / 61)
    assert over_time[2:] == [None, None]
    wished, compared, *_ = metric_scores([row.row.pk for row in found])
    assert (wished.name, compared.name) == ("Distance to the wish", "Displacement")
    scores = compared.by_code
    assert scores[str(found[1].row.code)] == pytest.approx(-over_time[1].average_m)
    lines = {line.row.pk: line for line in augmentation_lines(job)}
    assert lines[found[1].row.pk].doubtful == 1  # its motion never begins


def test_a_motion_that_its_scene_cannot_carry_is_not_measured() -> None:
    job, one = a_job(), moving("one")
    odd = with_motion(
        vehicle("Agent2", 30.0, 3.5), PlannedMotion(path=LanePath(lane_ids=("Lane9",)))
    )
    ended(job, one, rows.add_kind("ann"), change=Modification(added=(odd,)))
    assert [found.why_not for found in of_job(job)] == [MissingReason.UNFIT_MOTION]


REFERENCE = Modification(added=(vehicle("Agent2", 20.0, 0.0), cone("Agent3", 30.0, 0.0)))


@pytest.mark.parametrize(
    ("made", "error_m"),
    [
        (REFERENCE, 0.0),
        (Modification(added=(vehicle("Agent2", 21.0, 0.0), cone("Agent3", 33.0, 0.0))), 2.0),
        (
            Modification(added=(vehicle("Agent2", 90.0, 0.0), cone("Agent3", 30.0, 0.0))),
            MISS_M / 2,
        ),
        (Modification(added=(vehicle("Agent2", 20.0, 0.0),)), MISS_M / 2),
        (Modification(added=(*REFERENCE.added, cone("Agent4", 9.0, 0.0))), MISS_M / 3),
        (None, MISS_M),
    ],
    ids=["same", "off", "far", "missing", "surplus", "unreadable"],
)
def test_a_number_says_how_far_a_change_is_off(made: Modification | None, error_m: float) -> None:
    assert displacement(made, REFERENCE).error_m == pytest.approx(error_m)
    assert displacement(Modification(), Modification()).error_m == 0.0


@pytest.mark.django_db
def test_more_is_better_and_what_is_unknown_is_missing() -> None:
    place = scenario("place")
    place.reference = modification_to_document(REFERENCE)
    place.save()
    rows = {slug: picture(place, contestant(slug)) for slug in ("good", "bad", "none")}
    rows["reference"] = picture(place, contestant("reference", Contestant.Kind.REFERENCE))
    twice = Modification(added=(vehicle("Agent2", 25.0, 0.0), vehicle("Agent3", 25.5, 0.0)))
    changes = {"good": REFERENCE, "bad": twice, "reference": REFERENCE}
    for slug, change in changes.items():
        document = modification_to_document(change)
        Augmentation.objects.filter(pk=rows[slug].pk).update(modification=document)
    Augmentation.objects.filter(pk=rows["none"].pk).update(
        state=Augmentation.State.UNREADABLE, modification=None
    )
    driven(rows["good"].job, after=0.25, planner="idm")
    rows["good"].simulations.update(interplan_score=0.75)

    found = {scores.name: scores for scores in metric_scores([row.pk for row in rows.values()])}

    def of(metric: str, slug: str) -> float | None:
        scores: MetricScores = found[metric]
        return scores.by_code.get(str(rows[slug].code))

    assert of("Displacement", "good") == 0.0
    assert of("Displacement", "none") == -MISS_M
    assert of("Displacement", "reference") is None
    good, bad = of("Checks", "good"), of("Checks", "bad")
    assert good > bad
    assert of("Checks", "none") == -math.inf
    assert of("Driving score (nuPlan)", "good") == -0.25
    assert of("Driving score (interPlan)", "good") == -0.75
    assert of("Driving score (nuPlan)", "none") is None
