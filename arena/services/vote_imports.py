"""Votes from elsewhere, as a study that is rated, shown and exported like any other."""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from django.contrib.auth.models import User
from django.db import IntegrityError, transaction
from django.utils import timezone

from arena.errors import VotesUnreadable
from arena.models import ImportedVote, Study, VoteFile
from arena.rating.votes_file import VotesFileUnreadable, columns_of, read_votes
from augment.errors import Conflict
from augment.services.events import log_event
from augment.services.texts import one_line

LONGEST_CELL = 200
AT_ONCE = 5000
SIMULATED = "simulated"
"""A column that our own files have; a yes in it marks the whole study."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Imported:
    """What was read, for whoever asked."""

    study: Study
    votes: int
    contestants: int


@transaction.atomic
def import_votes(
    *, path: Path, name: str, is_simulated: bool = False, actor: User | None = None
) -> Imported:
    """Keep all votes of a file; on any fault nothing is kept.

    Args:
        path: CSV in UTF-8 with the columns model_a, model_b and winner, and maybe judge and item;
            others are passed over.
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
    if Study.objects.filter(name=name).exists():
        raise _taken(name)
    try:
        columns = columns_of(path)
        contestants = len(read_votes(path, clusters=columns).comparisons.names)
        digest = _sha256(path)
    except VotesFileUnreadable as error:
        raise VotesUnreadable(str(error)) from error
    except OSError as error:
        raise VotesUnreadable(f"{path} can't be read: {error.strerror}.") from error
    study = _insert(name, is_simulated)
    file = VoteFile.objects.create(study=study, name=path.name[:200], sha256=digest)
    votes = 0
    waiting = _rows(path, file, study)
    while rows := list(islice(waiting, AT_ONCE)):
        ImportedVote.objects.bulk_create(rows)
        votes += len(rows)
    if study.allow_simulated:
        study.save(update_fields=["allow_simulated"])
    log_event(
        actor=actor,
        verb="import votes",
        object_kind="study",
        object_code=study.code,
        after={"file": file.name, "sha256": digest, "votes": votes},
    )
    return Imported(study=study, votes=votes, contestants=contestants)


# --- Private -----------------------------------------------------------------------------------


def _insert(name: str, is_simulated: bool) -> Study:
    now = timezone.now()
    try:
        with transaction.atomic():
            return Study.objects.create(
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


def _taken(name: str) -> Conflict:
    return Conflict(f"There is a study named {name!r} already.")


def _rows(path: Path, file: VoteFile, study: Study) -> Iterator[ImportedVote]:
    """One row a line; the file has been checked before."""
    with path.open(encoding="utf-8-sig", newline="") as lines:
        reader = csv.reader(lines, strict=True)
        place = {column.strip(): index for index, column in enumerate(next(reader))}
        for cells in reader:
            if not cells:
                continue
            found = {
                column: cells[place[column]] if column in place else ""
                for column in ("model_a", "model_b", "winner", "judge", "item", SIMULATED)
            }
            for column, cell in found.items():
                if len(cell) > LONGEST_CELL:
                    raise VotesUnreadable(
                        f"line {reader.line_num}: {column} has {len(cell)} signs, "
                        f"{LONGEST_CELL} are allowed"
                    )
            if found[SIMULATED] == "yes":
                study.allow_simulated = True
            yield ImportedVote(
                file=file,
                line=reader.line_num,
                first=found["model_a"],
                second=found["model_b"],
                outcome=ImportedVote.Outcome(found["winner"]),
                judge=found["judge"],
                item=found["item"],
            )


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
