"""Restore a backup into an empty installation: all of it or nothing."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

from django.conf import settings
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.core.management import call_command
from django.db import DatabaseError, transaction

from arena.errors import ArenaError
from arena.exports.files import write_whole
from arena.management.backups import rows
from arena.management.backups.archive import (
    MEDIA,
    ROWS,
    SECRET_KEY,
    BackupUnreadable,
    Manifest,
    open_archive,
    read_manifest,
    read_member,
)
from arena.management.backups.taking import applied_migrations


def restore_backup(path: Path, *, say: Callable[[str], None]) -> Manifest:
    """Check the whole file, then put pictures, rows and key where they belong.

    Raises:
        BackupUnreadable: It is no whole backup.
        ArenaError: It is another release's, or this installation is not empty.
        OSError: The file can't be read, or the pictures can't be written.
    """
    with path.open("rb") as file, open_archive(file) as archive:
        manifest = read_manifest(archive)
        say(f"whole: a backup of {manifest.made_at}, {manifest.database}")
        _check_release(manifest)
        call_command("migrate", interactive=False, verbosity=0)
        if filled := rows.find_filled_tables():
            raise ArenaError(
                "A backup is restored into an empty installation, and this one has rows in "
                f"{', '.join(filled)}. Point DATABASE_URL to a new database."
            )
        written: list[str] = []
        try:
            _write_media(archive, manifest, written)
            say(f"pictures: {len(written)}")
            with transaction.atomic():
                _write_rows(archive, manifest)
        except BaseException:
            for name in written:
                default_storage.delete(name)
            raise
        say(f"rows: {sum(manifest.rows.values())} of {len(manifest.rows)} tables")
        _write_key(archive, manifest)
    return manifest


def _check_release(manifest: Manifest) -> None:
    """Raise unless the backup has the tables of this release."""
    ours, theirs = set(applied_migrations()), set(manifest.migrations)
    tables = {rows.label_of(model) for model in rows.find_tables()}
    if ours == theirs and tables == manifest.rows.keys():
        return
    lacking = ", ".join(sorted(ours - theirs)) or "nothing"
    beyond = ", ".join(sorted(theirs - ours)) or "nothing"
    raise ArenaError(
        f"This backup is another release's: it lacks {lacking}, and has {beyond} beyond this one. "
        "Restore it with the release that made it, then bring that up to date."
    )


def _write_media(archive: zipfile.ZipFile, manifest: Manifest, written: list[str]) -> None:
    for member in manifest.members:
        if not member.startswith(MEDIA):
            continue
        name, content = member.removeprefix(MEDIA), b"".join(read_member(archive, member))
        if default_storage.exists(name):
            with default_storage.open(name) as file:
                if file.read() == content:
                    continue
            raise ArenaError(f"Another picture of the name {name} is there; nothing was restored.")
        written.append(name)
        default_storage.save(name, ContentFile(content))


def _write_rows(archive: zipfile.ZipFile, manifest: Manifest) -> None:
    rows.empty_what_migrating_made()
    for model in rows.find_tables():
        label = rows.label_of(model)
        try:
            number = rows.write_rows(model, _lines(archive, f"{ROWS}{label}.jsonl"))
        except (ValueError, TypeError, DatabaseError) as error:
            raise BackupUnreadable(f"The rows of {label} can't be stored: {error}") from error
        if number != manifest.rows[label]:
            raise BackupUnreadable(f"{label} has {number} rows, not {manifest.rows[label]}.")
    rows.reset_sequences()


def _lines(archive: zipfile.ZipFile, member: str) -> Iterator[bytes]:
    with archive.open(member) as file:
        yield from file


def _write_key(archive: zipfile.ZipFile, manifest: Manifest) -> None:
    """Sessions and links go on where the key was the installation's own."""
    if SECRET_KEY in manifest.members:
        write_whole(settings.VAR_DIR / SECRET_KEY, archive.read(SECRET_KEY), mode=0o600)
