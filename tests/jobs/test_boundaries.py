"""Caps, leases, places and waits at the very value where they turn, one below and one above."""

from __future__ import annotations

from datetime import timedelta
from decimal import Decimal

import pytest

from augment.errors import ModelFault
from augment.llm.client import Patience
from augment.llm.costs import Price, WorstCase
from augment.llm.openai_wire import fault_of_status
from augment.models import Augmentation, CallLease, Endpoint, GenerationJob
from augment.services.endpoints import client
from augment.services.running import budget
from augment.services.running.budget import Room
from augment.services.running.runner import AUGMENTATIONS
from tests.jobs.models import llama_job
from tests.jobs.rows import NOON, STALE, launch, leased, only_row

pytestmark = pytest.mark.django_db

WORST = WorstCase(prompt_tokens=600, completion_tokens=400)
ONE_USD = Price(prompt_usd=Decimal(1), completion_usd=Decimal(1))
NANO = 1_000_000
"""What 1,000 tokens cost at one dollar for a million."""

INSTANT = timedelta(microseconds=1)


@pytest.mark.parametrize(
    ("cap", "spent", "reserved", "room"),
    [
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
    ],
)
def test_a_cap_has_room_up_to_its_last_unit(
    cap: dict[str, int], spent: dict[str, int], reserved: dict[str, int], room: Room
) -> None:
    job = llama_job()
    columns = {f"cap_{name}": value for name, value in cap.items()}
    columns |= {f"spent_{name}": value for name, value in spent.items()}
    columns |= {f"reserved_{name}": value for name, value in reserved.items()}
    GenerationJob.objects.update(**columns)
    assert budget.reserve(job_pk=job.pk, worst=WORST, price=ONE_USD) == room
    after = GenerationJob.objects.get()
    taken = int(room == Room.TAKEN)
    assert after.reserved_tokens == reserved.get("tokens", 0) + 1000 * taken
    assert after.reserved_calls == reserved.get("calls", 0) + taken
    assert after.reserved_nano_usd == reserved.get("nano_usd", 0) + NANO * taken
    assert (after.state == "stopped_at_cap") is (room == Room.SPENT)


@pytest.mark.parametrize(
    ("status", "is_billed"), [(None, True), (200, True), (399, True), (400, False), (500, False)]
)
def test_from_which_status_on_a_fault_is_free(status: int | None, is_billed: bool) -> None:
    fault = ModelFault("x", retryable=False, status=status)
    used = budget.used_by_fault(fault, worst=WORST, price=ONE_USD)
    assert (used.tokens, used.calls) == (1000 if is_billed else 0, 1)


@pytest.mark.parametrize(
    ("status", "may_pass"),
    [
        *((status, False) for status in (400, 401, 403, 404, 407, 410, 422, 424, 426, 428, 499)),
        *((status, True) for status in (408, 409, 425, 429, 500, 501, 502, 503, 504, 599)),
    ],
)
def test_which_statuses_may_pass(status: int, may_pass: bool) -> None:
    fault = fault_of_status(status, {}, 7.0)
    assert fault.retryable is may_pass
    assert fault.retry_after_s == (7.0 if may_pass else None)


@pytest.mark.parametrize(
    ("attempt", "asked_s", "waits"),
    [
        (1, None, True),
        (2, None, True),
        (3, None, False),
        (4, None, False),
        (1, 30.0, True),
        (1, 30.001, False),
        (2, 30.0, True),
        (3, 0.0, False),
    ],
)
def test_how_often_and_how_long_a_request_is_tried_again(
    attempt: int, asked_s: float | None, waits: bool
) -> None:
    fault = ModelFault("x", retryable=True, retry_after_s=asked_s)
    wait_s = Patience(attempts=3, longest_wait_s=30.0).wait_s(fault, attempt=attempt)
    assert (wait_s is not None) is waits
    assert wait_s is None or wait_s >= (asked_s or 0.0)


@pytest.mark.parametrize(
    ("after_the_beat", "is_taken_back"),
    [(STALE - INSTANT, False), (STALE, False), (STALE + INSTANT, True)],
)
def test_when_a_claim_without_a_beat_is_taken_back(
    after_the_beat: timedelta, is_taken_back: bool
) -> None:
    row = only_row(launch())
    leased(row, now=NOON)
    now = NOON + after_the_beat
    assert bool(AUGMENTATIONS.take_back_lost(now=now)) is is_taken_back


@pytest.mark.parametrize(
    ("age", "is_unsent"), [(STALE - INSTANT, False), (STALE, True), (STALE + INSTANT, True)]
)
def test_when_a_message_counts_as_lost(age: timedelta, is_unsent: bool) -> None:
    row = only_row(launch())
    AUGMENTATIONS.mark_sent([row.pk], now=NOON)
    assert bool(AUGMENTATIONS.find_unsent(now=NOON + age, older_than=STALE)) is is_unsent


@pytest.mark.parametrize(
    ("lost", "state"),
    [
        (AUGMENTATIONS.lost_limit - 1, Augmentation.State.QUEUED),
        (AUGMENTATIONS.lost_limit, Augmentation.State.FAILED),
    ],
)
def test_how_many_workers_may_die_at_one_row(lost: int, state: str) -> None:
    row = only_row(launch())
    for number in range(lost):
        now = NOON + number * 3 * STALE
        leased(row, now=now)
        AUGMENTATIONS.take_back_lost(now=now + 2 * STALE)
    row.refresh_from_db()
    assert row.state == state


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
def test_when_a_start_no_longer_counts_for_its_minute(
    age: timedelta, wait_s: float | None
) -> None:
    endpoint = Endpoint.objects.create(
        label="x", base_url="http://x/v1", max_concurrency=9, requests_per_minute=1
    )
    client.admit(endpoint_pk=endpoint.pk, clock=lambda: NOON)
    found = client.admit(endpoint_pk=endpoint.pk, clock=lambda: NOON + age)
    assert (found if isinstance(found, float) else None) == wait_s
