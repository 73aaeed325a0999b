"""Places at an endpoint, on the database as it is configured."""

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timedelta

import pytest
from django.db import connection

from augment.errors import EndpointBusy, LeaseLost
from augment.models import CallLease, Endpoint
from augment.services.endpoints.client import Queue, place_at
from tests.processes import wait_until

THREADS = 8


def at(moment: datetime) -> Callable[[], datetime]:
    return lambda: moment


def local(**limits: int) -> Endpoint:
    return Endpoint.objects.create(label="local", base_url="http://127.0.0.1:9/v1", **limits)


class Counter:
    """Calls that take a moment, the first of them until several are under way at once."""

    def __init__(self, endpoint: Endpoint, *, at_once: int = 1) -> None:
        self.endpoint = endpoint
        self.now = self.most = 0
        self.starts: dict[int, datetime] = {}
        self._at_once = at_once
        self._are_enough = threading.Event()
        self._lock = threading.Lock()

    def call(self, queue: Queue) -> None:
        try:
            with place_at(self.endpoint, queue):
                with self._lock:
                    self.now += 1
                    self.most = max(self.most, self.now)
                    # What the database says: this thread may have been held up since.
                    self.starts.update(CallLease.objects.values_list("pk", "started_at"))
                if self.now >= self._at_once:
                    self._are_enough.set()
                assert self._are_enough.wait(60)
                time.sleep(0.02)
                with self._lock:
                    self.now -= 1
        finally:
            connection.close()


@pytest.mark.django_db(transaction=True)
def test_eight_threads_never_pass_the_limit_of_calls_at_once() -> None:
    calls = Counter(local(max_concurrency=3), at_once=3)
    with ThreadPoolExecutor(max_workers=THREADS) as pool:
        list(pool.map(calls.call, [Queue(longest_s=300.0)] * 32))
    assert len(calls.starts) == 32
    assert calls.most == 3
    assert not CallLease.objects.filter(finished_at=None).exists()


@pytest.mark.django_db(transaction=True)
def test_eight_threads_never_pass_the_limit_of_starts_in_a_minute() -> None:
    # A "minute" of a second, so that the test can see several.
    minute = timedelta(seconds=1)
    queue = Queue(longest_s=300.0, minute=minute)
    calls = Counter(local(max_concurrency=8, requests_per_minute=5))
    with ThreadPoolExecutor(max_workers=THREADS) as pool:
        list(pool.map(calls.call, [queue] * 14))
    started = sorted(calls.starts.values())
    assert len(started) == 14
    gaps = [later - first for first, later in zip(started, started[5:], strict=False)]
    assert min(gaps) >= minute


@pytest.mark.django_db
def test_a_place_is_free_again_when_its_call_ended() -> None:
    endpoint = local(max_concurrency=1)
    queue = Queue(longest_s=0.0, sleep=lambda _: None)
    for _ in range(2):
        with (
            place_at(endpoint, queue),
            pytest.raises(EndpointBusy, match="'local' for 0 s"),
            place_at(endpoint, queue),
        ):
            pass
    with pytest.raises(ZeroDivisionError), place_at(endpoint, queue):
        1 / 0  # noqa: B018
    with place_at(endpoint, queue):
        pass


@pytest.mark.django_db
def test_who_waits_asks_whether_the_call_is_still_wanted() -> None:
    endpoint = local(max_concurrency=1)
    asked = []

    def wanted() -> None:
        asked.append(1)
        if len(asked) == 3:
            raise LeaseLost

    with place_at(endpoint, Queue(longest_s=0.0)):
        waiting = Queue(longest_s=300.0, still_wanted=wanted, sleep=lambda _: None)
        with pytest.raises(LeaseLost), place_at(endpoint, waiting):
            pass


@pytest.mark.django_db(transaction=True)
def test_a_long_call_renews_its_lease() -> None:
    endpoint = local()
    with place_at(endpoint, Queue(longest_s=1.0, renew_every_s=0.02)):
        first = CallLease.objects.get().expires_at
        wait_until(
            lambda: CallLease.objects.get().expires_at > first, what="the lease lasts longer"
        )
