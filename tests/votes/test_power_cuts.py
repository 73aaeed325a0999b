"""A vote that was confirmed survives a power cut."""

import os
from concurrent.futures import ThreadPoolExecutor

import pytest
from django.db import connection

from tests.disk_syncs import NotReachable, counted_syncs
from tests.study_rows import a_study, matchups_of, vote

pytestmark = [
    pytest.mark.django_db(transaction=True),
    pytest.mark.sqlite,  # PostgreSQL writes its log through by itself
]

FULL = 2


def pragma() -> int:
    try:
        with connection.cursor() as cursor:
            cursor.execute("PRAGMA synchronous")
            return int(cursor.fetchone()[0])
    finally:
        connection.close()


def test_every_connection_writes_through() -> None:
    # Web threads, workers and commands all open theirs by the same settings.
    with ThreadPoolExecutor(2) as pool:
        assert [pragma(), *pool.map(lambda _: pragma(), range(2))] == [FULL] * 3


def test_every_confirmed_vote_is_on_the_disk() -> None:
    matchups = matchups_of(a_study(), "eva")
    log = f"{connection.settings_dict['NAME']}-wal"
    connection.close()
    try:
        with counted_syncs() as syncs:
            for number, matchup in enumerate(matchups, start=1):
                vote(matchup)
                assert syncs[log] >= number
            connection.close()
    except NotReachable as error:
        if os.environ.get("CI"):
            pytest.fail(f"syncs can't be counted, and in CI nothing is skipped: {error}")
        pytest.skip(f"this Python's SQLite does not let it be counted: {error}")
