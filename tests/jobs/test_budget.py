"""Reserving before a call, settling after it, and what becomes of what nobody saw the end of."""

from __future__ import annotations

from datetime import timedelta
from decimal import Decimal

import pytest
from django.utils import timezone

from augment.errors import Conflict, EndpointBusy, ModelFault
from augment.llm.costs import Price, WorstCase
from augment.llm.messages import Reply
from augment.models import Augmentation, EndpointModel, Event, GenerationJob, ModelCall
from augment.services import budget, caps, claims, jobs, runner
from augment.services.budget import Room
from augment.services.caps import Caps
from tests.jobs.models import Model, add_llama, after_a_second_look, llama_job, reply
from tests.jobs.rows import NOON, STALE, add_scenario, launch, only_row
from tests.variants.answers import GOOD

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


def test_an_unknown_price_leaves_the_cost_unknown() -> None:
    job = llama_job()
    ran(job)
    call = ModelCall.objects.get()
    assert (call.cost_usd, call.reserved_usd, call.spent_tokens) == (None, None, 3020)
    assert (job.spent_calls, job.spent_tokens) == (1, 3020)


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
        (EndpointBusy("local", 1800.0), False),
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


def test_each_attempt_at_a_request_is_a_reservation_of_its_own() -> None:
    job = llama_job(caps=Caps(calls=2))
    passing = ModelFault("busy", retryable=True, status=503, retry_after_s=0.001)
    model = Model(passing)
    row = ran(job, model)
    assert len(model.requests) == 2
    assert (job.state, job.spent_calls, row.state) == (JOB.STOPPED_AT_CAP, 2, ROW.QUEUED)


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
    assert claims.claim(augmentation_pk=row.pk, now=NOON) is None
    assert claims.unsent(now=NOON, older_than=STALE) == []


def test_what_is_over_at_a_cap_that_is_just_reached_finishes() -> None:
    job = llama_job(caps=Caps(calls=1))
    assert ran(job).state == ROW.DONE
    assert job.state == JOB.FINISHED


def test_a_stopped_attempt_is_replayed_from_its_answers_also_in_a_fresh_job() -> None:
    job = llama_job(caps=Caps(calls=1), is_fresh=True)
    model = Model(after_a_second_look)
    assert ran(job, model).state == ROW.QUEUED
    caps.raise_cap(job, caps=Caps(calls=2))
    caps.resume(job)
    assert ran(job, model).state == ROW.DONE
    assert len(model.requests) == len(set(model.requests)) == 2
    served = ModelCall.objects.get(served_from__isnull=False)
    assert (served.attempt.number, served.number, served.answer) == (2, 1, "Sorry?")
    assert (served.cost_nano_usd, served.spent_tokens) == (0, 0)
    assert served.served_from is not None
    assert served.served_from.attempt.number == 1
    assert job.spent_calls == 2


def test_room_that_calls_in_flight_hold_is_waited_for() -> None:
    job = launch()
    GenerationJob.objects.filter(pk=job.pk).update(cap_tokens=1500)

    def reserve() -> Room:
        return budget.reserve(job_pk=job.pk, worst=WORST, price=None)

    assert [reserve(), reserve()] == [Room.TAKEN, Room.BUSY]
    job.refresh_from_db()
    assert job.state == JOB.RUNNING
    GenerationJob.objects.filter(pk=job.pk).update(reserved_tokens=0, spent_tokens=501)
    assert [reserve(), reserve()] == [Room.SPENT, Room.SPENT]
    job.refresh_from_db()
    assert (job.state, job.reserved_tokens) == (JOB.STOPPED_AT_CAP, 0)


def test_a_cap_is_used_to_its_last_token() -> None:
    job = launch()
    GenerationJob.objects.filter(pk=job.pk).update(cap_tokens=1000, cap_nano_usd=1_000_000)
    assert budget.reserve(job_pk=job.pk, worst=WORST, price=ONE_USD) == Room.TAKEN


def test_a_price_that_went_away_fails_the_row_and_spends_nothing() -> None:
    job = llama_job(price="1", caps=Caps(usd=Decimal(1)))
    EndpointModel.objects.all().delete()
    model = Model()
    row = ran(job, model)
    assert (row.state, model.requests) == (ROW.FAILED, [])
    assert "the price of the model is unknown" in row.reason


def test_a_call_of_a_dead_worker_counts_with_its_worst_case() -> None:
    job = llama_job(price="1")
    row = only_row(job)
    long_ago = timezone.now() - timedelta(minutes=1)
    held = claims.claim(augmentation_pk=row.pk, now=long_ago)
    assert held is not None
    in_flight(job, held)
    claims.requeue_stale(now=timezone.now(), older_than=STALE)
    job.refresh_from_db()
    assert (job.reserved_calls, job.spent_calls) == (0, 1)
    assert (job.spent_tokens, job.spent_nano_usd) == (1000, 1_000_000)
    assert ModelCall.objects.get().is_cost_estimated


def test_a_worker_that_was_only_slow_corrects_what_its_call_used() -> None:
    job = llama_job(price="1")
    row = only_row(job)
    held = claims.claim(augmentation_pk=row.pk, now=timezone.now() - timedelta(minutes=1))
    assert held is not None
    call = in_flight(job, held)
    claims.requeue_stale(now=timezone.now(), older_than=STALE)
    used = budget.used_by_reply(reply(), worst=WORST, price=ONE_USD)
    budget.settle(call_pk=call.pk, used=used, now=timezone.now())
    job.refresh_from_db()
    assert (job.spent_calls, job.spent_tokens, job.spent_nano_usd) == (1, 3020, 3_020_000)
    assert (job.reserved_calls, job.reserved_tokens) == (0, 0)


def in_flight(job: GenerationJob, held: claims.Claim) -> ModelCall:
    assert budget.reserve(job_pk=job.pk, worst=WORST, price=ONE_USD) == Room.TAKEN
    return ModelCall.objects.create(
        attempt_id=held.attempt_pk,
        number=1,
        role="modifier",
        request={},
        started_at=timezone.now(),
        reserved_tokens=WORST.tokens,
        reserved_nano_usd=WORST.nano_usd(ONE_USD),
    )


def test_a_worker_that_is_told_to_stop_settles_its_call_in_flight() -> None:
    job = llama_job()

    def stop() -> None:
        raise SystemExit(0)

    with pytest.raises(SystemExit):
        ran(job, Model(looking_on=stop))
    job.refresh_from_db()
    assert (job.reserved_calls, job.spent_calls) == (0, 1)
    assert only_row(job).state == ROW.QUEUED


def test_a_money_cap_needs_every_price() -> None:
    with pytest.raises(Conflict, match=r"nobody knows that of llama3\.1 at local: cap the job by"):
        llama_job(caps=Caps(usd=Decimal(1)))
    assert not GenerationJob.objects.exists()


def test_a_money_cap_takes_contestants_that_cost_nothing() -> None:
    add_llama(price="1")
    add_scenario("street")
    launch()
    job = jobs.launch(
        name="R",
        contestants=["llama", "reference"],
        scenarios=["street"],
        caps=Caps(usd=Decimal("2.50")),
    )
    assert job.cap_usd == Decimal("2.5")
    event = Event.objects.filter(verb="launch").first()
    assert event is not None
    assert event.after is not None
    assert event.after["cap"] == "2.5 USD"


@pytest.mark.parametrize(
    "given",
    [
        Caps(usd=Decimal(0)),
        Caps(usd=Decimal("NaN")),
        Caps(usd=Decimal("-1")),
        Caps(calls=0),
        Caps(tokens=-5),
        Caps(calls=10**12),
    ],
)
def test_a_cap_that_can_not_be_is_refused(given: Caps) -> None:
    with pytest.raises(Conflict, match="is more than 0 and at most"):
        given.columns()


def test_caps_are_only_raised_and_only_where_there_are_any() -> None:
    job = llama_job(caps=Caps(calls=5))
    for given, sentence in (
        (Caps(), "Say which cap"),
        (Caps(calls=5), "must be higher than the one of 5 calls"),
        (Caps(tokens=10), "has no such cap; its cap is 5 calls"),
    ):
        with pytest.raises(Conflict, match=sentence):
            caps.raise_cap(job, caps=given)
    job = caps.raise_cap(job, caps=Caps(calls=6))
    assert job.cap_calls == 6
    assert Event.objects.get(verb="raise cap").after == {"cap": "6 calls"}
    jobs.cancel(job)
    with pytest.raises(Conflict, match="is cancelled already"):
        caps.raise_cap(job, caps=Caps(calls=7))


def test_only_a_stopped_job_is_resumed() -> None:
    with pytest.raises(Conflict, match="is running; only one that stopped at its cap"):
        caps.resume(llama_job())


def test_a_stopped_job_can_be_cancelled() -> None:
    job = llama_job(caps=Caps(tokens=5))
    ran(job)
    jobs.cancel(job)
    assert (job.state, only_row(job).state) == (JOB.CANCELLED, ROW.CANCELLED)


def test_retrying_in_a_stopped_job_leaves_it_stopped() -> None:
    job = llama_job(scenarios=2, caps=Caps(calls=1))
    first, second = job.augmentations.order_by("pk")
    broken = Model(ModelFault("no", retryable=False, status=500))
    runner.work_on(augmentation_pk=first.pk, connect=broken)
    runner.work_on(augmentation_pk=second.pk, connect=Model())
    job.refresh_from_db()
    assert job.state == JOB.STOPPED_AT_CAP
    jobs.retry_failed(job)
    assert (job.state, jobs.progress(job).queued) == (JOB.STOPPED_AT_CAP, 2)
