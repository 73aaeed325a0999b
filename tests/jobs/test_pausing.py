"""A paused job starts nothing, loses nothing that runs, and goes on exactly with what is left."""

from __future__ import annotations

from datetime import timedelta

import pytest

from augment.models import Augmentation, Event, GenerationJob
from augment.services.running import jobs, runner
from augment.services.running import jobs as pausing
from augment.services.running.budget import Caps
from augment.services.running.progress import count_rows
from augment.services.running.runner import AUGMENTATIONS
from tests.jobs.models import Model, after_a_second_look, llama_job
from tests.jobs.rows import done, launch, leased, only_row

pytestmark = pytest.mark.django_db
State = Augmentation.State
Job = GenerationJob.State


def test_a_paused_job_starts_nothing_and_what_is_in_flight_keeps_its_result() -> None:
    job = launch(scenarios=3)
    first, second, third = job.augmentations.order_by("pk")
    held = leased(first)
    job = pausing.pause(job)
    assert job.state == Job.PAUSED
    assert Event.objects.get(verb="pause").after == {
        "state": "paused", "waiting": 2, "in_flight": 1,
    }  # fmt: skip
    assert AUGMENTATIONS.take(second.pk) is None
    assert AUGMENTATIONS.find_unsent(older_than=timedelta(0)) == []
    assert count_rows(job).is_moving, "one is in flight"
    assert held.settle(done())
    assert not count_rows(job).is_moving
    jobs.finish_if_over()
    job = pausing.resume(job)
    assert job.state == Job.RUNNING
    assert Event.objects.get(verb="resume").before == {"state": "paused"}
    assert AUGMENTATIONS.find_unsent(older_than=timedelta(0)) == [second.pk, third.pk]
    first.refresh_from_db()
    assert first.state == State.DONE


def test_all_calls_of_what_is_in_flight_are_made_though_the_job_is_paused_between_them() -> None:
    def pause_once() -> None:
        if GenerationJob.objects.get().state == Job.RUNNING:
            pausing.pause(GenerationJob.objects.get())

    model = Model(after_a_second_look, looking_on=pause_once)
    row = only_row(llama_job(caps=Caps(calls=9)))
    assert runner.work_on(augmentation_pk=row.pk, connect=model)
    row.refresh_from_db()
    assert (row.state, len(model.requests)) == (State.DONE, 2)
    assert GenerationJob.objects.get().state == Job.FINISHED, "nothing is left to resume"
