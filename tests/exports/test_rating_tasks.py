"""Big ratings are a worker's job: the task, and what happens without a queue."""

import pytest
from django.urls import reverse

from arena.models import Snapshot
from arena.results.services.ratings import CLOSED_FORM_FROZEN, RATINGS, is_big, plan_snapshot
from arena.studies.services.opening import close_study
from augment.models import Event
from tests.study_rows import a_study, vote
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def planned() -> Snapshot:
    study = a_study(votes_per_expert=3)
    for matchup in study.matchups.all():
        vote(matchup)
    return plan_snapshot(study=close_study(study=study), rounds=10)


def test_intervals_are_those_that_were_preregistered() -> None:
    study = planned().study
    assert study.snapshots.get().intervals == "bootstrap"
    frozen = study.preregistration.replace(
        "bootstrap with random effects of experts and of scenarios", CLOSED_FORM_FROZEN
    )
    assert frozen != study.preregistration
    study.preregistration = frozen
    chosen = [plan_snapshot(study=study, intervals=way).intervals for way in (None, "bootstrap")]
    assert chosen == ["closed", "bootstrap"]


def test_the_task_computes_what_was_planned_and_a_second_message_changes_nothing() -> None:
    snapshot = planned()
    assert not is_big(snapshot.study)
    for _ in range(2):
        RATINGS.perform(snapshot.pk)
    snapshot.refresh_from_db()
    assert (snapshot.state, snapshot.votes_counted) == (Snapshot.State.READY, 6)
    assert snapshot.standings.count() == 3
    RATINGS.perform(0)  # a row that is gone is no fault


def test_a_rating_that_breaks_in_an_unforeseen_way_says_so_and_can_be_asked_for_again(
    caplog: pytest.LogCaptureFixture,
) -> None:
    snapshot = planned()
    kept = snapshot.filters
    Snapshot.objects.filter(pk=snapshot.pk).update(filters={"kinds": 7})  # no list: a TypeError
    RATINGS.perform(snapshot.pk)
    snapshot.refresh_from_db()
    assert snapshot.state == Snapshot.State.FAILED
    assert snapshot.reason.startswith("unexpected: TypeError: ")
    assert f"snapshot {snapshot.pk}" in caplog.text
    assert "Traceback" in caplog.text
    event = Event.objects.get(verb="rating failed")
    assert event.after == {"snapshot": str(snapshot.code), "why": snapshot.reason}
    researcher = signed_in(people()["researcher"])
    page = researcher.get(reverse("results", args=[snapshot.study.code])).content.decode()
    assert "could not be computed: unexpected: TypeError" in page
    assert reverse("rating-again", args=[snapshot.study.code, snapshot.code]) in page
    Snapshot.objects.filter(pk=snapshot.pk).update(filters=kept)
    researcher.post(reverse("rating-again", args=[snapshot.study.code, snapshot.code]))
    RATINGS.perform(snapshot.pk)
    snapshot.refresh_from_db()
    assert (snapshot.state, snapshot.reason != "", snapshot.progress) == ("ready", True, 100)
