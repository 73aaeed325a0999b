"""A vote that was confirmed survives a power cut."""

from concurrent.futures import ThreadPoolExecutor

import pytest
from django.db import connection

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
