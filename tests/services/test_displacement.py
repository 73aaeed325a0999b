"""Displacement of stored rows; the street's reference has cones at (20, 0.5) and (25, -0.5)."""

import pytest

from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.judging.displacement import By, Group, Unmeasured, groups, of_job
from tests.jobs import rows
from tests.scenes import cone

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
    return Augmentation.objects.create(
        job=job,
        scenario=scenario,
        contestant=contestant,
        state=state,
        modification=modification_to_document(change) if is_done else None,
        image="bev/x.png" if is_done else "",
    )


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
    assert group.summary.box is not None
    assert group.summary.box.mean_m == pytest.approx(1.5)


def test_what_cannot_be_measured_says_why_and_counts_nowhere() -> None:
    job, ann = a_job(), rows.add_kind("ann")
    ended(job, rows.add_scenario("bare", reference=None), ann)
    ended(job, rows.add_scenario("broken"), ann, state="failed")
    odd = ended(job, rows.add_scenario("odd"), ann)
    Augmentation.objects.filter(pk=odd.pk).update(modification={})
    found = of_job(job)
    assert {one.row.scenario.slug: one.why_not for one in found} == {
        "bare": Unmeasured.NO_REFERENCE,
        "broken": Unmeasured.UNFINISHED,
        "odd": Unmeasured.UNREADABLE_ROW,
    }
    assert groups(found, by=By.TYPE) == []
