"""Common columns of all rows that a worker brings to an outcome."""

import uuid
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from django.apps import AppConfig
from django.conf import settings
from django.db import connections, models
from django.db.backends.base.base import BaseDatabaseWrapper
from django.db.models import Model
from django.db.models.signals import post_migrate, pre_migrate
from django.dispatch import receiver

if TYPE_CHECKING:
    from django.contrib.auth.models import User

FAILED = "failed"
"""The state of work that the machinery could not bring to another outcome; each kind has it."""


def account_column(
    *, related_name: str = "+", on_delete: Any = models.PROTECT, help_text: str = ""
) -> "models.ForeignKey[User | None, User | None]":
    """Return a column for the account that did something; null for the machine."""
    return models.ForeignKey(
        settings.AUTH_USER_MODEL,
        null=True,
        blank=True,
        on_delete=on_delete,
        related_name=related_name,
        help_text=help_text,
    )


def user_column(
    related_name: str, *, on_delete: Any = models.PROTECT
) -> "models.ForeignKey[User, User]":
    """Return a column for the account that a row belongs to."""
    return models.ForeignKey(
        settings.AUTH_USER_MODEL, on_delete=on_delete, related_name=related_name
    )


class CodedModel(models.Model):
    """A row whose addresses have its random code."""

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)

    class Meta:
        abstract = True

    def __str__(self) -> str:
        return str(self.code)


class DoneState(models.TextChoices):
    """States of work that ends as done or failed."""

    QUEUED = "queued", "Waiting"
    RUNNING = "running", "Running"
    DONE = "done", "Done"
    FAILED = "failed", "Failed"


class Work(CodedModel):
    """A row that a worker takes, works on and settles; `augment.services.work` says how.

    In a state of `UNDER_WAY` the row waits until it has a `claim`, and is worked on while it has
    one. Every other state is an outcome.

    Attributes:
        UNDER_WAY: The states in which something is still to be done.
        STARTED: The columns that change when a worker takes the row.
        GIVEN_BACK: The columns that change when the row waits again.
    """

    UNDER_WAY: ClassVar[tuple[str, ...]] = ("queued", "running")
    STARTED: ClassVar[Mapping[str, str]] = {"state": "running"}
    GIVEN_BACK: ClassVar[Mapping[str, str]] = {"state": "queued"}

    state = models.CharField(max_length=20)
    reason = models.TextField(blank=True, help_text="why there is no result")
    claim = models.UUIDField(null=True, blank=True, help_text="who works on it right now")
    heartbeat_at = models.DateTimeField(null=True, blank=True)
    sent_at = models.DateTimeField(null=True, blank=True, help_text="last put on the queue")
    lost = models.PositiveSmallIntegerField(
        default=0, help_text="so many workers in a row ended over it without a word"
    )
    created_at = models.DateTimeField(auto_now_add=True)
    finished_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        abstract = True

    def wait_again(self, **columns: object) -> bool:
        """Let failed work wait once more; False where it has not failed."""
        failed = type(self)._default_manager.filter(pk=self.pk, state=FAILED)
        again = {**self.GIVEN_BACK, "reason": "", "finished_at": None, "sent_at": None}
        is_waiting = bool(failed.update(**(again | columns)))
        self.refresh_from_db()
        return is_waiting


class SentFile(Work):
    """A file as it came, and who sent it; a worker finds out what it holds."""

    name = models.CharField(max_length=120, help_text="of the file, in plain letters")
    stored = models.CharField(
        max_length=120, blank=True, help_text="name in the media storage; empty once removed"
    )
    size_bytes = models.PositiveBigIntegerField()
    digest = models.CharField(max_length=64, help_text="SHA-256 of the file")
    uploaded_by = account_column(on_delete=models.SET_NULL)

    class Meta:
        abstract = True


class AppendOnly(models.Model):
    """A row that is never changed or deleted: what changes it is another row.

    The database refuses it as well, whoever asks: see `augment.models.work`.
    """

    class Meta:
        abstract = True

    def save(self, *args: Any, **kwargs: Any) -> None:
        """Insert the row.

        Raises:
            TypeError: It is stored already.
        """
        if not self._state.adding:
            name = self._meta.verbose_name
            raise TypeError(f"a {name} is append-only: a stored one can't be changed")
        super().save(*args, **kwargs)

    def delete(self, *args: Any, **kwargs: Any) -> tuple[int, dict[str, int]]:
        """Never.

        Raises:
            TypeError: Always.
        """
        name = self._meta.verbose_name
        raise TypeError(f"a {name} is append-only: a stored one can't be deleted")


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
        for model in _list_append_only(connection, sender.get_models()):
            for statement in _MAKING[connection.vendor](model):
                cursor.execute(statement)


def dropping(connection: BaseDatabaseWrapper, models: Iterable[type[Model]]) -> list[str]:
    """Statements that take the triggers of these models away."""
    tables = [model._meta.db_table for model in _list_append_only(connection, models)]
    where = "" if connection.vendor == "sqlite" else " ON {table}"
    return [
        f"DROP TRIGGER IF EXISTS {table}_refuses_{what}{where.format(table=table)}"
        for table in tables
        for what in ("update", "delete", "truncate")
    ]


# --- Private -----------------------------------------------------------------------------------


def _list_append_only(
    connection: BaseDatabaseWrapper, models: Iterable[type[Model]]
) -> list[type[AppendOnly]]:
    """Return the append-only models that already have a table."""
    tables = [model for model in models if issubclass(model, AppendOnly)]
    existing = connection.introspection.table_names() if tables else []
    return [model for model in tables if model._meta.db_table in existing]


def _for_sqlite(model: type[AppendOnly]) -> list[str]:
    table = model._meta.db_table
    return [
        f"CREATE TRIGGER IF NOT EXISTS {table}_refuses_{what} BEFORE {what} ON {table} "
        f"BEGIN SELECT RAISE(ABORT, '{_refusal(table)}'); END"
        for what in ("update", "delete")
    ]


def _for_postgresql(model: type[AppendOnly]) -> list[str]:
    table = model._meta.db_table
    function = f"""
        CREATE OR REPLACE FUNCTION {table}_refuses() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN
            RAISE EXCEPTION '{_refusal(table)}' USING ERRCODE = 'integrity_constraint_violation';
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


def _refusal(table: str) -> str:
    return f"{table} is append-only: a stored row can not be changed or deleted"


_MAKING = {"sqlite": _for_sqlite, "postgresql": _for_postgresql}


class Event(AppendOnly):
    """One line of the append-only log: who did what to which object, when, before and after."""

    actor = account_column(related_name="events", help_text="null for the machine itself")
    verb = models.CharField(max_length=60)
    object_kind = models.CharField(max_length=40)
    object_code = models.CharField(max_length=64)
    before = models.JSONField(null=True, blank=True)
    after = models.JSONField(null=True, blank=True)
    at = models.DateTimeField(auto_now_add=True)

    class Meta:
        ordering = ("-at", "-pk")
        indexes = (models.Index(fields=("object_kind", "object_code")),)


class Worker(models.Model):
    """A worker process: when it was last heard, and whether it brings lost work back.

    All times are the database's.
    """

    name = models.CharField(max_length=120)
    started_at = models.DateTimeField()
    seen_at = models.DateTimeField()
    ended_at = models.DateTimeField(null=True, blank=True, help_text="it ended in order")
    recovered_at = models.DateTimeField(
        null=True, blank=True, help_text="it last brought lost work back, or saw that none is lost"
    )
    fault = models.TextField(blank=True, help_text="why it could not since then")
    keys = models.JSONField(
        default=list, help_text="names of the variables for keys that are set there"
    )

    class Meta:
        ordering = ("-seen_at",)
        indexes = (models.Index(fields=("seen_at",)),)
