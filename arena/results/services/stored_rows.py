"""Rows as lines of JSON, and back: exact, in the order of their keys, on any database."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from datetime import date, datetime
from decimal import Decimal
from itertools import islice
from typing import Any
from uuid import UUID, uuid4

from django.apps import apps
from django.core.exceptions import ObjectDoesNotExist, ValidationError
from django.db import connection, models, transaction
from django.db.migrations.loader import MigrationLoader
from django.db.models import F, QuerySet

from arena.errors import ArenaError
from arena.jobs.services import NOTE_LENGTH
from arena.models import FaultLabel, Matchup, Report, Snapshot, Study, Vote
from arena.rating.rules import Intervals, Method, Unit
from arena.studies.services.opening import check_questions, check_seed
from arena.studies.services.planning import frozen_rules
from arena.voting.services.casting import Decision, FaultMark
from arena.voting.services.reports import Complaint
from augment.errors import AugmentError
from augment.models import FAILED, Augmentation, Contestant, GenerationJob, Work
from augment.services import check_picture_name, make_storable, one_line, row_rules
from augment.services.endpoints.contestants import BUILTIN

LEFT_OUT = frozenset(
    {
        *("sessions.session", "arena.session"),
        *("axes.accessattempt", "axes.accesslog", "axes.accessfailurelog"),
        *("axes.accessattemptexpiration", "augment.worker", "arena.scenariofile"),
        *("arena.studyfile", "arena.benchmarkfile"),
    }
)
"""What means nothing after a restore: who was signed in, who was locked out, who worked, and zips
that are made again when somebody asks for them."""

MADE_BY_MIGRATING = ("auth.permission", "contenttypes.contenttype", "auth.group")
"""What an empty installation has already, beside the contestants that are built in; a restore puts
the backup's in its place."""

AT_ONCE = 500


def list_migrations() -> list[str]:
    """The migrations of this release but for squashed ones, as app.name."""
    migrations = MigrationLoader(connection).disk_migrations.items()
    return sorted(f"{app}.{name}" for (app, name), each in migrations if not each.replaces)


def find_tables() -> list[type[models.Model]]:
    """Every table that is kept, those between two tables included, by label."""
    tables = apps.get_models(include_auto_created=True)
    chosen = (
        model
        for model in tables
        if model._meta.managed and not model._meta.proxy and model_label(model) not in LEFT_OUT
    )
    return sorted(chosen, key=model_label)


def model_label(model: type[models.Model]) -> str:
    """Its name in a backup, for example arena.vote."""
    return model._meta.label_lower


@contextmanager
def frozen_rows() -> Iterator[None]:
    """Read the rows of one moment, while others go on writing."""
    if connection.vendor == "sqlite":
        # Django's own transactions are IMMEDIATE and would keep every writer waiting.
        with connection.cursor() as cursor:
            cursor.execute("BEGIN DEFERRED")
            try:
                yield
            finally:
                cursor.execute("ROLLBACK")
        return
    with transaction.atomic(durable=False):
        with connection.cursor() as cursor:
            cursor.execute("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY")
        yield


def read_values(rows: QuerySet[Any]) -> Iterator[list[Any]]:
    """Each row as plain values, in the order of `list_columns` and of their keys."""
    columns = list_columns(rows.model)
    names = [field.attname for field in columns]
    for row in rows.order_by("pk").values_list(*names).iterator(chunk_size=AT_ONCE):
        yield [_plain(field, value) for field, value in zip(columns, row, strict=True)]


def as_line(values: list[Any]) -> bytes:
    """A row as it stands in a file; keys are sorted, for databases order them as they like."""
    return json.dumps(values, ensure_ascii=False, sort_keys=True).encode() + b"\n"


def list_columns(model: type[models.Model]) -> list[models.Field[Any, Any]]:
    """The columns that are stored, as Django orders them."""
    return [field for field in model._meta.local_concrete_fields if not field.generated]


def write_rows(
    model: type[models.Model],
    lines: Iterable[bytes],
    *,
    check: Callable[[models.Model], None],
    lacking: Collection[str] = (),
) -> int:
    """Store lines of `as_line`, keys and times included; returns how many.

    Args:
        model: Of which table.
        lines: One row each.
        check: Raises one of REFUSALS for a row that must not be stored.
        lacking: Columns that the lines of an earlier release don't have, by table; they get their
            default.

    Raises:
        ValueError: A line does not fit the table, or was refused; it is named by its number.
    """
    columns, label = list_columns(model), model_label(model)
    written = [column for column in columns if f"{label}.{column.name}" not in lacking]
    largest = max(1, connection.ops.bulk_batch_size(columns, [None] * AT_ONCE))
    waiting = enumerate(lines, start=1)
    number = 0
    while batch := list(islice(waiting, min(AT_ONCE, largest))):
        rows = []
        for number, line in batch:
            try:
                values = json.loads(line, parse_constant=_refuse_constant)
                rows.append(_row(model, written, values))
                check(rows[-1])
            except (*REFUSALS, ObjectDoesNotExist, RecursionError) as error:
                raise ValueError(f"line {number}: {_sentence(error)}") from error
        # Raw: times that are set when a row is made stay those of the backup.
        model._base_manager.all()._insert(  # type: ignore[attr-defined]
            rows, fields=columns, using=connection.alias, raw=True
        )
    return number


def find_filled_tables() -> list[str]:
    """The tables that keep an installation from being an empty one."""
    there = connection.introspection.table_names()
    return [
        model_label(model)
        for model in find_tables()
        if model._meta.db_table in there
        and model_label(model) not in MADE_BY_MIGRATING
        and model._base_manager.exclude(
            pk__in=list_prepared_rows() if model is Contestant else ()
        ).exists()
    ]


def list_prepared_rows() -> QuerySet[Contestant]:
    """Return the contestants that `prepare` makes, which a restore brings itself."""
    return Contestant.objects.filter(slug__in=BUILTIN)


# --- Rules of rows that a backup or a study's folder brings -------------------------------------

REFUSALS = (AugmentError, ValidationError, ValueError, KeyError, TypeError)
"""What a rule raises."""


def check_row(row: models.Model) -> None:
    """Refuse a row that no form and no operation of the API would have stored.

    Raises:
        One of REFUSALS: With the column and what is allowed.
    """
    match row:
        case Study():
            one_line("name", row.name, what="study")
            check_seed(row.seed)
            check_questions(row.questions)
            if row.rules:  # those of imported votes have none
                frozen_rules(row)
        case Matchup():
            for name in ("original_image", "left_image", "right_image"):
                check_picture_name(name, getattr(row, name))
        case Vote():
            Decision(
                key=row.key,
                matchup=uuid4(),
                outcome=row.outcome,
                both_miss=row.both_miss,
                strength=row.strength,
                reason=row.reason,
                comment=row.comment,
                aids=row.aids.split(),
                faults=[
                    FaultMark(side, place, str(fault))
                    for place, (side, _object, fault) in enumerate(row.faults)
                ],
            )
        case Report():
            side = row.side or Report.Side.BOTH  # reports from before it was asked name none
            Complaint(
                key=row.key, matchup=uuid4(), reason=row.reason, side=side, comment=row.comment
            )
        case Snapshot():
            check_seed(row.seed)
            Method(row.method)
            Unit(row.resampling_unit)
            Intervals(row.intervals)
        case FaultLabel() if len(row.note) > NOTE_LENGTH:
            raise ValueError(f"note: at most {NOTE_LENGTH} characters are allowed")
        case _ if rule := row_rules.RULES.get(type(row)):
            rule(row)


def check_votes() -> None:
    """Compare stored pairs and votes with each other.

    Raises:
        ArenaError: A vote is not on what its expert was shown, or a pair is not of its scenario.
    """
    votes = Vote.objects.order_by("pk")
    strangers = votes.exclude(
        expert=F("matchup__expert"), shown_left=F("matchup__left"), shown_right=F("matchup__right")
    ) | votes.exclude(supersedes=None).exclude(
        supersedes__matchup=F("matchup"), supersedes__question=F("question")
    )
    if vote := strangers.first():
        raise ArenaError(f"arena.vote, row {vote.pk}: it is not on what its expert was shown.")
    pairs = Matchup.objects.exclude(left__scenario=F("scenario"), right__scenario=F("scenario"))
    if pair := pairs.order_by("pk").first():
        raise ArenaError(
            f"arena.matchup, row {pair.pk}: both augmentations must be of its scenario."
        )


# --- Unfinished work ----------------------------------------------------------------------------

_WHY = "It was under way when the backup was taken. Start it again."

_WORK = [model for model in apps.get_models() if issubclass(model, Work)]

UNFINISHED: Mapping[type[models.Model], tuple[str, ...]] = {
    **{model: model.UNDER_WAY for model in _WORK},
    GenerationJob: (GenerationJob.State.RUNNING,),
    Study: (Study.State.OPEN,),
}
"""The states of each table in which something is still done with a row."""


def end_restored_work() -> None:
    """Leave nothing for workers to pick up: jobs are paused, all else has failed.

    An admin resumes the jobs and asks for the rest again; studies stay open.
    """
    waiting = Augmentation.objects.filter(state__in=Augmentation.UNDER_WAY)
    jobs = GenerationJob.objects.exclude(state=GenerationJob.State.CANCELLED)
    jobs.filter(pk__in=waiting.values("job")).update(state=GenerationJob.State.PAUSED)
    for model in _WORK:
        ended = {"state": FAILED, "reason": _WHY}
        if model is Augmentation:  # it waits in a job that is paused
            ended = {"state": Augmentation.State.QUEUED}
        rows = model._default_manager.filter(state__in=model.UNDER_WAY)
        rows.update(claim=None, heartbeat_at=None, sent_at=None, **ended)


# --- Private -----------------------------------------------------------------------------------


def _sentence(error: Exception) -> str:
    if isinstance(error, ValidationError):
        return " ".join(error.messages)
    return f"{error} is missing" if isinstance(error, KeyError) else str(error)


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _row(
    model: type[models.Model], columns: list[models.Field[Any, Any]], values: list[Any]
) -> models.Model:
    if not isinstance(values, list) or len(values) != len(columns):
        raise ValueError(f"{model_label(model)}: {len(columns)} values are needed in each line")
    row = model()
    for field, value in zip(columns, values, strict=True):
        try:
            setattr(row, field.attname, _parse(field, value))
            _check_column(row, field, value)
        except REFUSALS as error:
            raise ValueError(f"{field.name}: {_sentence(error)}") from error
    return row


def _check_column(row: models.Model, field: models.Field[Any, Any], raw: Any) -> None:
    """Refuse a value that would not be written so, or that the column's rules refuse.

    Raises:
        ValueError: Or another of REFUSALS.
    """
    value = getattr(row, field.attname)
    written = _plain(field, value)
    if written != raw or type(written) is not type(raw):
        raise ValueError(f"{raw!r} is no value of this column")
    if isinstance(value, str) and make_storable(value) != value:
        raise ValueError("holds signs that no database takes")
    if isinstance(field, models.JSONField):
        field.to_python(value)
    elif not field.is_relation and not (value is None and field.null):
        field.clean(value, row)


def _plain(field: models.Field[Any, Any], value: Any) -> Any:
    if isinstance(field, models.JSONField):
        return None if value is None else field.get_prep_value(value)
    match value:
        case datetime() | date():
            return value.isoformat()
        case Decimal() | UUID():
            return str(value)
        case bytes() | memoryview():
            return base64.b64encode(bytes(value)).decode()
        case _:
            return value


def _parse(field: models.Field[Any, Any], value: Any) -> Any:
    if value is None or isinstance(field, models.JSONField):
        return value
    if isinstance(field, models.BinaryField):
        return base64.b64decode(value)
    if isinstance(field, models.ForeignKey):
        return _parse(field.target_field, value)
    return field.to_python(value)
