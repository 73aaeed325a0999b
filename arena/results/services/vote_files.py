"""Votes as a table that other rating packages read, and votes from elsewhere as a study.

A vote set is known by the hash of its CSV file, so whoever has the file can check it.
"""

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import timedelta
from itertools import islice
from pathlib import Path

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.utils import timezone

from arena.errors import VotesUnreadable
from arena.exports.cells import csv_text
from arena.models import ImportedVote, Study, Vote, VoteFile
from arena.rating.votes_file import (
    NEEDED,
    OPTIONAL,
    SIMULATED,
    VotesFileUnreadable,
    VotesTable,
    read_table,
)
from arena.results.queries.votes import Judged
from arena.voting.services.turns import in_turn
from augment.errors import Conflict
from augment.services.events import log_event
from augment.services.texts import one_line

COLUMNS = (
    "model_a",
    "model_b",
    "winner",
    "judge",
    "item",
    "type",
    "kind",
    "side",
    "ms_visible",
    "simulated",
    "at",
    "position",
    "aids",
    "comment",
    "augmentation_a",
    "augmentation_b",
    "strength",
)
"""The first three are Chatbot Arena's; `model_a` was on the left, `side` is the winner's.
`augmentation_a` is the code of what `model_a` made."""

VERSION = 3
"""Of the columns, kept with a snapshot: its file and the hash of it stay as they were."""

_WIDTHS = {1: 10, 2: 16, VERSION: len(COLUMNS)}
"""So many columns, the first ones, by version."""

Row = tuple[str | int | bool | None, ...]

WINNERS = {
    Vote.Outcome.LEFT.value: "model_a",
    Vote.Outcome.EQUAL.value: "tie",
    Vote.Outcome.RIGHT.value: "model_b",
}
BOTH_BAD = "tie (bothbad)"


def vote_columns(version: int) -> tuple[str, ...]:
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
            vote.strength,
        )


def votes_csv(rows: Iterable[Row], version: int = VERSION) -> bytes:
    """The rows with their head; no cell is a formula."""
    names = vote_columns(version)
    return csv_text(names, (row[: len(names)] for row in rows)).encode()


def digest_of(content: bytes) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


LONGEST_CELL = 200
AT_ONCE = 500
"""So many rows are written at once; no vote gets in meanwhile, 0.4 s at most on a busy machine."""

DEAD_AFTER = timedelta(minutes=10)
"""An import that has written nothing for so long is over: its process was ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportedVotes:
    """What was read, for whoever asked."""

    study: Study
    votes: int
    contestants: int


def import_votes(
    *, path: Path, name: str, is_simulated: bool = False, actor: User | None = None
) -> ImportedVotes:
    """Keep all votes of a file; on any fault nothing is kept.

    Args:
        path: CSV, JSON lines or Parquet with the columns model_a, model_b and winner, and maybe
            judge and item; others are passed over.
        name: Of the study, unique.
        is_simulated: The votes are made up: every page and file of them says so.
        actor: Who imports, for the log.

    Raises:
        VotesUnreadable: A column is missing, a winner is unknown, a cell is empty or too long, or
            the file can't be read; the text has the line and what is allowed.
        Conflict: There is a study of that name, or another import took this one for dead.
        InvalidDocument: The name is empty, too long or not one line.
    """
    name = one_line("name", name, what="study")
    if Study.objects.filter(name=name).exists():
        raise _taken(name)
    table, digest = _read(path)
    contestants = {*table.columns["model_a"], *table.columns["model_b"]}
    made_up = not {"yes", "true"}.isdisjoint(table.columns.get(SIMULATED, ()))
    remove_dead()
    file = VoteFile.objects.create(name=path.name[:200], sha256=digest)
    try:
        votes = 0
        waiting = _rows(table, file)
        while batch := list(islice(waiting, AT_ONCE)):
            with in_turn(), transaction.atomic():
                _hold(file)
                votes += len(ImportedVote.objects.bulk_create(batch))
        study = _publish(file, name, votes, is_simulated or made_up, actor)
    except BaseException:  # also Ctrl-C; after a kill the next import does it
        _remove(file)
        raise
    return ImportedVotes(study=study, votes=votes, contestants=len(contestants))


def remove_dead() -> int:
    """Remove what imports left behind that were ended before they were done.

    Returns:
        How many there were.
    """
    dead = list(VoteFile.objects.filter(study=None, written_at__lt=timezone.now() - DEAD_AFTER))
    for file in dead:
        _remove(file)
    return len(dead)


# --- Private -----------------------------------------------------------------------------------


def _read(path: Path) -> tuple[VotesTable, str]:
    """Read a sound file and its SHA-256."""
    try:
        table = read_table(path)
        table.check_filled([name for name in OPTIONAL if name in table.columns])
        for column, cells in table.columns.items():
            for place, cell in enumerate(cells):
                if len(cell) > LONGEST_CELL:
                    reason = f"{column} has {len(cell)} signs, {LONGEST_CELL} are allowed"
                    raise table.refuse(place, reason)
        with path.open("rb") as file:
            return table, hashlib.file_digest(file, "sha256").hexdigest()
    except VotesFileUnreadable as error:
        raise VotesUnreadable(str(error)) from error
    except OSError as error:
        raise VotesUnreadable(f"{path.name} can't be read: {error.strerror}.") from error


def _rows(table: VotesTable, file: VoteFile) -> Iterator[ImportedVote]:
    """One row a vote; a column that the file does not have is empty."""
    nothing = [""] * len(table.columns["winner"])
    cells = (table.columns.get(name, nothing) for name in (*NEEDED, *OPTIONAL))
    for line, (first, second, winner, judge, item) in enumerate(
        zip(*cells, strict=True), start=table.first_line
    ):
        yield ImportedVote(
            file=file,
            line=line,
            first=first,
            second=second,
            outcome=winner,
            judge=judge,
            item=item,
        )


def _hold(file: VoteFile) -> None:
    """Say that the import goes on, and keep its file until the transaction ends.

    Raises:
        Conflict: Somebody has removed it.
    """
    if not VoteFile.objects.filter(pk=file.pk).update(written_at=timezone.now()):
        raise Conflict(
            f"The import of {file.name} stood still for more than "
            f"{DEAD_AFTER // timedelta(minutes=1)} minutes and was taken for dead; nothing is "
            "kept of it. Import the file again."
        )


def _publish(
    file: VoteFile, name: str, votes: int, is_simulated: bool, actor: User | None
) -> Study:
    """Make the study that has the votes of the file; from here on they can be seen."""
    now = timezone.now()
    with in_turn(), transaction.atomic():
        _hold(file)
        try:
            with transaction.atomic():
                study = Study.objects.create(
                    name=name,
                    state=Study.State.CLOSED,
                    votes_per_expert=0,
                    seed=0,
                    allow_simulated=is_simulated,
                    opened_at=now,
                    closed_at=now,
                )
        except IntegrityError:  # somebody else was faster
            raise _taken(name) from None
        file.study = study
        file.save(update_fields=["study"])
        log_event(
            actor=actor,
            verb="import votes",
            object_kind="study",
            object_code=study.code,
            after={"file": file.name, "sha256": file.sha256, "votes": votes},
        )
    return study


def _remove(file: VoteFile) -> None:
    """Delete the rows of an import that did not come to its end, and the import itself."""
    rows = ImportedVote.objects.filter(file=file.pk, file__study=None).order_by("pk")
    while first := list(rows.values_list("pk", flat=True)[:AT_ONCE]):
        with in_turn():
            batch = ImportedVote.objects.filter(file=file.pk, pk__range=(first[0], first[-1]))
            batch._raw_delete(using=batch.db)
    with in_turn():
        VoteFile.objects.filter(pk=file.pk, study=None).delete()


def _taken(name: str) -> Conflict:
    return Conflict(f"There is a study named {name!r} already.")
