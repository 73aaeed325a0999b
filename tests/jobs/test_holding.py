from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from threading import Barrier

import pytest
from django.db import connection
from django.utils import timezone

from augment.services.running import leases
from augment.services.running.holding import heartbeat
from tests.jobs.rows import STALE, launch, leased, only_row
from tests.processes import wait_until

pytestmark = pytest.mark.django_db(transaction=True)


def test_the_heart_beats_while_the_work_goes_on() -> None:
    row = only_row(launch())
    before = timezone.now() - timedelta(minutes=1)
    held = leased(row, now=before)

    def has_beaten() -> bool:
        row.refresh_from_db()
        return row.heartbeat_at is not None and row.heartbeat_at > before

    with heartbeat(held, every_s=0.05):
        wait_until(has_beaten, what="the heart has beaten")
        assert leases.take_back_stale(now=timezone.now(), older_than=STALE) == []


def test_the_heart_stops_with_the_claim(caplog: pytest.LogCaptureFixture) -> None:
    row = only_row(launch())
    held = leased(row, now=timezone.now() - timedelta(minutes=1))
    leases.take_back_stale(now=timezone.now(), older_than=STALE)
    with heartbeat(held, every_s=0.01):
        wait_until(lambda: "somebody else's now" in caplog.text, what="it is given up")


def test_of_eight_workers_that_reach_for_one_row_one_gets_it() -> None:
    row = only_row(launch())
    start = Barrier(8)

    def reach() -> bool:
        start.wait()
        try:
            return leases.take_lease(augmentation_pk=row.pk, now=timezone.now()) is not None
        finally:
            connection.close()

    with ThreadPoolExecutor(8) as pool:
        got = [future.result() for future in [pool.submit(reach) for _ in range(8)]]
    assert sorted(got) == [False] * 7 + [True]
    assert row.attempts.count() == 1
