"""A vote that can't be written in time is given back, and the web server goes on meanwhile."""

import fcntl
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest
from django.db import OperationalError, connection
from pytest_django import Settings

from arena.errors import DatabaseBusy
from arena.models import Vote
from arena.voting.services import turns
from tests.api.asking import body_for, error_of, post, signed_in
from tests.held_lock import kept_busy
from tests.house.source import ROOT
from tests.study_rows import a_study, matchups_of

pytestmark = pytest.mark.django_db(transaction=True)

SHORT_S, FULL = 0.2, 2
only_sqlite = pytest.mark.sqlite
"""PostgreSQL lets votes on different pairs pass by."""


@pytest.fixture(autouse=True)
def _impatient(settings: Settings) -> None:
    settings.VOTE_WAIT_S = SHORT_S
    if connection.vendor == "postgresql":
        turns.limit_waiting(connection, SHORT_S)


def test_a_vote_behind_a_long_writer_is_given_back_and_taken_later() -> None:
    matchup = matchups_of(a_study(), "eva")[0]
    client, body = signed_in("eva"), body_for(matchup)
    with kept_busy():
        refused = post(client, body)
    error_of(refused, 503, "busy")
    assert refused["Retry-After"] == "2"
    assert not Vote.objects.exists()
    assert post(client, body).status_code == 200
    assert Vote.objects.count() == 1


@contextmanager
def full_disk() -> Iterator[None]:
    """Let a vote need more pages than SQLite may add, as on a full disk (SQLITE_FULL)."""
    with connection.cursor() as cursor:

        def pragma(name: str) -> int:
            return int(cursor.execute(f"PRAGMA {name}").fetchone()[0])

        cursor.execute("CREATE TABLE filler (bytes)")
        # Pages that earlier tests freed are still in the file.
        needed = pragma("page_size") * (pragma("freelist_count") + 20)
        cursor.execute(
            "CREATE TRIGGER fill AFTER INSERT ON arena_vote "
            f"BEGIN INSERT INTO filler VALUES (zeroblob({needed})); END"
        )
        pragma(f"max_page_count = {pragma('page_count')}")
        try:
            yield
        finally:
            pragma("max_page_count = 4294967294")
            cursor.execute("DROP TRIGGER fill")
            cursor.execute("DROP TABLE filler")


@only_sqlite
def test_a_vote_on_a_full_disk_is_given_back() -> None:
    matchup = matchups_of(a_study(), "eva")[0]
    client = signed_in("eva")
    with connection.cursor() as cursor:  # as after a test with many rows
        cursor.execute("CREATE TABLE freed AS SELECT zeroblob(1000000) AS bytes")
        cursor.execute("DROP TABLE freed")
    with full_disk():
        refused = post(client, body_for(matchup))
    error_of(refused, 503, "busy")
    assert refused["Retry-After"] == "2"
    assert not Vote.objects.exists()


@only_sqlite
def test_who_waits_for_another_process_waits_no_longer_than_the_limit() -> None:
    began = time.monotonic()
    with open(f"{connection.settings_dict['NAME']}{turns.SUFFIX}", "ab") as theirs:
        fcntl.flock(theirs, fcntl.LOCK_EX)  # another opened file is as another process
        with pytest.raises(DatabaseBusy), turns.in_turn(within_s=SHORT_S):
            pytest.fail("it is the other's turn")
    assert time.monotonic() - began < 30
    with turns.in_turn(within_s=SHORT_S):
        pass


@only_sqlite
def test_a_connection_is_as_patient_after_a_vote_as_before() -> None:
    def patience_ms() -> int:
        with connection.cursor() as cursor:
            cursor.execute("PRAGMA busy_timeout")
            return int(cursor.fetchone()[0])

    before = patience_ms()
    assert before == 20_000
    with turns.in_turn(within_s=SHORT_S):
        assert patience_ms() <= SHORT_S * 1000
    assert patience_ms() == before
    with kept_busy(), pytest.raises(DatabaseBusy), turns.in_turn(within_s=SHORT_S):
        Vote.objects.all()._raw_delete(using="default")
    assert patience_ms() == before


def test_other_faults_of_the_database_are_not_called_busy() -> None:
    with (
        pytest.raises(OperationalError if connection.vendor == "sqlite" else Exception),
        turns.in_turn(within_s=SHORT_S),
        connection.cursor() as cursor,
    ):
        cursor.execute("SELECT nothing FROM nowhere")


@only_sqlite
def test_every_connection_of_a_web_server_waits_no_longer_than_a_vote(tmp_path: Path) -> None:
    program = (
        "from arena.config import wsgi; from django.db import connection;"
        "cursor = connection.cursor(); cursor.execute('PRAGMA busy_timeout');"
        "print(cursor.fetchone()[0])"
    )
    said = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        env={**os.environ, "ARENA_VAR_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert said == "5000\n"


@only_sqlite  # PostgreSQL writes its log through by itself
def test_every_connection_writes_through() -> None:
    """A vote that was confirmed survives a power cut."""

    def pragma() -> int:
        try:
            with connection.cursor() as cursor:
                cursor.execute("PRAGMA synchronous")
                return int(cursor.fetchone()[0])
        finally:
            connection.close()

    # Web threads, workers and commands all open theirs by the same settings.
    with ThreadPoolExecutor(2) as pool:
        assert [pragma(), *pool.map(lambda _: pragma(), range(2))] == [FULL] * 3
