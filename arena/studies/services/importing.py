"""Votes from elsewhere as a closed study, known by the hash of their file."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.utils import timezone

from arena.errors import VotesUnreadable
from arena.models import ImportedVote, Study, VoteFile
from arena.rating import votes_file
from arena.voting.services.turns import in_turn
from augment.errors import Conflict
from augment.services import log_change, one_line

LONGEST_CELL = 200

AT_ONCE = 500
"""So many rows go to the database at once."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportedVotes:
    """Result of an import of votes."""

    study: Study
    votes: int
    contestants: int
    note: str = ""


def import_votes(
    *, path: Path, name: str, is_simulated: bool = False, actor: User | None = None
) -> ImportedVotes:
    """Keep all votes of a file; on any fault nothing is kept.

    Args:
        path: CSV, JSON, Parquet or an Excel book with the columns model_a, model_b and
            winner, and maybe judge and item; others are passed over.
        name: Of the study, unique.
        is_simulated: The votes are made up: every page and file of them says so.
        actor: Who imports, for the log.

    Raises:
        VotesUnreadable: A column is missing, a winner is unknown, a cell is empty or too long, or
            the file can't be read; the text has the line and what is allowed.
        Conflict: There is a study of that name.
        InvalidDocument: The name is empty, too long or not one line.
    """
    name = one_line("name", name, what="study")
    table, digest = _read(path)
    contestants = {*table.columns["model_a"], *table.columns["model_b"]}
    made_up = not {"yes", "true"}.isdisjoint(table.columns.get(votes_file.SIMULATED, ()))
    now = timezone.now()
    with in_turn(), transaction.atomic():
        try:
            with transaction.atomic():
                study = Study.objects.create(
                    name=name,
                    state=Study.State.CLOSED,
                    votes_per_expert=0,
                    seed=0,
                    allow_simulated=is_simulated or made_up,
                    opened_at=now,
                    closed_at=now,
                )
        except IntegrityError as error:
            raise Conflict(f"There is a study named {name!r} already.") from error
        file = VoteFile.objects.create(study=study, name=path.name[:200], sha256=digest)
        votes = len(ImportedVote.objects.bulk_create(_rows(table, file), batch_size=AT_ONCE))
        after = {"file": file.name, "sha256": file.sha256, "votes": votes}
        log_change(study, "import votes", actor, after=after)
    return ImportedVotes(study=study, votes=votes, contestants=len(contestants), note=table.note)


def _read(path: Path) -> tuple[votes_file.VotesTable, str]:
    """Read a sound file and its SHA-256."""
    try:
        table = votes_file.read_table(path)
        table.check_filled([name for name in votes_file.OPTIONAL if name in table.columns])
        for column, cells in table.columns.items():
            for place, cell in enumerate(cells):
                if len(cell) > LONGEST_CELL:
                    reason = f"{column} has {len(cell)} signs, {LONGEST_CELL} are allowed"
                    raise table.refuse(place, reason)
        with path.open("rb") as file:
            return table, hashlib.file_digest(file, "sha256").hexdigest()
    except votes_file.VotesFileUnreadable as error:
        raise VotesUnreadable(f"{str(error).rstrip('.')}.") from error


def _rows(table: votes_file.VotesTable, file: VoteFile) -> Iterator[ImportedVote]:
    """One row a vote; a column that the file does not have is empty."""
    nothing = [""] * len(table.columns["winner"])
    cells = (
        table.columns.get(name, nothing) for name in (*votes_file.NEEDED, *votes_file.OPTIONAL)
    )
    for line, first, second, winner, judge, item in zip(table.lines, *cells, strict=True):
        yield ImportedVote(
            file=file,
            line=line,
            first=first,
            second=second,
            outcome=winner,
            judge=judge,
            item=item,
        )
