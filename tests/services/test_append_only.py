"""What is append-only can't be changed, also by somebody who has the database open."""

from collections.abc import Callable

import pytest
from django.apps import apps
from django.core.management import call_command
from django.db import IntegrityError, connection, transaction
from django.db.models import Model

from augment.models import AppendOnly, Event, before_migrations
from tests.study_rows import a_study, matchups_of, vote

TABLES = {model for model in apps.get_models() if issubclass(model, AppendOnly)}


def execute(statement: str) -> None:
    connection.check_constraints()  # PostgreSQL empties no table with checks that still wait
    with transaction.atomic(), connection.cursor() as cursor:
        cursor.execute(statement)


def triggers() -> set[str]:
    kept = "SELECT name FROM sqlite_master WHERE type = 'trigger'"
    if connection.vendor == "postgresql":
        kept = "SELECT tgname FROM pg_trigger WHERE NOT tgisinternal"
    with connection.cursor() as cursor:
        cursor.execute(kept)
        return {name for (name,) in cursor.fetchall()}


@pytest.mark.django_db
def test_every_table_that_is_append_only_has_its_triggers() -> None:
    for model in TABLES:
        for what in ("update", "delete"):
            assert f"{model._meta.db_table}_refuses_{what}" in triggers()


def a_vote() -> Model:
    return vote(matchups_of(a_study(), "eva")[0])


def a_line() -> Model:
    return Event.objects.create(actor=None, verb="close", object_kind="study", object_code=7)


@pytest.mark.django_db
@pytest.mark.parametrize("made", [a_vote, a_line])
def test_a_stored_row_can_be_neither_changed_nor_deleted(made: Callable[[], Model]) -> None:
    row = made()
    model, table = type(row), row._meta.db_table
    stored = model._default_manager.filter(pk=row.pk)
    before = stored.values().get()
    statements = [
        f"UPDATE {table} SET at = at WHERE id = {row.pk}",
        f"DELETE FROM {table} WHERE id = {row.pk}",
        f"DELETE FROM {table}",
        f"INSERT OR REPLACE INTO {table} SELECT * FROM {table}"
        if connection.vendor == "sqlite"
        else f"TRUNCATE {table} CASCADE",
    ]
    for statement in statements:
        with pytest.raises(IntegrityError, match=f"{table} is append-only"):
            execute(statement)
    with pytest.raises(IntegrityError, match="append-only"), transaction.atomic():
        stored.update(at=None)
    with pytest.raises(IntegrityError, match="append-only"), transaction.atomic():
        stored.delete()
    with pytest.raises(TypeError, match="can't be changed"):
        row.save()
    with pytest.raises(TypeError, match="can't be deleted"):
        row.delete()
    assert stored.values().get() == before


@pytest.mark.django_db(transaction=True)
def test_a_migration_may_change_rows_and_leaves_the_triggers_as_they_were() -> None:
    """SQLite makes a table anew to alter it, and its triggers go with the old one."""
    a_line()
    before = triggers()
    assert before
    augment = apps.get_app_config("augment")
    before_migrations(augment, using=connection.alias, plan=["something"])
    execute("UPDATE augment_event SET verb = 'mended'")
    assert triggers() < before
    call_command("migrate", verbosity=0)
    assert triggers() == before
    with pytest.raises(IntegrityError):
        execute("UPDATE augment_event SET verb = 'forged'")
