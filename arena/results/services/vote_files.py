"""Votes as a table that other rating packages read, and votes from elsewhere as a study.

A vote set is known by the hash of its CSV file, so whoever has the file can check it.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence

from arena.exports.cells import csv_text
from arena.models import Vote
from arena.rating.vote_columns import VERSION, vote_columns
from arena.results.queries.votes import RatedVote

Row = tuple[str | int | bool | None, ...]

WINNERS = {
    Vote.Outcome.LEFT.value: "model_a",
    Vote.Outcome.EQUAL.value: "tie",
    Vote.Outcome.RIGHT.value: "model_b",
}
BOTH_BAD = "tie (bothbad)"


def vote_rows(votes: Iterable[RatedVote], names: Mapping[str, str]) -> Iterator[Row]:
    """One row a vote, in the order of COLUMNS.

    Args:
        votes: In their order.
        names: The judges' pseudonyms by their codes, as they were when the votes were frozen.
    """
    for vote in votes:
        yield (
            vote.left,
            vote.right,
            BOTH_BAD if vote.both_miss else WINNERS[vote.outcome],
            names.get(vote.judge, vote.judge),
            vote.item,
            vote.type,
            vote.kind,
            vote.outcome if vote.outcome != Vote.Outcome.EQUAL.value else "",
            vote.ms_visible,
            vote.is_simulated,
            vote.at,
            vote.position,
            vote.aids,
            vote.comment,
            vote.left_code,
            vote.right_code,
            vote.strength,
            vote.question,
            faults_text(vote.faults),
        )


def faults_text(faults: Sequence[Sequence[str]]) -> str:
    """Return marked faults as JSON, empty for none."""
    return json.dumps(faults) if faults else ""


def votes_csv(rows: Iterable[Row], version: int = VERSION) -> bytes:
    """The rows with their head; no cell is a formula."""
    names = vote_columns(version)
    return csv_text(names, (row[: len(names)] for row in rows)).encode()
