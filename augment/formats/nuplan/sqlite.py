"""Rows out of a SQLite file that somebody else made, opened for reading alone."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

from augment.errors import InvalidDocument

WHAT = "nuPlan log"
LONGEST_VALUE = 16 * 1024 * 1024
"""Bytes of one value or row."""


class Tables:
    """A database's tables."""

    def __init__(self, connection: sqlite3.Connection, name: str) -> None:
        self._connection = connection
        self._name = name

    def has(self, table: str) -> bool:
        """Whether there is a table of that name; a view or a virtual table is a program."""
        text = (
            "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ? "
            "AND sql NOT LIKE 'CREATE VIRTUAL%'"
        )
        return bool(self._connection.execute(text, (table,)).fetchone())

    def columns(self, table: str) -> set[str]:
        """Its columns, without computed ones; none of a table that is not there."""
        if not self.has(table):
            return set()
        text = "SELECT name FROM pragma_table_info(?)"
        return {str(row[0]) for row in self._connection.execute(text, (table,))}

    def need(self, table: str, columns: Sequence[str]) -> None:
        """Whether the table has these columns.

        Raises:
            InvalidDocument: It has not.
        """
        there = self.columns(table)
        if not there:
            raise InvalidDocument(WHAT, [(self._name, f"has no table {table!r}")])
        missing = [name for name in columns if name not in there]
        if missing:
            faults = [(f"{self._name}: {table}", f"has no column {one!r}") for one in missing]
            raise InvalidDocument(WHAT, faults)

    def rows(self, query: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        """What a query gives."""
        return list(self.each(query, values))

    def each(self, query: str, values: Sequence[Any] = ()) -> Iterator[tuple[Any, ...]]:
        """The same, one by one."""
        yield from self._connection.execute(query, tuple(values))


@contextmanager
def open_tables(path: Path) -> Iterator[Tables]:
    """The file's tables, as long as the block lasts.

    Raises:
        InvalidDocument: It is not there, or no database.
    """
    if not path.is_file():
        raise InvalidDocument(WHAT, [(str(path), "is not there")])
    address = f"file:{quote(str(path.resolve()))}?mode=ro&immutable=1"
    try:
        with closing(sqlite3.connect(address, uri=True)) as connection:
            connection.execute("PRAGMA trusted_schema = OFF")
            connection.execute("PRAGMA cell_size_check = ON")
            connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LONGEST_VALUE)
            yield Tables(connection, path.name)
    except (sqlite3.Error, UnicodeDecodeError) as fault:
        raise InvalidDocument(
            WHAT, [(path.name, f"can't be read as a database: {fault}")]
        ) from None
