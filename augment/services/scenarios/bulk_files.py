"""Many scenarios from files that somebody sent: a list, and the documents that it names."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from django.contrib.auth.models import User
from django.core.files.base import File

from augment.errors import Conflict
from augment.services.scenarios.bulk import MOST_ROWS_AT_ONCE, BulkReport, read_rows, report_rows
from augment.services.scenarios.uploads import plain_name

MOST_FILES = 500


def add_from_files(
    table: File[bytes], documents: Sequence[File[bytes]], *, keeps: bool, actor: User | None = None
) -> BulkReport:
    """Add the scenarios of a list, all or none, and say of each what became of it.

    Args:
        table: A CSV or YAML file.
        documents: The JSON files that it names, at most `MOST_FILES`.
        keeps: False to try only: nothing is added then.
        actor: Who adds them.

    Raises:
        InvalidDocument: The list can't be read.
        Conflict: It has too many rows to be waited for.
    """
    with tempfile.TemporaryDirectory(prefix="arena-bulk-") as name:
        folder = Path(name)
        for one in documents:
            write_plain(one, folder)
        rows = read_rows(write_plain(table, folder))
        if len(rows) > MOST_ROWS_AT_ONCE:
            raise Conflict(
                f"{len(rows)} rows are too many for a page, at most {MOST_ROWS_AT_ONCE}: use "
                "manage.py add_scenario --file."
            )
        return report_rows(rows, folder=folder, keeps=keeps, actor=actor)


def write_plain(file: File[bytes], folder: Path) -> Path:
    """The file in the folder, under a name without folders."""
    path = folder / plain_name(file.name or "")
    with path.open("wb") as written:
        for piece in file.chunks():
            written.write(piece)
    return path
