"""Something long that keeps the database to itself, as an import once did."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any

from django.db import connection


@contextmanager
def kept_busy() -> Iterator[None]:
    """Hold SQLite's write lock, or all rows of matchups, by a connection of our own."""
    other: Any = connection.copy()
    lock = "BEGIN IMMEDIATE"
    if connection.vendor == "postgresql":
        lock = "BEGIN; SELECT id FROM arena_matchup FOR UPDATE"
    with closing(other), other.cursor() as cursor:
        cursor.execute(lock)
        yield
        cursor.execute("ROLLBACK")
