"""The votes of a rating as a file, in the column form of Chatbot Arena, with pseudonyms."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from arena.exports.formats import TEXT, WHOLE, YES_NO, Format, formats, parquet_bytes
from arena.models import Snapshot, Study
from arena.results.queries.evidence import ListedVote, each_vote
from arena.results.queries.search import VoteSearch
from arena.results.queries.votes import last_vote_of, votes_up_to
from arena.results.services.ratings import votes_of, votes_version_of
from arena.results.services.vote_files import (
    BOTH_BAD,
    COLUMNS,
    VERSION,
    WINNERS,
    Row,
    vote_rows,
    votes_csv,
)
from arena.results.services.vote_files import vote_columns as columns_of
from arena.services.cells import csv_parts

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


LIST_COLUMNS = (*COLUMNS, "mark", "reason", "vote")
"""Those of the rating's own file, then why a vote does not count ("counted" where it does), why it
was skipped, and the code in its address."""


def vote_list_csv(snapshot: Snapshot, search: VoteSearch) -> Iterator[bytes]:
    """The file, some lines at a time; names are pseudonyms, no cell is a formula."""
    return csv_parts(LIST_COLUMNS, map(_row, each_vote(snapshot, search)))


def _row(vote: ListedVote) -> tuple[object, ...]:
    return (
        vote.left.slug,
        vote.right.slug,
        BOTH_BAD if vote.both_miss else WINNERS.get(vote.outcome),
        vote.judge,
        vote.scenario,
        vote.type,
        vote.kind,
        vote.outcome if vote.outcome in ("left", "right") else None,
        vote.ms_visible,
        vote.is_simulated,
        vote.at and vote.at.isoformat(timespec="milliseconds"),
        vote.position,
        vote.aids,
        vote.comment,
        vote.left.augmentation,
        vote.right.augmentation,
        vote.mark,
        vote.reason,
        vote.code,
    )
