"""The votes of a rating as a file, in the column form of Chatbot Arena, with pseudonyms."""

from __future__ import annotations

from arena.exports.formats import Format, formats
from arena.exports.parquet import TEXT, WHOLE, YES_NO, parquet_bytes
from arena.models import Snapshot
from arena.services.snapshots import judges_of, votes_of
from arena.services.vote_rows import COLUMNS, Row, vote_rows, votes_csv

Rows = list[Row]

_KINDS = dict.fromkeys(COLUMNS, TEXT) | {"ms_visible": WHOLE, "simulated": YES_NO}


def rows_of(snapshot: Snapshot) -> Rows:
    """The votes that the rating is made of, in the order in which they came.

    Raises:
        Conflict: They are not what they were.
    """
    return list(vote_rows(votes_of(snapshot).counted, judges_of(snapshot)))


def parquet_of(rows: Rows) -> bytes:
    """The same columns, typed; nothing is guarded, as no spreadsheet reads it."""
    return parquet_bytes(_KINDS, rows)


VOTE_FORMATS: dict[str, Format[Rows]] = formats(csv=votes_csv, parquet=parquet_of)
