"""What tests may do and nobody else: empty the tables, and change a row that is append-only."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from django.apps import apps
from django.db import connection
from django.db.backends.base.operations import BaseDatabaseOperations

from augment.models import AppendOnly, after_migrations
from augment.models.work import dropping


def empty_with_triggers() -> None:
    """Let Django empty the tables after a test; the triggers come again with post_migrate."""
    operations: type[BaseDatabaseOperations] = type(connection.ops)
    plain = operations.sql_flush

    def sql_flush(self: Any, style: Any, tables: Any, **how: Any) -> list[str]:
        return [*dropping(connection, apps.get_models()), *plain(self, style, tables, **how)]

    operations.sql_flush = sql_flush  # type: ignore[method-assign]


@contextmanager
def rewriting(model: type[AppendOnly]) -> Iterator[None]:
    """As if somebody had taken the triggers of a table away; afterwards they are there again."""
    connection.check_constraints()  # PostgreSQL alters no table with checks that still wait
    with connection.cursor() as cursor:
        for statement in dropping(connection, [model]):
            cursor.execute(statement)
    yield
    connection.check_constraints()
    after_migrations(apps.get_app_config(model._meta.app_label), using=connection.alias)
