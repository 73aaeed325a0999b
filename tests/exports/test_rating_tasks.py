"""Big ratings are a worker's job: the task, and what happens without a queue."""

from __future__ import annotations

import pytest
from django.urls import reverse

from arena import tasks
from arena.models import Snapshot
from arena.services.ratings import is_big, plan_snapshot
from arena.services.snapshots import compute, keep, note_progress
from arena.services.studies import close_study
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
        tasks.compute_snapshot(snapshot.pk)
    snapshot.refresh_from_db()
    assert (snapshot.state, snapshot.votes_counted) == (Snapshot.State.READY, 6)
    assert snapshot.standings.count() == 3
    tasks.compute_snapshot(0)  # a row that is gone is no fault


def test_of_two_workers_with_the_same_message_the_first_to_end_counts() -> None:
    snapshot = planned()
    kept: list[int] = []

    def other_worker(percent: int) -> None:
        """Brings it to its end while this one has hardly begun."""
        if not kept:
            tasks.compute_snapshot(snapshot.pk)
            kept.extend(snapshot.standings.order_by("pk").values_list("pk", flat=True))
        note_progress(snapshot_pk=snapshot.pk, percent=percent)
        assert Snapshot.objects.get(pk=snapshot.pk).state == Snapshot.State.READY

    mine = Snapshot.objects.get(pk=snapshot.pk)
    second = keep(mine, compute(mine, other_worker))
    assert second.state == Snapshot.State.READY
    assert list(snapshot.standings.order_by("pk").values_list("pk", flat=True)) == kept
    assert len(kept) == 3


def test_a_rating_that_breaks_in_an_unforeseen_way_says_so_and_can_be_asked_for_again(
    caplog: pytest.LogCaptureFixture,
) -> None:
    snapshot = planned()
    kept = snapshot.filters
    Snapshot.objects.filter(pk=snapshot.pk).update(filters={"kinds": 7})  # no list: a TypeError
    tasks.compute_snapshot(snapshot.pk)
    snapshot.refresh_from_db()
    assert snapshot.state == Snapshot.State.FAILED
    assert snapshot.status.startswith("TypeError: ")
    assert str(snapshot.code) in caplog.text
    assert "Traceback" in caplog.text
    event = Event.objects.get(verb="rating failed")
    assert event.after == {"snapshot": str(snapshot.code), "why": snapshot.status}
    analyst = signed_in(people()["analyst"])
    page = analyst.get(reverse("results", args=[snapshot.study.code])).content.decode()
    assert "could not be computed: TypeError" in page
    assert reverse("rating-again", args=[snapshot.study.code, snapshot.code]) in page
    Snapshot.objects.filter(pk=snapshot.pk).update(filters=kept)
    tasks.compute_snapshot(snapshot.pk)
    snapshot.refresh_from_db()
    assert (snapshot.state, snapshot.status != "", snapshot.progress) == ("ready", True, 100)
