"""Take a backup while everything runs."""

from __future__ import annotations

import os
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator
from datetime import datetime
from pathlib import Path

from django.conf import settings
from django.core.files.storage import default_storage
from django.db import connection

from arena.errors import ArenaError
from arena.management.backups.archive import MEDIA, ROWS, SECRET_KEY, Manifest, add_member
from arena.services.stored_rows import (
    applied_migrations,
    find_tables,
    frozen_rows,
    label_of,
    read_rows,
)
from arena.services.written_files import FOLDERS
from arena.serving.readiness import find_unapplied_migrations
from augment.services.scenarios.pictures import THUMBNAILS


def take_backup(path: Path, *, now: datetime, say: Callable[[str], None]) -> Manifest:
    """Write everything into one new file that only its owner reads.

    The rows are those of one moment. The pictures come after them: they are only ever added, so
    all that the rows name are there.

    Raises:
        ArenaError: The file is there already, or the database is not that of this release.
        OSError: It can't be written; nothing is left of it.
    """
    if path.exists():
        raise ArenaError(f"{path} is there already; a backup overwrites nothing.")
    if missing := find_unapplied_migrations():
        raise ArenaError(f"Run `manage.py prepare` first: {', '.join(missing)} are not applied.")
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    beside = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            with zipfile.ZipFile(file, "w") as archive:
                manifest = _fill(archive, now, say)
            file.flush()
            os.fsync(file.fileno())
        beside.rename(path)
    finally:
        beside.unlink(missing_ok=True)
    return manifest


def find_media(folder: str = "") -> Iterator[str]:
    """The names of all pictures, whatever keeps them; zips and thumbnails can be made again."""
    folders, files = default_storage.listdir(folder)
    for name in sorted(files):
        if not name.startswith("."):  # half a file of a worker that was killed
            yield f"{folder}{name}"
    for name in sorted(folders):
        if f"{folder}{name}" not in (*FOLDERS, THUMBNAILS):
            yield from find_media(f"{folder}{name}/")


def _fill(archive: zipfile.ZipFile, now: datetime, say: Callable[[str], None]) -> Manifest:
    manifest = Manifest(
        made_at=now.isoformat(), database=connection.vendor, migrations=applied_migrations()
    )
    with frozen_rows():
        for model in find_tables():
            label = label_of(model)
            lines = _counting(read_rows(model), manifest.rows, label)
            add_member(archive, manifest, f"{ROWS}{label}.jsonl", lines)
    say(f"rows: {sum(manifest.rows.values())} of {len(manifest.rows)} tables")
    pictures = 0
    for name in find_media() if _has_media() else ():
        with default_storage.open(name) as file:
            add_member(archive, manifest, f"{MEDIA}{name}", iter(lambda: file.read(1 << 20), b""))
        pictures += 1
    say(f"pictures: {pictures}")
    key = settings.VAR_DIR / SECRET_KEY
    if key.exists():
        add_member(archive, manifest, SECRET_KEY, [key.read_bytes()])
    manifest.write(archive)
    return manifest


def _has_media() -> bool:
    return default_storage.exists("")  # a bucket always is


def _counting(lines: Iterable[bytes], counts: dict[str, int], label: str) -> Iterator[bytes]:
    counts[label] = 0
    for line in lines:
        counts[label] += 1
        yield line
