"""Reserving before a call, settling after it, and what becomes of what nobody saw the end of."""

from dataclasses import replace
from datetime import timedelta
from decimal import Decimal

import pytest
from django.utils import timezone

from augment.errors import Conflict, EndpointBusy, InvalidDocument, LeaseLost, ModelFault
from augment.llm.costs import Price, WorstCase
from augment.llm.messages import Reply
from augment.models import (
    Attempt,
    Augmentation,
    CallLease,
    Endpoint,
    EndpointModel,
    Event,
    GenerationJob,
    ModelCall,
)
from augment.services.endpoints import client
from augment.services.running import budget, jobs, runner
from augment.services.running.budget import Caps, Room
from augment.services.running.estimates import estimate
from augment.services.running.jobs import JobRequest, JobScope
from augment.services.running.runner import AUGMENTATIONS
from tests.jobs.models import Model, add_llama, after_a_second_look, llama_job, ran, reply
from tests.jobs.rows import NOON, STALE, add_kind, add_scenario, only_row
from tests.variants.playing import GOOD

pytestmark = pytest.mark.django_db

ROW, JOB = Augmentation.State, GenerationJob.State
NANO, INSTANT = 1_000_000, timedelta(microseconds=1)
ONE_USD = Price(prompt_usd=Decimal(1), completion_usd=Decimal(1))
WORST = WorstCase(prompt_tokens=600, completion_tokens=400)


def test_a_call_turns_its_reservation_into_what_it_used() -> None:
    job = llama_job(price="2")
    assert ran(job, Model()).state == ROW.DONE
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
        (ModelFault("bad request", retryable=False, status=400), False),
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
    job = llama_job(price="1", caps=Caps(cap_usd=Decimal(1)))
    row = ran(job, Model(EndpointBusy("no place was free")))
    assert row.state == ROW.FAILED
    assert_nothing_is_counted(job)


@pytest.mark.parametrize("queue_finds_out", [True, False])
def test_a_claim_that_is_lost_before_a_call_is_sent_costs_nothing(queue_finds_out: bool) -> None:
    job = llama_job(price="1", caps=Caps(cap_usd=Decimal(1)))
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
    job = llama_job(caps=Caps(cap_tokens=5))
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
    job = llama_job(caps=Caps(cap_calls=1), is_fresh=True)
    model = Model(after_a_second_look)
    assert ran(job, model).state == ROW.QUEUED
    jobs.resume(job, higher=Caps(cap_calls=2))
    assert ran(job, model).state == ROW.DONE
    assert len(model.requests) == len(set(model.requests)) == 2
    served = ModelCall.objects.get(served_from__isnull=False)
    assert (served.attempt.number, served.number, served.answer) == (2, 1, "Sorry?")
    assert (served.cost_nano_usd, served.spent_tokens) == (0, 0)
    assert served.served_from.attempt.number == 1
    assert job.spent_calls == 2


def test_a_call_of_a_dead_worker_counts_with_its_worst_case() -> None:
    job = llama_job(price="1")
    in_flight_when_lost(job)
    call = ModelCall.objects.get()
    assert (job.reserved_calls, job.spent_calls) == (0, 1)
    assert (job.spent_tokens, job.spent_nano_usd) == (1000, 1_000_000)
    assert call.is_cost_estimated
    assert call.fault == "nobody saw the end: its worker stopped"


def test_a_call_that_waited_when_its_worker_died_counts_nothing() -> None:
    job = llama_job(price="1")
    in_flight_when_lost(job, is_sent=False)
    assert_nothing_is_counted(job)
    call = ModelCall.objects.get()
    assert (call.cost_usd, call.spent_tokens, call.is_cost_estimated) == (Decimal(0), 0, False)
    assert call.fault == "not sent: its worker stopped while it waited for a place"


def test_a_worker_that_was_only_slow_corrects_what_its_call_used() -> None:
    job = llama_job(price="1")
    call = in_flight_when_lost(job)
    used = budget.settle_reply(reply(), worst=WORST, price=ONE_USD)
    budget.settle(call=call, used=used, now=timezone.now())
    job.refresh_from_db()
    assert (job.spent_calls, job.spent_tokens, job.spent_nano_usd) == (1, 3020, 3_020_000)
    assert (job.reserved_calls, job.reserved_tokens) == (0, 0)


def reserve(job: GenerationJob) -> Room:
    asked = GenerationJob.objects.filter(pk=job.pk)
    return budget.reserve(jobs=asked, worst=WORST, price=ONE_USD)


def in_flight_when_lost(job: GenerationJob, *, is_sent: bool = True) -> ModelCall:
    """A call of a worker that was taken for dead meanwhile."""
    held = AUGMENTATIONS.take(only_row(job).pk, now=timezone.now() - timedelta(minutes=1))
    assert reserve(job) == Room.TAKEN
    call = ModelCall.objects.create(
        attempt=Attempt.objects.get(augmentation=held.pk),
        number=1,
        role="modifier",
        request={},
        started_at=timezone.now(),
        sent_at=timezone.now() if is_sent else None,
        reserved_tokens=WORST.tokens,
        reserved_nano_usd=WORST.nano_usd(ONE_USD),
    )
    AUGMENTATIONS.take_back_lost(now=timezone.now())
    job.refresh_from_db()
    return call  # as its worker knows it


def test_a_money_cap_needs_every_price() -> None:
    with pytest.raises(Conflict, match=r"nobody knows that of llama3\.1 at local: cap the job by"):
        llama_job(caps=Caps(cap_usd=Decimal(1)))
    assert not GenerationJob.objects.exists()


def test_a_cap_that_can_not_be_is_refused() -> None:
    for given in (
        Caps(cap_usd=Decimal(0)),
        Caps(cap_usd=Decimal("NaN")),
        Caps(cap_usd=Decimal("-1")),
        Caps(cap_calls=0),
        Caps(cap_tokens=-5),
        Caps(cap_calls=10**12),
    ):
        with pytest.raises(InvalidDocument, match="goes from 1"):
            given.columns()


ROOMS: list[tuple[dict[str, int], dict[str, int], dict[str, int], Room]] = [
    # One more call needs 1,000 tokens, 1,000,000 nano-dollars and 1 call.
    ({"tokens": 1000}, {}, {}, Room.TAKEN),
    ({"tokens": 999}, {}, {}, Room.SPENT),
    ({"tokens": 1500}, {"tokens": 500}, {}, Room.TAKEN),
    ({"tokens": 1500}, {"tokens": 501}, {}, Room.SPENT),
    ({"tokens": 1500}, {}, {"tokens": 500}, Room.TAKEN),
    ({"tokens": 1500}, {}, {"tokens": 501}, Room.BUSY),
    ({"tokens": 1500}, {"tokens": 500}, {"tokens": 1}, Room.BUSY),
    ({"nano_usd": NANO}, {}, {}, Room.TAKEN),
    ({"nano_usd": NANO - 1}, {}, {}, Room.SPENT),
    ({"nano_usd": 3 * NANO}, {"nano_usd": NANO}, {"nano_usd": NANO}, Room.TAKEN),
    ({"nano_usd": 3 * NANO}, {"nano_usd": NANO}, {"nano_usd": NANO + 1}, Room.BUSY),
    ({"nano_usd": 3 * NANO}, {"nano_usd": 2 * NANO + 1}, {}, Room.SPENT),
    ({"calls": 1}, {}, {}, Room.TAKEN),
    ({"calls": 1}, {"calls": 1}, {}, Room.SPENT),
    ({"calls": 1}, {}, {"calls": 1}, Room.BUSY),
    ({"calls": 2}, {"calls": 1}, {}, Room.TAKEN),
    # Of several caps the first that is reached counts.
    ({"calls": 9, "tokens": 999}, {}, {}, Room.SPENT),
    ({"calls": 1, "tokens": 9999}, {}, {"calls": 1}, Room.BUSY),
    ({}, {"tokens": 10**12}, {}, Room.TAKEN),
]
"""Caps, what is spent and what is reserved of them, and whether there is room for a call."""


def test_a_cap_has_room_up_to_its_last_unit() -> None:
    job = llama_job()
    units = ("calls", "tokens", "nano_usd")
    for cap, spent, reserved, room in ROOMS:
        columns: dict[str, object] = {f"cap_{unit}": cap.get(unit) for unit in units}
        columns |= {f"spent_{unit}": spent.get(unit, 0) for unit in units}
        columns |= {f"reserved_{unit}": reserved.get(unit, 0) for unit in units}
        GenerationJob.objects.update(**columns, state=JOB.RUNNING)
        assert reserve(job) == room
        after = GenerationJob.objects.get()
        taken = int(room == Room.TAKEN)
        assert after.reserved_tokens == reserved.get("tokens", 0) + 1000 * taken
        assert after.reserved_calls == reserved.get("calls", 0) + taken
        assert after.reserved_nano_usd == reserved.get("nano_usd", 0) + NANO * taken
        assert (after.state == "stopped_at_cap") is (room == Room.SPENT)


@pytest.mark.parametrize(
    ("age", "is_free"),
    [(client.LEASE - INSTANT, False), (client.LEASE, True), (client.LEASE + INSTANT, True)],
)
def test_when_the_place_of_a_dead_worker_is_free(age: timedelta, is_free: bool) -> None:
    endpoint = Endpoint.objects.create(label="x", base_url="http://x/v1", max_concurrency=1)
    client.admit(endpoint_pk=endpoint.pk, clock=lambda: NOON)
    found = client.admit(endpoint_pk=endpoint.pk, clock=lambda: NOON + age)
    assert (not isinstance(found, float)) is is_free
    assert CallLease.objects.count() == 1 + is_free


@pytest.mark.parametrize(
    ("age", "wait_s"),
    [(client.MINUTE - INSTANT, 1e-6), (client.MINUTE, None), (client.MINUTE + INSTANT, None)],
)
def test_when_a_start_counts_no_more_for_its_minute(age: timedelta, wait_s: float | None) -> None:
    endpoint = Endpoint.objects.create(
        label="x", base_url="http://x/v1", max_concurrency=9, requests_per_minute=1
    )
    client.admit(endpoint_pk=endpoint.pk, clock=lambda: NOON)
    found = client.admit(endpoint_pk=endpoint.pk, clock=lambda: NOON + age)
    assert (found if isinstance(found, float) else None) == wait_s


def test_without_earlier_runs_only_the_calls_are_known() -> None:
    add_llama(price="2")
    add_kind("reference")
    places = [add_scenario(f"street-{number}").slug for number in range(4)]
    found = estimate(JobScope(contestants=["llama", "reference"], scenarios=places))
    (line,) = found.lines
    assert (found.rows, found.asking_rows, line.seen) == (8, 4, 0)
    assert line.calls == (4, 4, 8)
    assert (line.tokens_in, line.usd, found.unpriced) == (None, None, (line,))
    assert (found.tokens_in, found.tokens_out, found.usd) == (None, None, None), "not 0"


def test_after_a_run_it_is_what_was_used() -> None:
    job = llama_job(price="1")
    runner.Augmentations(Model()).perform(only_row(job).pk)
    for slug in ("other", "another"):
        add_scenario(slug)
    (line,) = estimate(JobScope(contestants=["llama"], scenarios=["other", "another"])).lines
    assert (line.seen, line.tokens_in, line.tokens_out) == (1, 2 * 2900, 2 * 120)
    assert line.calls == (2, 2, 4)
    assert line.usd == Decimal("0.00604")


def again(*, is_fresh: bool = False) -> GenerationJob:
    return jobs.launch(
        JobRequest(name="Again", contestants=["llama"], scenarios=["street-1"], is_fresh=is_fresh)
    )


def test_the_same_request_is_answered_once_and_the_copy_costs_nothing() -> None:
    model = Model()
    first = ran(llama_job(price="1"), model)
    job = again()
    second = ran(job, model)
    assert (second.state, second.modification) == (ROW.DONE, first.modification)
    assert len(model.requests) == 1
    source, copy = ModelCall.objects.order_by("pk")
    assert (copy.served_from, copy.answer, copy.request) == (source, source.answer, source.request)
    assert (copy.cost_nano_usd, copy.spent_tokens, copy.latency_s) == (0, 0, None)
    assert (copy.model_returned, copy.is_cached) == ("llama3.1-2407", True)
    job.refresh_from_db()
    assert (job.spent_calls, job.spent_nano_usd) == (0, 0)


def test_a_fault_is_no_answer() -> None:
    broken = Model(ModelFault("no", retryable=False, status=500))
    job = llama_job()
    ran(job, broken)
    jobs.retry_failed(job)
    model = Model()
    assert ran(job, model).state == ROW.DONE
    assert len(model.requests) == 1


def test_cached_tokens_and_remarks_are_stored_and_the_cache_has_its_price() -> None:
    model = Model(
        lambda request: replace(reply(), cached_tokens=500, reasoning="Hm.", remarks=("Odd.",))
    )
    job = llama_job(price="2")
    EndpointModel.objects.update(price_cached_usd=1)
    ran(job, model)
    call = ModelCall.objects.get()
    assert (call.cached_tokens, call.extras) == (500, {"reasoning": "Hm.", "remarks": ["Odd."]})
    whole = 2000 * ((call.prompt_tokens or 0) + (call.completion_tokens or 0))
    assert call.cost_nano_usd == whole - 500 * 1000


def test_an_answer_to_a_cut_prompt_is_kept_and_paid_for_but_never_served() -> None:
    cut = Model(lambda request: replace(reply(), prompt_tokens=2048))
    job = llama_job(price="1")
    assert "silently cut" in ran(job, cut).reason
    call = ModelCall.objects.get()
    assert (call.answer, call.prompt_tokens) == (GOOD, 2048)
    assert "silently cut" in call.fault
    job.refresh_from_db()
    assert job.spent_tokens > 0
    whole = Model()
    assert ran(again(), whole).state == ROW.DONE
    assert len(whole.requests) == 1
