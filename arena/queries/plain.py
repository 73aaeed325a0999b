"""Rows by plain SQL as instances of a model: like `raw()`, which finds out how for every query."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, TypeVar

from django.db import connection
from django.db.models import Model

M = TypeVar("M", bound=Model)
Reader = Callable[[Any], Any]


def instances(
    model: type[M], names: Sequence[str], sql: str, values: Mapping[str, Any]
) -> list[tuple[M, tuple[Any, ...]]]:
    """Every row as an instance, and the columns behind those of the model.

    Args:
        model: Of the instances; a field that is not named is loaded when somebody asks for it.
        names: Columns of the model, in the order in which the query begins with them.
        sql: The query, with %(name)s where values go.
        values: As the database takes them.
    """
    order, ordered, readers = _plan(model, tuple(names), connection.vendor)
    with connection.cursor() as cursor:
        cursor.execute(sql, values)
        rows = cursor.fetchall()
    found = []
    for row in rows:
        own = [read(row[place]) for place, read in zip(order, readers, strict=True)]
        found.append((model.from_db(connection.alias, ordered, own), row[len(names) :]))
    return found


@cache
def _plan(
    model: type[Model], names: tuple[str, ...], vendor: str
) -> tuple[list[int], list[str], list[Reader]]:
    """Where the model's fields stand in a row, in its own order, and how each becomes Python's."""
    fields = [field for field in model._meta.concrete_fields if field.attname in names]
    ordered = [field.attname for field in fields]
    return [names.index(name) for name in ordered], ordered, [_reader(field) for field in fields]


def _reader(field: Any) -> Reader:
    column = field.get_col(field.model._meta.db_table)
    steps = [*connection.ops.get_db_converters(column), *column.get_db_converters(connection)]

    def read(value: Any) -> Any:
        for step in steps:
            value = step(value, column, connection)
        return value

    return read
