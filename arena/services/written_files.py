"""Rows of files that workers write: asked for once, kept with their content."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import partial
from pathlib import PurePath
from typing import TypeVar

from django.core.files import File
from django.core.files.storage import default_storage
from django.db import transaction

from arena.models import ScenarioFile, StudyFile
from arena.models.files import WrittenFile
from augment.services.work import Lease, Settlement

Row = TypeVar("Row", bound=WrittenFile)

FOLDERS = (ScenarioFile.FOLDER, StudyFile.FOLDER)
"""Where the contents lie, among the pictures; a backup leaves them out."""

_PIECE = 1 << 20


def waiting_row(row: Row) -> Row | None:
    """One like this that a worker has, or will have; None where there is none."""
    return row.alike().filter(state__in=row.UNDER_WAY).first()


def keep_file(
    row: Row,
    held: Lease[Row],
    *,
    name: str,
    content: File[bytes],
    warnings: Sequence[str] = (),
    marked: bool = False,
) -> None:
    """Store the content; the files of the same owner and kind before it go.

    So does the content itself where a newer one was faster and has removed the row.

    Args:
        row: Of which the content is.
        held: The right to write it.
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
    columns = {
        "name": name,
        "stored": kept,
        "size_bytes": size_bytes,
        "digest": digest.hexdigest(),
        "warnings": list(warnings),
        "is_non_commercial": marked,
    }
    with transaction.atomic():
        if held.settle(Settlement(state=WrittenFile.State.READY, columns=columns)):
            _remove_older(row)
        else:
            transaction.on_commit(partial(default_storage.delete, kept))


def _remove_older(row: WrittenFile) -> None:
    # Held, so that none of them is kept between the reading of its name and its removal.
    older = row.alike().filter(pk__lt=row.pk).order_by("pk").select_for_update()
    gone = list(older.values_list("pk", "stored"))
    row.alike().filter(pk__in=[pk for pk, _ in gone]).delete()
    for _, stored in gone:
        if stored:
            transaction.on_commit(partial(default_storage.delete, stored))
