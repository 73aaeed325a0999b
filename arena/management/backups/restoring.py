"""Restore a backup, or a study's folder, into an empty installation: all of it or nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from django.conf import settings
from django.contrib.auth.hashers import make_password
from django.contrib.auth.models import Group, User
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
from arena.site.services import check_row, check_votes, end_restored_work, is_unfinished
from augment.models import Endpoint, Simulation
from augment.services.judging.simulations import allowed_planners
from augment.services.texts import is_stored_name

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
            _write_rows(source, manifest, tables, check_row)
            _settle()
            end_restored_work()
            if SECRET_KEY in manifest.members:
                with source.open(SECRET_KEY) as key:
                    write_whole(settings.VAR_DIR / SECRET_KEY, key.read(), mode=0o600)

        _restore(source, manifest, _ours_of(manifest, say), write, say)
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
    media = _media_of(manifest)
    if strange := sorted(name for name in media if not is_stored_name(name)):
        raise BackupUnreadable(f"This has files that no study has: {MEDIA}{strange[0]}.")
    tables = [
        model
        for model in stored_rows.find_tables()
        if stored_rows.label_of(model) in manifest.rows
    ]

    def write() -> None:
        _write_rows(source, manifest, tables, _check_of_study)
        _take_powers()
        _settle()

    _restore(source, manifest, media, write, say)
    return manifest


def _check_of_study(row: models.Model) -> None:
    """Refuse what a study's folder must not hold: work to be done, and code to be loaded."""
    check_row(row)
    if is_unfinished(row):
        raise ValueError(
            f"state: {getattr(row, 'state', '')!r} is not over; a study's folder holds what has "
            "ended"
        )
    if isinstance(row, Simulation) and row.planner not in allowed_planners():
        raise ValueError(
            f"planner: {row.planner!r} is not allowed here, only "
            f"{', '.join(allowed_planners())}; ARENA_PLANNERS names more"
        )


def _media_of(manifest: Manifest) -> list[str]:
    """Return the names of the files that are put into the media storage."""
    members = (name for name in manifest.members if name.startswith(MEDIA))
    return [name.removeprefix(MEDIA) for name in members]


def _ours_of(manifest: Manifest, say: Callable[[str], None]) -> list[str]:
    """Return the files with names of ours; a backup may hold what somebody else laid there."""
    media = _media_of(manifest)
    for name in media:
        if not is_stored_name(name):
            say(f"left out, no file of ours: {MEDIA}{name}")
    return [name for name in media if is_stored_name(name)]


def _take_powers() -> None:
    """Whatever a folder says: nobody of it rules here, and no key of ours goes to its servers."""
    User.objects.update(
        is_staff=False, is_superuser=False, password=make_password(None), last_login=None
    )
    group, _ = Group.objects.get_or_create(name=EXPERTS)
    group.user_set.set(User.objects.all())
    Endpoint.objects.update(key_variable="")


def _restore(
    source: MemberSource,
    manifest: Manifest,
    media: list[str],
    write: Callable[[], None],
    say: Callable[[str], None],
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
        _write_media(source, media, written)
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


def _write_media(source: MemberSource, media: list[str], written: list[str]) -> None:
    for name in media:
        with source.open(f"{MEDIA}{name}") as file:
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
    check_votes()
    stored_rows.reset_sequences()


def _write_rows(
    source: MemberSource,
    manifest: Manifest,
    tables: Iterable[type[models.Model]],
    check: Callable[[models.Model], None],
) -> None:
    for model in tables:
        label = stored_rows.label_of(model)
        try:
            with source.open(f"{ROWS}{label}.jsonl") as lines:
                number = stored_rows.write_rows(model, lines, check=check)
        except (ValueError, OSError, DatabaseError) as error:
            raise BackupUnreadable(f"{ROWS}{label}.jsonl can't be stored: {error}") from error
        if number != manifest.rows[label]:
            raise BackupUnreadable(f"{label} has {number} rows, not {manifest.rows[label]}.")
