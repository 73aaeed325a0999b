"""The mark of whoever reads an upload stays fresh as long as it reads, and goes with it."""

from __future__ import annotations

from datetime import datetime, timedelta

import pytest
from django.utils import timezone
from pytest_django import Settings

from augment.models import SceneUpload
from augment.services.scenarios.upload_heartbeat import heartbeat
from tests.processes import wait_until

pytestmark = pytest.mark.django_db(transaction=True)


def begun(heard_at: datetime) -> SceneUpload:
    return SceneUpload.objects.create(
        name="log.zip", size_bytes=1, digest="0", state="running", heartbeat_at=heard_at
    )


def test_the_mark_stays_fresh_while_a_file_is_read(settings: Settings) -> None:
    settings.HEARTBEAT_S = 0.05
    before = timezone.now() - timedelta(minutes=1)
    row = begun(before)

    def has_beaten() -> bool:
        row.refresh_from_db()
        return row.heartbeat_at is not None and row.heartbeat_at > before

    with heartbeat(row):
        wait_until(has_beaten, what="the mark is renewed")
    row.refresh_from_db()
    assert row.heartbeat_at is None


def test_a_worker_that_is_told_to_stop_takes_its_mark_off() -> None:
    row = begun(timezone.now())
    with pytest.raises(SystemExit), heartbeat(row):
        raise SystemExit
    row.refresh_from_db()
    assert (row.state, row.heartbeat_at) == ("running", None)
