"""The two writes of every vote, in SQL: see `arena.queries.voting.path` for the reason."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from django.db import connection
from django.utils import timezone

from arena.models import Matchup, Vote

_COLUMNS = [field for field in Vote._meta.concrete_fields if not field.primary_key]


def insert(vote: Vote) -> Vote:
    """Store a vote that is not stored yet; gives it back with its number and time.

    Raises:
        IntegrityError: A constraint of the table does not hold.
    """
    values = [
        field.get_db_prep_save(field.pre_save(vote, add=True), connection) for field in _COLUMNS
    ]
    can_return = connection.features.can_return_columns_from_insert
    with connection.cursor() as cursor:
        cursor.execute(_insertion(can_return), values)
        if can_return:
            (vote.pk,) = cursor.fetchone()
        else:  # SQLite before 3.35
            vote.pk = connection.ops.last_insert_id(cursor, Vote._meta.db_table, "id")
    vote._state.adding = False
    vote._state.db = connection.alias
    return vote


def mark_served(*, matchups: Sequence[Matchup]) -> None:
    """Remember when matchups went out to their expert for the first time; within a transaction.

    Those that somebody holds are left out: they are being decided or handed over, and whoever
    holds one may wait for a row of ours.
    """
    fresh = [matchup.pk for matchup in matchups if matchup.served_at is None]
    if not fresh:
        return
    places = ", ".join(["%s"] * len(fresh))
    free = f"SELECT id FROM arena_matchup WHERE id IN ({places}) AND served_at IS NULL"
    if connection.features.has_select_for_update_skip_locked:
        free += f" {connection.ops.for_update_sql(skip_locked=True)}"
    now = connection.ops.adapt_datetimefield_value(timezone.now())
    with connection.cursor() as cursor:
        cursor.execute(
            f"UPDATE arena_matchup SET served_at = %s WHERE id IN ({free})", [now, *fresh]
        )


@cache
def _insertion(can_return: bool) -> str:
    names = ", ".join(connection.ops.quote_name(str(field.column)) for field in _COLUMNS)
    places = ", ".join(["%s"] * len(_COLUMNS))
    text = f"INSERT INTO {Vote._meta.db_table} ({names}) VALUES ({places})"
    return f"{text} RETURNING id" if can_return else text
