"""Workers whose clocks are wrong: what they judge is the database's time, on every database."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import timedelta

import pytest
from django.utils import timezone

from augment import tasks
from augment.models import Augmentation, CallLease
from augment.services.clock import DATABASE_TIME, database_now
from augment.services.endpoints import client
from augment.services.running.runner import AUGMENTATIONS, Held
from tests.brokers import MEMORY, broker_at
from tests.jobs.models import add_llama
from tests.jobs.rows import launch, only_row

pytestmark = pytest.mark.django_db
State = Augmentation.State
Skew = Callable[[float], None]


@pytest.fixture
def skew(monkeypatch: pytest.MonkeyPatch) -> Skew:
    """Sets the clock of this worker wrong by so many seconds."""
    right = timezone.now

    def put(seconds: float) -> None:
        monkeypatch.setattr(timezone, "now", lambda: right() + timedelta(seconds=seconds))

    return put


@pytest.fixture(autouse=True)
def _broker() -> Iterator[None]:
    with broker_at(MEMORY):
        yield


def taken() -> tuple[Augmentation, Held]:
    row = only_row(launch())
    held = AUGMENTATIONS.take(row.pk, worker="here")
    assert held is not None
    return row, held


def silent_for(row: Augmentation, seconds: float) -> None:
    """As if the holder had last been heard so long ago, on the database's clock."""
    Augmentation.objects.filter(pk=row.pk).update(
        heartbeat_at=DATABASE_TIME - timedelta(seconds=seconds)
    )


@pytest.mark.parametrize("seconds", [-40.0, 40.0])
@pytest.mark.parametrize("worker", ["holder", "other"])
def test_40_s_of_skew_take_no_living_claim_back(skew: Skew, seconds: float, worker: str) -> None:
    if worker == "holder":
        skew(seconds)
    row, held = taken()
    assert held.renew()
    skew(seconds if worker == "other" else 0.0)
    tasks.recover()
    assert held.is_held()
    row.refresh_from_db()
    assert row.state == State.RUNNING


@pytest.mark.parametrize("seconds", [-40.0, 0.0, 40.0])
@pytest.mark.parametrize(("silent_s", "state"), [(10.0, State.RUNNING), (25.0, State.QUEUED)])
def test_a_dead_claim_is_taken_back_whatever_the_clock_of_who_looks(
    skew: Skew, seconds: float, silent_s: float, state: State
) -> None:
    row, _ = taken()
    silent_for(row, silent_s)
    skew(seconds)
    AUGMENTATIONS.take_back_lost()
    row.refresh_from_db()
    assert row.state == state


@pytest.mark.parametrize("seconds", [-70.0, 70.0])
def test_a_wrong_clock_takes_no_place_that_is_taken(skew: Skew, seconds: float) -> None:
    endpoint = add_llama().endpoint
    assert endpoint is not None
    endpoint.max_concurrency = 1
    endpoint.save()
    clock = client.Queue(longest_s=0.0).clock
    skew(seconds)
    assert not isinstance(client.admit(endpoint_pk=endpoint.pk, clock=clock), float)
    skew(-seconds)
    assert client.admit(endpoint_pk=endpoint.pk, clock=clock) == 0.0
    assert CallLease.objects.get().started_at <= database_now()
