"""Votes as the rows of a table that other rating packages read, and the hash of a vote set.

The hash is that of the CSV file with these rows, so whoever has the file can check it.
"""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Iterable, Iterator, Mapping

from arena.models import Vote
from arena.queries.votes.judged import Judged
from arena.services.cells import cell

COLUMNS = (
    "model_a", "model_b", "winner", "judge", "item", "type", "kind", "side", "ms_visible",
    "simulated", "at", "position", "aids", "comment", "augmentation_a", "augmentation_b",
)  # fmt: skip
"""The first three are Chatbot Arena's; `model_a` was on the left, `side` is the winner's.
`augmentation_a` is the code of what `model_a` made."""

VERSION = 2
"""Of the columns, kept with a snapshot: its file and the hash of it stay as they were."""

_WIDTHS = {1: 10, VERSION: len(COLUMNS)}
"""So many columns, the first ones, by version."""

Row = tuple[str | int | bool | None, ...]

WINNERS = {
    Vote.Outcome.LEFT.value: "model_a",
    Vote.Outcome.EQUAL.value: "tie",
    Vote.Outcome.RIGHT.value: "model_b",
}
BOTH_BAD = "tie (bothbad)"


def columns_of(version: int) -> tuple[str, ...]:
    """The columns of a version."""
    return COLUMNS[: _WIDTHS[version]]


def vote_rows(votes: Iterable[Judged], names: Mapping[str, str]) -> Iterator[Row]:
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
        )


def votes_csv(rows: Iterable[Row], version: int = VERSION) -> bytes:
    """The rows with their head; no cell is a formula."""
    sheet = io.StringIO()
    writer = csv.writer(sheet, lineterminator="\n")
    writer.writerow(columns_of(version))
    width, guarded = _WIDTHS[version], _Guarded()
    writer.writerows(
        tuple(_written(value, guarded) if value is not None else None for value in row[:width])
        for row in rows
    )
    return sheet.getvalue().encode()


def _written(value: str | int | bool, guarded: _Guarded) -> object:
    if isinstance(value, str):
        return guarded[value]
    return value if not isinstance(value, bool) else "yes" if value else "no"


class _Guarded(dict[str, str]):
    """The same few names come again and again: each is guarded once."""

    def __missing__(self, text: str) -> str:
        self[text] = guarded = cell(text)
        return guarded


def digest_of(content: bytes) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()
