"""Big ratings are a worker's job: the task, and what happens without a queue."""

from datetime import timedelta

import pytest
from django.urls import reverse
from django.utils import timezone

from arena.models import Snapshot
from arena.results.services.ratings import RATINGS, is_big, plan_snapshot
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


def test_the_task_computes_what_was_planned_and_a_second_message_changes_nothing() -> None:
    snapshot = planned()
    assert not is_big(snapshot.study)
    for _ in range(2):
        RATINGS.perform(snapshot.pk)
    snapshot.refresh_from_db()
    assert (snapshot.state, snapshot.votes_counted) == (Snapshot.State.READY, 6)
    assert snapshot.standings.count() == 3
    RATINGS.perform(0)  # a row that is gone is no fault


def test_of_two_workers_with_the_same_message_the_first_to_end_counts() -> None:
    snapshot = planned()
    kept: list[int] = []

    slow = RATINGS.take(snapshot.pk, now=timezone.now() - timedelta(minutes=1))
    assert slow is not None
    RATINGS.take_back_lost()
    assert RATINGS.perform(snapshot.pk)
    kept.extend(snapshot.standings.order_by("pk").values_list("pk", flat=True))
    RATINGS.work(slow)
    snapshot.refresh_from_db()
    assert (snapshot.state, snapshot.progress) == (Snapshot.State.READY, 100)
    assert list(snapshot.standings.order_by("pk").values_list("pk", flat=True)) == kept
    assert len(kept) == 3


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
    analyst = signed_in(people()["analyst"])
    page = analyst.get(reverse("results", args=[snapshot.study.code])).content.decode()
    assert "could not be computed: unexpected: TypeError" in page
    assert reverse("rating-again", args=[snapshot.study.code, snapshot.code]) in page
    Snapshot.objects.filter(pk=snapshot.pk).update(filters=kept)
    analyst.post(reverse("rating-again", args=[snapshot.study.code, snapshot.code]))
    RATINGS.perform(snapshot.pk)
    snapshot.refresh_from_db()
    assert (snapshot.state, snapshot.reason != "", snapshot.progress) == ("ready", True, 100)
