"""Restore a backup, or a study's folder, into an empty installation: all of it or nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from django.conf import settings
from django.contrib.auth.hashers import make_password
from django.contrib.auth.models import Group, User
from django.core.exceptions import ValidationError
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.core.management import call_command
from django.db import DatabaseError, IntegrityError, connection, models, transaction

from arena.errors import ArenaError
from arena.exports.files import write_whole
from arena.exports.study_folder.closure import TRAVELLING
from arena.exports.study_folder.writing import FORMAT as STUDY
from arena.management.backups.archive import (
    MEDIA,
    ROWS,
    SECRET_KEY,
    BackupUnreadable,
    FolderSource,
    Manifest,
    MemberSource,
    ZipSource,
    read_manifest,
)
from arena.services import stored_rows
from augment.models import Endpoint

REFUSED = (DatabaseError, ValidationError)
"""What a table says to values that are none of its."""

EXPERTS = "expert"
"""The role of every account of a study's folder."""


def restore_backup(path: Path, *, say: Callable[[str], None]) -> Manifest:
    """Check the whole file, then put pictures, rows and key where they belong.

    Raises:
        BackupUnreadable: It is no whole backup.
        ArenaError: It is another release's, or this installation is not empty.
        OSError: The file can't be read, or the pictures can't be written.
    """
    with path.open("rb") as file:
        source = ZipSource(file)
        manifest = read_manifest(source)
        say(f"whole: a backup of {manifest.made_at}, {manifest.database}")
        tables = stored_rows.find_tables()
        if {stored_rows.label_of(model) for model in tables} != manifest.rows.keys():
            raise BackupUnreadable("This backup has other tables than this release.")

        def write() -> None:
            stored_rows.empty_what_migrating_made()
            _write_rows(source, manifest, tables)
            _settle()
            if SECRET_KEY in manifest.members:
                with source.open(SECRET_KEY) as key:
                    write_whole(settings.VAR_DIR / SECRET_KEY, key.read(), mode=0o600)

        _restore(source, manifest, write, say)
    return manifest


def import_study(folder: Path, *, say: Callable[[str], None]) -> Manifest:
    """Check every file of a study's folder, then take its rows and pictures in.

    Raises:
        BackupUnreadable: It is no whole study.
        ArenaError: It is another release's, or this installation is not empty.
        OSError: It can't be read, or the pictures can't be written.
    """
    source = FolderSource(folder)
    manifest = read_manifest(source, wanted=STUDY)
    if strange := sorted(manifest.rows.keys() - TRAVELLING):
        raise BackupUnreadable(f"This has tables that no study has: {', '.join(strange)}.")
    by_label = {stored_rows.label_of(model): model for model in stored_rows.find_tables()}

    def write() -> None:
        _write_rows(source, manifest, [by_label[label] for label in manifest.rows])
        _take_powers()
        _settle()

    _restore(source, manifest, write, say)
    return manifest


def _take_powers() -> None:
    """Whatever a folder says: nobody of it rules here, and no key of ours goes to its servers."""
    User.objects.update(
        is_staff=False, is_superuser=False, password=make_password(None), last_login=None
    )
    group, _ = Group.objects.get_or_create(name=EXPERTS)
    group.user_set.set(User.objects.all())
    Endpoint.objects.update(key_variable="")


def _restore(
    source: MemberSource, manifest: Manifest, write: Callable[[], None], say: Callable[[str], None]
) -> None:
    """Pictures and rows, or neither."""
    _check_release(manifest)
    # Before tables are made as well: a database of another release is left as it is, and one
    # without rows is what a restore leaves that was killed while it made them.
    if filled := stored_rows.find_filled_tables():
        raise ArenaError(
            f"An empty installation is needed, and this one has rows in {', '.join(filled)}. "
            "Point DATABASE_URL to a new database."
        )
    call_command("migrate", interactive=False, verbosity=0)
    written: list[str] = []
    try:
        _write_media(source, manifest, written)
        say(f"pictures: {len(written)}")
        with transaction.atomic():
            write()
    except BaseException:
        for name in written:
            default_storage.delete(name)
        raise
    say(f"rows: {sum(manifest.rows.values())} of {len(manifest.rows)} tables")


def _check_release(manifest: Manifest) -> None:
    """Raise unless the tables are those of this release."""
    ours, theirs = set(stored_rows.applied_migrations()), set(manifest.migrations)
    if ours == theirs:
        return
    lacking = ", ".join(sorted(ours - theirs)) or "nothing"
    beyond = ", ".join(sorted(theirs - ours)) or "nothing"
    raise ArenaError(
        f"This is of another release: it lacks {lacking}, and has {beyond} beyond this one. "
        "Restore it with the release that made it, then bring that up to date."
    )


def _write_media(source: MemberSource, manifest: Manifest, written: list[str]) -> None:
    for member in manifest.members:
        if not member.startswith(MEDIA):
            continue
        name = member.removeprefix(MEDIA)
        with source.open(member) as file:
            content = file.read()
        if default_storage.exists(name):
            with default_storage.open(name) as there:
                if there.read() == content:
                    continue
            raise ArenaError(f"Another picture of the name {name} is there.")
        written.append(name)
        default_storage.save(name, ContentFile(content))


def _settle() -> None:
    """Hold the rows against each other now, not when all is kept already."""
    try:
        connection.check_constraints()
    except IntegrityError as error:
        raise BackupUnreadable(f"Its rows don't fit each other: {error}") from error
    stored_rows.reset_sequences()


def _write_rows(
    source: MemberSource, manifest: Manifest, tables: Iterable[type[models.Model]]
) -> None:
    for model in tables:
        label = stored_rows.label_of(model)
        try:
            with source.open(f"{ROWS}{label}.jsonl") as lines:
                number = stored_rows.write_rows(model, lines)
        except (ValueError, TypeError, KeyError, OSError, *REFUSED) as error:
            raise BackupUnreadable(f"The rows of {label} can't be stored: {error}") from error
        if number != manifest.rows[label]:
            raise BackupUnreadable(f"{label} has {number} rows, not {manifest.rows[label]}.")
