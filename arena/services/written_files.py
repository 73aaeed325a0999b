"""Rows of files that workers write: taken up, kept with their content, or failed with a reason."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import partial
from pathlib import PurePath
from typing import TypeVar

from django.core.files import File
from django.core.files.storage import default_storage
from django.db import transaction
from django.utils import timezone

from arena.models import ScenarioFile, StudyFile
from arena.models.written_files import WrittenFile

Row = TypeVar("Row", bound=WrittenFile)

State = WrittenFile.State
LONGEST_FAULT = 500
FOLDERS = (ScenarioFile.FOLDER, StudyFile.FOLDER)
"""Where the contents lie, among the pictures; a backup leaves them out."""

_PIECE = 1 << 20


def waiting_row(row: Row) -> Row | None:
    """One like this that a worker has, or will have; None where there is none."""
    return row.alike().filter(state__in=[State.QUEUED, State.RUNNING]).first()


def begin_file(model: type[Row], file_pk: int) -> Row | None:
    """The row that is to be written now; None for one that is gone, ready or failed."""
    rows = model._default_manager.filter(pk=file_pk)
    if not rows.filter(state__in=[State.QUEUED, State.RUNNING]).update(state=State.RUNNING):
        return None
    return rows.get()


def keep_file(
    row: WrittenFile,
    *,
    name: str,
    content: File[bytes],
    warnings: Sequence[str] = (),
    marked: bool = False,
) -> None:
    """Store the content; the files of the same owner and kind before it go.

    So does the content itself where a newer one was faster and has removed the row.

    Args:
        row: As `begin_file` gave it.
        name: What it is called for people.
        content: Read from its beginning.
        warnings: What whoever passes it on has to know.
        marked: Whether data that must not be used commercially is in it.
    """
    stored = f"{row.FOLDER}/{row.code}{PurePath(name).suffix}"
    if default_storage.exists(stored):  # a worker that died left it
        default_storage.delete(stored)
    content.seek(0)
    digest = hashlib.sha256()
    size_bytes = 0
    for piece in content.chunks(_PIECE):
        digest.update(piece)
        size_bytes += len(piece)
    content.seek(0)
    kept = default_storage.save(stored, content)
    with transaction.atomic():
        is_kept = (
            row.alike()
            .filter(pk=row.pk)
            .update(
                state=State.READY,
                name=name,
                stored=kept,
                size_bytes=size_bytes,
                digest=digest.hexdigest(),
                warnings=list(warnings),
                is_non_commercial=marked,
                finished_at=timezone.now(),
            )
        )
        if not is_kept:
            transaction.on_commit(partial(default_storage.delete, kept))
            return
        # Held, so that none of them is kept between the reading of its name and its removal.
        older = row.alike().filter(pk__lt=row.pk).order_by("pk").select_for_update()
        gone = list(older.values_list("pk", "stored"))
        row.alike().filter(pk__in=[pk for pk, _ in gone]).delete()
        for _, stored_as in gone:
            if stored_as:
                transaction.on_commit(partial(default_storage.delete, stored_as))


def note_failure(row: WrittenFile, why: str) -> None:
    """Say on the row why there is no file."""
    unready = row.alike().filter(pk=row.pk).exclude(state=State.READY)
    unready.update(state=State.FAILED, fault=why[:LONGEST_FAULT], finished_at=timezone.now())
