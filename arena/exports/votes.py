"""The votes of a rating as a file, in the column form of Chatbot Arena, with pseudonyms."""

from __future__ import annotations

from typing import NamedTuple

from arena.exports.formats import Format, formats
from arena.exports.parquet import TEXT, WHOLE, YES_NO, parquet_bytes
from arena.models import Snapshot, Study
from arena.queries.votes.judged import last_vote_of, votes_up_to
from arena.services.snapshots import votes_of, votes_version_of
from arena.services.vote_rows import (
    COLUMNS,
    VERSION,
    WINNERS,
    Row,
    columns_of,
    vote_rows,
    votes_csv,
)

_KINDS = dict.fromkeys(COLUMNS, TEXT) | {
    "ms_visible": WHOLE,
    "simulated": YES_NO,
    "position": WHOLE,
}


class VoteTable(NamedTuple):
    """Votes in the order in which they came, and the version of the columns to write."""

    version: int
    rows: list[Row]


def vote_table(snapshot: Snapshot) -> VoteTable:
    """The votes that the rating is made of.

    Raises:
        Conflict: They are not what they were.
    """
    rows = vote_rows(votes_of(snapshot).counted, snapshot.results.judges)
    return VoteTable(version=votes_version_of(snapshot), rows=list(rows))


def unrated_votes(study: Study) -> VoteTable:
    """The votes of a study that nobody rates, repeats and checks by their kind; no skips."""
    current, _ = votes_up_to(study, last_vote_of(study))
    decided = [vote for vote in current if vote.outcome in WINNERS]
    names = {vote.judge: vote.judge_name for vote in decided}
    return VoteTable(version=VERSION, rows=list(vote_rows(decided, names)))


def csv_of(table: VoteTable) -> bytes:
    """The file whose hash the snapshot keeps."""
    return votes_csv(table.rows, table.version)


def parquet_of(table: VoteTable) -> bytes:
    """The same columns, typed; nothing is guarded, as no spreadsheet reads it."""
    names = columns_of(table.version)
    rows = (row[: len(names)] for row in table.rows)
    return parquet_bytes({name: _KINDS[name] for name in names}, rows)


VOTE_FORMATS: dict[str, Format[VoteTable]] = formats(csv=csv_of, parquet=parquet_of)
