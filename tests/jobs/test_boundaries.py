"""Caps, leases, places and waits at the very value where they turn, one below and one above."""

from __future__ import annotations

from datetime import timedelta
from decimal import Decimal

import pytest

from augment.llm.costs import Price, WorstCase
from augment.models import CallLease, Endpoint, GenerationJob
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
