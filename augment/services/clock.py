"""The time by which several workers judge (the database's, never their own), and heartbeats.

Workers on different machines may be tens of seconds apart. Times that one of them writes and
another one compares (leases, signs of life, places at an endpoint) are therefore both written and
compared by the database; on SQLite that is the clock of its only machine.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from threading import Event, Thread

from django.db import connection
from django.db.models import Expression
from django.db.models.functions import Now
from django.db.models.sql import Query
from django.utils.dateparse import parse_datetime

Moment = datetime | Expression
"""A time that is known, or one that the database finds when it runs the statement."""

DATABASE_TIME = Now()
"""When the statement that it is part of begins to run; the same expression on every database."""


def database_now() -> datetime:
    """Return the database's time, aware; a query of its own."""
    text, parameters = Query(None).get_compiler(connection=connection).compile(DATABASE_TIME)
    with connection.cursor() as cursor:
        cursor.execute(f"SELECT {text}", parameters)
        now = cursor.fetchone()[0]
    if isinstance(now, datetime):
        return now
    read = parse_datetime(now)  # SQLite has texts
    assert read is not None
    return read.replace(tzinfo=UTC)


@contextmanager
def repeating(beat: Callable[[], bool], *, every_s: float, name: str) -> Iterator[None]:
    """Call `beat` every so many seconds until the block is left, or until it returns False.

    The thread has a database connection of its own, which is closed with it.
    """
    stop = Event()
    thread = Thread(target=_beat_until, args=(beat, every_s, stop), name=name, daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def _beat_until(beat: Callable[[], bool], every_s: float, stop: Event) -> None:
    """Wait, then beat, until told to stop."""
    try:
        while not stop.wait(every_s):
            if not beat():
                return
    finally:
        connection.close()
