"""Rows without a modification, grouped by their cause, and one group tried again."""

from __future__ import annotations

import pytest
from django.db import connection
from django.test.utils import CaptureQueriesContext

from arena.services.retrying import retry_cause as retry_unless_shown
from augment.models import Augmentation, GenerationJob, ModelCall
from augment.services.running import jobs, runner
from augment.services.running import jobs as retrying
from augment.services.running.progress import cause_of, failure_groups
from tests.jobs.models import Model, llama_job, reply
from tests.jobs.rows import failed, launch, leased, only_row
from tests.variants.playing import GOOD

pytestmark = pytest.mark.django_db
State = Augmentation.State


@pytest.mark.parametrize(
    ("reason", "other", "are_alike"),
    [
        ("HTTP 429: slow down, try in 3 s", "HTTP 429: slow down, try in 17.5 s", True),
        ("HTTP 429: slow down", "HTTP 503: slow down", False),
        ("request req_9f31ab20c4de77aa broke", "request req_0011ab20c4de77ff broke", True),
        (
            "no 3f2504e0-4f89-11d3-9a0c-0305e82c3301",
            "no 3f2504e0-4f89-11d3-9a0c-0305e82c3302",
            True,
        ),
        ("line 3 column 7: no block", "line 12 column 1: no block", True),
        ("Lane3 is unknown", "Lane4 is unknown", False),
        ("the wire broke", "the  wire\nbroke", True),
        ("gpt-4 answered nothing", "gpt-5 answered nothing", False),
    ],
)
def test_reasons_have_one_cause_where_only_numbers_and_ids_differ(
    reason: str, other: str, are_alike: bool
) -> None:
    assert (cause_of(reason) == cause_of(other)) is are_alike


def broken(job: GenerationJob, *reasons: str) -> None:
    for row, reason in zip(job.augmentations.order_by("pk"), reasons, strict=True):
        leased(row).settle(failed(reason))
    jobs.finish_if_over()


def test_an_unreadable_answer_is_asked_for_anew_and_not_served_again() -> None:
    said = ["Sorry?", "Sorry, what?", GOOD]
    model = Model(lambda request: reply(said.pop(0)))
    job = llama_job()
    row = only_row(job)
    runner.work_on(augmentation_pk=row.pk, connect=model)
    row.refresh_from_db()
    assert row.state == State.UNREADABLE
    (group,) = failure_groups(job)
    retrying.retry_cause(job, key=group.key)
    row.refresh_from_db()
    assert (row.image, row.state) == ("", State.QUEUED)
    runner.work_on(augmentation_pk=row.pk, connect=model)
    row.refresh_from_db()
    assert (row.state, len(model.requests)) == (State.DONE, 3)
    assert not ModelCall.objects.exclude(served_from=None).exists()
    assert list(row.attempts.values_list("outcome", flat=True)) == ["unreadable", "done"]


def test_the_scenarios_are_held_before_somebody_looks_who_is_shown_a_row() -> None:
    """Else a study could open with it between the look and the second try."""
    job = launch(scenarios=2)
    broken(job, "HTTP 429: slow down", "HTTP 429: slow down")
    (group,) = failure_groups(job)
    with CaptureQueriesContext(connection) as seen:
        retry_unless_shown(job, key=group.key)
    asked = [one["sql"] for one in seen]
    look = next(n for n, sql in enumerate(asked) if "arena_matchup" in sql)
    held = next(n for n, sql in enumerate(asked) if 'FROM "augment_scenario"' in sql)
    assert held < look
