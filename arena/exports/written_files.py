"""Files that workers write and pages offer: asked for once, made, and kept with their content."""

from __future__ import annotations

import hashlib
import tempfile
from abc import abstractmethod
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePath
from typing import TypeVar

from django.core.files import File
from django.core.files.storage import default_storage
from django.db import transaction

from arena.models import BenchmarkFile, ScenarioFile, Study, StudyFile
from arena.models.files import WrittenFile
from augment.models import Benchmark, GenerationJob
from augment.services import Lease, Settlement, WorkKind, log_change

Row = TypeVar("Row", bound=WrittenFile)

FOLDERS = (BenchmarkFile.FOLDER, ScenarioFile.FOLDER, StudyFile.FOLDER)
"""Where the contents lie, among the pictures; a backup leaves them out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MadeFile:
    """Content of a file, ready to be stored.

    Attributes:
        name: What it is called for people.
        warnings: What whoever passes it on has to know.
        marked: Whether data that must not be used commercially is in it.
    """

    name: str
    content: File[bytes]
    warnings: tuple[str, ...] = ()
    marked: bool = False


class FileWork(WorkKind[Row]):
    """The work of writing one kind of file."""

    @abstractmethod
    def make(self, row: Row, folder: Path) -> MadeFile:
        """Return the file of a row; the folder is there as long as it is needed."""

    def run(self, row: Row, held: Lease[Row]) -> None:
        """Make it and keep it."""
        with tempfile.TemporaryDirectory() as folder:
            made = self.make(row, Path(folder))
            with made.content:
                keep_file(row, held, made)


@transaction.atomic
def ask_for(row: Row, owner: Study | GenerationJob | Benchmark, **after: str) -> Row:
    """Keep a row for a worker to write; one that waits already is asked for once more.

    Args:
        row: Not stored yet.
        owner: Whose file it is.
        after: What the log says of it.
    """
    waiting = row.alike().filter(state__in=row.UNDER_WAY).first()
    if waiting is not None:
        return waiting
    row.save()
    log_change(owner, "ask for a file", row.asked_by, after=after)
    return row


def keep_file(row: Row, lease: Lease[Row], made: MadeFile) -> None:
    """Store the content and remove older files of the same owner and kind.

    The content itself goes where a newer file was faster and has removed the row.
    """
    stored = f"{row.FOLDER}/{row.code}{PurePath(made.name).suffix}"
    if default_storage.exists(stored):  # a worker that died left it
        default_storage.delete(stored)
    made.content.seek(0)
    digest = hashlib.sha256()
    for piece in made.content.chunks(1 << 20):
        digest.update(piece)
    size_bytes = made.content.tell()
    made.content.seek(0)
    stored_name = default_storage.save(stored, made.content)
    columns = {
        "name": made.name,
        "stored": stored_name,
        "size_bytes": size_bytes,
        "digest": digest.hexdigest(),
        "warnings": list(made.warnings),
        "is_non_commercial": made.marked,
    }
    with transaction.atomic():
        if not lease.settle(Settlement(state=WrittenFile.State.READY, columns=columns)):
            transaction.on_commit(partial(default_storage.delete, stored_name))
            return
        # Locked, so that none is kept between the reading of its name and its removal.
        older = row.alike().filter(pk__lt=row.pk).order_by("pk").select_for_update()
        gone = dict(older.values_list("pk", "stored"))
        row.alike().filter(pk__in=gone).delete()
        for name in filter(None, gone.values()):
            transaction.on_commit(partial(default_storage.delete, name))


# --- Files of a study --------------------------------------------------------------------------
