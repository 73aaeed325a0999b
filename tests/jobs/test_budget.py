"""Reserving before a call, settling after it, and what becomes of what nobody saw the end of."""

from __future__ import annotations

from datetime import timedelta
from decimal import Decimal

import pytest
from django.utils import timezone

from augment.errors import EndpointBusy, LeaseLost, ModelFault
from augment.llm.costs import Price, WorstCase
from augment.llm.messages import Reply
from augment.models import Attempt, Augmentation, Event, GenerationJob, ModelCall
from augment.services.running import budget, jobs, runner
from augment.services.running import budget as caps
from augment.services.running.budget import Caps, Room, costs_of
from augment.services.running.runner import AUGMENTATIONS, Held
from tests.jobs.models import Model, after_a_second_look, llama_job, reply
from tests.jobs.rows import NOON, STALE, only_row
from tests.variants.playing import GOOD

pytestmark = pytest.mark.django_db

ROW, JOB = Augmentation.State, GenerationJob.State
ONE_USD = Price(prompt_usd=Decimal(1), completion_usd=Decimal(1))
WORST = WorstCase(prompt_tokens=600, completion_tokens=400)


def ran(job: GenerationJob, model: Model | None = None) -> Augmentation:
    row = only_row(job)
    runner.work_on(augmentation_pk=row.pk, worker="w", connect=model or Model())
    row.refresh_from_db()
    job.refresh_from_db()
    return row


def test_a_call_turns_its_reservation_into_what_it_used() -> None:
    job = llama_job(price="2")
    assert ran(job).state == ROW.DONE
    call = ModelCall.objects.get()
    assert call.spent_tokens == 3020 < call.reserved_tokens
    assert call.reserved_usd == 2 * Decimal(call.reserved_tokens) / 1_000_000
    assert (call.cost_usd, call.is_cost_estimated) == (Decimal("0.00604"), False)
    assert (job.spent_usd, job.spent_calls, job.spent_tokens) == (Decimal("0.00604"), 1, 3020)
    assert (job.reserved_nano_usd, job.reserved_calls, job.reserved_tokens) == (0, 0, 0)


def test_unknown_usage_counts_with_its_worst_case_and_says_so() -> None:
    job = llama_job(price="1")
    ran(job, Model(lambda request: Reply(text=GOOD)))
    call = ModelCall.objects.get()
    assert (call.prompt_tokens, call.completion_tokens) == (None, None)
    assert call.spent_tokens == call.reserved_tokens == job.spent_tokens
    assert (call.cost_usd, call.is_cost_estimated) == (call.reserved_usd, True)


@pytest.mark.parametrize(
    ("fault", "is_billed"),
    [
        (ModelFault("no such model", retryable=False, status=404), False),
        (ModelFault("upstream broke", retryable=False, status=500), False),
        (ModelFault("too slow", retryable=False), True),
        (ModelFault("no choice", retryable=False, status=200), True),
    ],
)
def test_a_fault_counts_where_it_may_be_billed(fault: ModelFault, is_billed: bool) -> None:
    job = llama_job(price="1")
    ran(job, Model(fault))
    call = ModelCall.objects.get()
    assert call.spent_tokens == (call.reserved_tokens if is_billed else 0)
    assert call.is_cost_estimated == is_billed
    assert job.spent_calls == 1
    assert job.reserved_calls == job.reserved_tokens == 0


def test_a_call_that_found_no_place_counts_nothing() -> None:
    job = llama_job(price="1", caps=Caps(usd=Decimal(1)))
    row = ran(job, Model(EndpointBusy("local", 1800.0)))
    assert row.state == ROW.FAILED
    assert_nothing_is_counted(job)


@pytest.mark.parametrize("queue_finds_out", [True, False])
def test_a_claim_that_is_lost_before_a_call_is_sent_costs_nothing(queue_finds_out: bool) -> None:
    job = llama_job(price="1", caps=Caps(usd=Decimal(1)))
    row = only_row(job)

    def lose_the_claim() -> None:
        """Another worker takes the row while the call waits for its place."""
        AUGMENTATIONS.take_back_lost(now=timezone.now() + 2 * STALE)
        assert_nothing_is_counted(job)
        if queue_finds_out:
            raise LeaseLost

    model = Model(waiting=lose_the_claim)
    assert ran(job, model).state == ROW.QUEUED
    assert model.requests == []
    assert_nothing_is_counted(job)
    call = ModelCall.objects.get(attempt__augmentation=row)
    assert (call.sent_at, call.cost_usd, call.is_cost_estimated) == (None, Decimal(0), False)
    assert call.fault == "not sent: the row was taken back"


def assert_nothing_is_counted(job: GenerationJob) -> None:
    job.refresh_from_db()
    assert (job.spent_calls, job.spent_tokens, job.spent_nano_usd) == (0, 0, 0)
    assert (job.reserved_calls, job.reserved_tokens, job.reserved_nano_usd) == (0, 0, 0)


def test_a_job_that_has_no_room_for_a_call_asks_nothing_and_is_stopped() -> None:
    job = llama_job(caps=Caps(tokens=5))
    model = Model()
    row = ran(job, model)
    assert model.requests == []
    assert (row.state, row.claim, row.reason) == (ROW.QUEUED, None, "")
    assert job.state == JOB.STOPPED_AT_CAP
    attempt = row.attempts.get()
    assert attempt.outcome == "stopped at cap"
    assert "5 tokens" in attempt.reason
    event = Event.objects.get(verb="stop")
    assert event.after == {"state": "stopped_at_cap", "cap": "5 tokens"}
    assert AUGMENTATIONS.take(row.pk, now=NOON) is None
    assert AUGMENTATIONS.find_unsent(now=NOON, older_than=STALE) == []


def test_a_stopped_attempt_is_replayed_from_its_answers_also_in_a_fresh_job() -> None:
    job = llama_job(caps=Caps(calls=1), is_fresh=True)
    model = Model(after_a_second_look)
    assert ran(job, model).state == ROW.QUEUED
    caps.raise_cap(job, caps=Caps(calls=2))
    jobs.resume(job)
    assert ran(job, model).state == ROW.DONE
    assert len(model.requests) == len(set(model.requests)) == 2
    served = ModelCall.objects.get(served_from__isnull=False)
    assert served.attempt is not None
    assert (served.attempt.number, served.number, served.answer) == (2, 1, "Sorry?")
    assert (served.cost_nano_usd, served.spent_tokens) == (0, 0)
    assert served.served_from is not None
    assert served.served_from.attempt is not None
    assert served.served_from.attempt.number == 1
    assert job.spent_calls == 2


def test_a_call_of_a_dead_worker_counts_with_its_worst_case() -> None:
    job = llama_job(price="1")
    row = only_row(job)
    long_ago = timezone.now() - timedelta(minutes=1)
    held = AUGMENTATIONS.take(row.pk, now=long_ago)
    assert held is not None
    in_flight(job, held)
    AUGMENTATIONS.take_back_lost(now=timezone.now())
    job.refresh_from_db()
    assert (job.reserved_calls, job.spent_calls) == (0, 1)
    assert (job.spent_tokens, job.spent_nano_usd) == (1000, 1_000_000)
    call = ModelCall.objects.get()
    assert call.is_cost_estimated
    assert call.fault == "nobody saw the end: its worker stopped"


def test_a_call_that_waited_when_its_worker_died_counts_nothing() -> None:
    job = llama_job(price="1")
    held = AUGMENTATIONS.take(only_row(job).pk, now=timezone.now() - timedelta(minutes=1))
    assert held is not None
    in_flight(job, held, is_sent=False)
    AUGMENTATIONS.take_back_lost(now=timezone.now())
    assert_nothing_is_counted(job)
    call = ModelCall.objects.get()
    assert (call.cost_usd, call.spent_tokens, call.is_cost_estimated) == (Decimal(0), 0, False)
    assert call.fault == "not sent: its worker stopped while it waited for a place"
    assert costs_of(job).paid == 0


def test_a_worker_that_was_only_slow_corrects_what_its_call_used() -> None:
    job = llama_job(price="1")
    row = only_row(job)
    held = AUGMENTATIONS.take(row.pk, now=timezone.now() - timedelta(minutes=1))
    assert held is not None
    call = in_flight(job, held)
    AUGMENTATIONS.take_back_lost(now=timezone.now())
    used = budget.used_by_reply(reply(), worst=WORST, price=ONE_USD)
    budget.settle(call_pk=call.pk, used=used, now=timezone.now())
    job.refresh_from_db()
    assert (job.spent_calls, job.spent_tokens, job.spent_nano_usd) == (1, 3020, 3_020_000)
    assert (job.reserved_calls, job.reserved_tokens) == (0, 0)


def in_flight(job: GenerationJob, held: Held, *, is_sent: bool = True) -> ModelCall:
    assert budget.reserve(job_pk=job.pk, worst=WORST, price=ONE_USD) == Room.TAKEN
    return ModelCall.objects.create(
        attempt=Attempt.objects.get(augmentation=held.pk),
        number=1,
        role="modifier",
        request={},
        started_at=timezone.now(),
        sent_at=timezone.now() if is_sent else None,
        reserved_tokens=WORST.tokens,
        reserved_nano_usd=WORST.nano_usd(ONE_USD),
    )
