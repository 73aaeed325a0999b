"""A list of votes as a CSV file: the columns of a rating's votes, and why one does not count."""

from __future__ import annotations

from collections.abc import Iterator

from arena.models import Snapshot
from arena.queries.votes.listed import ListedVote
from arena.queries.votes.lists import each_vote
from arena.queries.votes.search import VoteSearch
from arena.services.cells import csv_parts
from arena.services.vote_rows import BOTH_BAD, COLUMNS, WINNERS

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
