"""Triggers by which the database itself refuses to change what is append-only.

They are made after every `migrate` and not by migrations: SQLite makes a table anew to alter it,
and its triggers are gone with the old one. While migrations run there are none, so that one may
change stored rows.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from django.apps import AppConfig
from django.db import connections
from django.db.backends.base.base import BaseDatabaseWrapper
from django.db.models import Model
from django.db.models.signals import post_migrate, pre_migrate
from django.dispatch import receiver

from augment.models.work import AppendOnly


@receiver(pre_migrate)
def before_migrations(
    sender: AppConfig, using: str, plan: Iterable[object] = (), **_: Any
) -> None:
    """Take the triggers away where there is something to apply."""
    if plan:
        connection = connections[using]
        with connection.cursor() as cursor:
            for statement in dropping(connection, sender.get_models()):
                cursor.execute(statement)


@receiver(post_migrate)
def after_migrations(sender: AppConfig, using: str, **_: Any) -> None:
    """Make the triggers that are missing."""
    connection = connections[using]
    with connection.cursor() as cursor:
        for model in _stored(connection, sender.get_models()):
            for statement in _MAKING[connection.vendor](model):
                cursor.execute(statement)


def dropping(connection: BaseDatabaseWrapper, models: Iterable[type[Model]]) -> list[str]:
    """Statements that take the triggers of these models away."""
    tables = [model._meta.db_table for model in _stored(connection, models)]
    where = "" if connection.vendor == "sqlite" else " ON {table}"
    return [
        f"DROP TRIGGER IF EXISTS {table}_refuses_{what}{where.format(table=table)}"
        for table in tables
        for what in ("update", "delete", "truncate")
    ]


# --- Private -----------------------------------------------------------------------------------


def _stored(
    connection: BaseDatabaseWrapper, models: Iterable[type[Model]]
) -> list[type[AppendOnly]]:
    """Those of the models that are append-only and have a table already."""
    tables = [model for model in models if issubclass(model, AppendOnly)]
    kept = connection.introspection.table_names() if tables else []
    return [model for model in tables if model._meta.db_table in kept]


def _for_sqlite(model: type[AppendOnly]) -> list[str]:
    table = model._meta.db_table
    stays = f"WHEN NOT ({model.removable})" if model.removable else ""
    return [
        f"CREATE TRIGGER IF NOT EXISTS {table}_refuses_{what} BEFORE {what} ON {table} {when} "
        f"BEGIN SELECT RAISE(ABORT, '{_said(table)}'); END"
        for what, when in (("update", ""), ("delete", stays))
    ]


def _for_postgresql(model: type[AppendOnly]) -> list[str]:
    table = model._meta.db_table
    goes = model.removable or "FALSE"
    function = f"""
        CREATE OR REPLACE FUNCTION {table}_refuses() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN
            IF TG_OP = 'DELETE' THEN
                IF {goes} THEN
                    RETURN OLD;
                END IF;
            END IF;
            RAISE EXCEPTION '{_said(table)}' USING ERRCODE = 'integrity_constraint_violation';
        END $$
    """
    # CREATE OR REPLACE would wait for everybody who reads the table, also where nothing is new.
    made = [
        f"""
        DO $$ BEGIN
            IF NOT EXISTS (
                SELECT 1 FROM pg_trigger
                WHERE tgrelid = '{table}'::regclass AND tgname = '{table}_refuses_{what}'
            ) THEN
                CREATE TRIGGER {table}_refuses_{what} BEFORE {what} ON {table}
                FOR EACH {each} EXECUTE FUNCTION {table}_refuses();
            END IF;
        END $$
        """
        for what, each in (("update", "ROW"), ("delete", "ROW"), ("truncate", "STATEMENT"))
    ]
    return [function, *made]


def _said(table: str) -> str:
    return f"{table} is append-only: a stored row can not be changed or deleted"


_MAKING = {"sqlite": _for_sqlite, "postgresql": _for_postgresql}
