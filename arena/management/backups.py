"""One file with everything that an installation knows: rows, pictures and the key of sessions.

The rows are written as values, not as a dump of one database, so that a backup of SQLite can be
restored on PostgreSQL and the other way round. A backup is restored by the release that made it
(the same migrations), or by one whose further migrations are among EARLIER. The file is a zip:

manifest.json          format, when, which migrations, every member with its SHA-256
rows/LABEL.jsonl       one row a line
media/...              the pictures as they are named in the rows
secret_key             where the installation keeps its own

A study's folder has the same shape without a zip and without a key.
"""

import hashlib
import json
import os
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from datetime import datetime
from functools import partial
from importlib import import_module
from pathlib import Path, PurePosixPath
from typing import IO

from django.apps import apps
from django.conf import settings
from django.contrib.auth.hashers import make_password
from django.contrib.auth.models import Group, User
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.core.management import call_command
from django.core.management.color import no_style
from django.db import DatabaseError, IntegrityError, connection, models, transaction
from pydantic import TypeAdapter

from arena.errors import ArenaError
from arena.exports.files import write_whole
from arena.exports.written_files import FOLDERS
from arena.results.exports.closure import TRAVELLING
from arena.results.exports.study_folder import FORMAT as STUDY
from arena.results.services import stored_rows
from arena.serving.readiness import find_unapplied_migrations
from arena.shell.access import EXPERT
from augment.models import Endpoint, Simulation
from augment.services import is_stored_name
from augment.services.driving import list_allowed_planners
from augment.services.judging import COMPUTED
from augment.services.scenarios import THUMBNAILS

FORMAT, VERSION = "scenario-arena-backup", 1
MANIFEST, SECRET_KEY = "manifest.json", "secret_key"
ROWS, MEDIA = "rows/", "media/"
UNREADABLE = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError)
"""What a member says that is broken, locked with a password, or packed in a way of others."""
CHUNK = 1 << 20
EARLIER: dict[str, tuple[str, frozenset[str]]] = {
    "augment.0042_drives_have_a_version": (
        "raise_waiting",
        frozenset({"augment.simulation.version"}),
    ),
    "augment.0043_fc_plus": ("change_values", frozenset()),
    "augment.0044_open_set": ("", frozenset()),
    "augment.0045_judge_frames": ("", frozenset({"augment.judgerun.frames"})),
    "arena.0044_ask_why": ("", frozenset({"arena.study.ask_why", "arena.vote.faults"})),
    "arena.0045_provisional_above": ("", frozenset({"arena.board.provisional_above"})),
}
"""Migrations that rows may lack: what these do to values (empty for nothing), and columns that get
their default."""
SMALL = 1 << 24
"""A manifest is far below this; a longer one is none of ours."""

Say = Callable[[str], None]
Members = Mapping[str, Callable[[], IO[bytes]]]
"""What opens each member of a zip or folder, by name."""


class BackupUnreadable(ArenaError):
    """The file is no whole backup; nothing of it was restored."""


@dataclass(slots=True)
class Manifest:
    """Manifest of a backup: its versions, tables and the hash of each file."""

    migrations: list[str]
    made_at: str = ""
    database: str = ""
    rows: dict[str, int] = field(default_factory=dict)
    members: dict[str, str] = field(default_factory=dict)

    @property
    def media(self) -> list[str]:
        """The names of the files that are put into the media storage."""
        return [name.removeprefix(MEDIA) for name in self.members if name.startswith(MEDIA)]


_MANIFEST = TypeAdapter(Manifest)


# --- Taking one ----------------------------------------------------------------------------------


def take_backup(path: Path, *, now: datetime, say: Say) -> Manifest:
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
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as folder:
        beside = Path(folder, path.name)
        beside.touch(mode=0o600)
        with beside.open("wb") as file:
            with zipfile.ZipFile(file, "w") as archive:
                manifest = _fill(archive, now, say)
            file.flush()
            os.fsync(file.fileno())
        beside.rename(path)
    return manifest


def find_media(folder: str = "") -> Iterator[str]:
    """Yield the names of all pictures; zips, thumbnails and charts can be made again."""
    try:
        folders, files = default_storage.listdir(folder)
    except FileNotFoundError:  # nothing has been drawn yet
        return
    # Hidden: half a file of a worker that was killed, and a backup that is being written here.
    folders, files = (
        sorted(name for name in names if not name.startswith(".")) for names in (folders, files)
    )
    for name in files:
        yield f"{folder}{name}"
    for name in folders:
        if f"{folder}{name}" not in (*FOLDERS, THUMBNAILS, COMPUTED):
            yield from find_media(f"{folder}{name}/")


def _fill(archive: zipfile.ZipFile, now: datetime, say: Say) -> Manifest:
    manifest = Manifest(
        made_at=now.isoformat(),
        database=connection.vendor,
        migrations=stored_rows.list_migrations(),
    )

    def add(name: str, content: Iterable[bytes]) -> int:
        """Write a member and note its hash; pictures are small already and not packed again."""
        digest, number = hashlib.sha256(), 0
        member = zipfile.ZipInfo(name)
        is_picture = name.startswith(MEDIA)
        member.compress_type = zipfile.ZIP_STORED if is_picture else zipfile.ZIP_DEFLATED
        with archive.open(member, "w", force_zip64=True) as file:
            for part in content:
                digest.update(part)
                file.write(part)
                number += 1
        manifest.members[name] = digest.hexdigest()
        return number

    with stored_rows.frozen_rows():
        for model in stored_rows.find_tables():
            label = stored_rows.model_label(model)
            lines = map(stored_rows.as_line, stored_rows.read_values(model._base_manager.all()))
            manifest.rows[label] = add(f"{ROWS}{label}.jsonl", lines)
    say(f"rows: {sum(manifest.rows.values())} of {len(manifest.rows)} tables")
    pictures = list(find_media())
    for name in pictures:
        with default_storage.open(name) as file:
            add(f"{MEDIA}{name}", iter(partial(file.read, CHUNK), b""))
    say(f"pictures: {len(pictures)}")
    key = settings.VAR_DIR / SECRET_KEY
    if key.exists():
        add(SECRET_KEY, [key.read_bytes()])
    document = {"format": FORMAT, "version": VERSION, **asdict(manifest)}
    archive.writestr(MANIFEST, json.dumps(document, indent=1))
    return manifest


# --- Reading one ---------------------------------------------------------------------------------


def zip_members(file: IO[bytes]) -> Members:
    """Return the members of a zip.

    Raises:
        BackupUnreadable: It is none.
    """
    try:
        archive = zipfile.ZipFile(file)
    except zipfile.BadZipFile as error:
        raise BackupUnreadable(f"This is no backup: {error}.") from error
    return {name: partial(archive.open, name) for name in archive.namelist()}


def folder_members(root: Path) -> Members:
    """Return the files below a folder; links are none of them."""
    files = [path for path in root.rglob("*") if path.is_file() and not path.is_symlink()]
    return {path.relative_to(root).as_posix(): partial(_open_file, path) for path in files}


def _open_file(path: Path) -> IO[bytes]:
    return path.open("rb")


def read_manifest(source: Members, *, wanted: str = FORMAT) -> Manifest:
    """Return the manifest, checked against every byte of the file.

    Raises:
        BackupUnreadable: Another kind of file, a later version, or a member is missing, broken
            or not named.
    """
    manifest = _parse_manifest(source, wanted)
    there = source.keys() - {MANIFEST}
    for name in sorted(there ^ manifest.members.keys()):
        what = "is not named in its manifest" if name in there else "is missing"
        raise BackupUnreadable(f"This is not whole: {name} {what}.")
    for name, expected in manifest.members.items():
        path = PurePosixPath(name)
        is_plain = str(path) == name  # else two names could lead to one file
        if not is_plain or path.is_absolute() or {"..", "\\", "\0"} & {*path.parts, *name}:
            raise BackupUnreadable(f"A member is at a place of none: {name!r}.")
        digest = hashlib.sha256()
        try:
            with source[name]() as file:
                while part := file.read(CHUNK):
                    digest.update(part)
        except UNREADABLE as error:
            raise BackupUnreadable(f"This is not whole: {name}: {error}.") from error
        if digest.hexdigest() != expected:
            raise BackupUnreadable(f"This is not whole: {name} has another content.")
    return manifest


def _parse_manifest(source: Members, wanted: str) -> Manifest:
    try:
        with source[MANIFEST]() as file:
            content = file.read(SMALL + 1)
        if len(content) > SMALL:
            raise BackupUnreadable(f"This can't be restored: its {MANIFEST} is too long.")
        document = json.loads(content)
        if document["format"] != wanted:
            raise BackupUnreadable(f"This can't be restored: its format is not {wanted}.")
        if document["version"] != VERSION:
            raise BackupUnreadable(
                f"This has version {document['version']} of its format; this release reads "
                f"{VERSION}."
            )
        return _MANIFEST.validate_python(document)
    except (*UNREADABLE, KeyError, TypeError, ValueError, AttributeError, OSError) as error:
        text = f"This is no backup and no study: no {MANIFEST} that can be read."
        raise BackupUnreadable(text) from error


# --- Restoring one, all of it or nothing ---------------------------------------------------------


def restore_backup(path: Path, *, say: Say) -> Manifest:
    """Check the whole file, then put pictures, rows and key where they belong.

    Raises:
        BackupUnreadable: It is no whole backup.
        ArenaError: It is another release's, or this installation is not empty.
        OSError: The file can't be read, or the pictures can't be written.
    """
    with path.open("rb") as file:
        source = zip_members(file)
        manifest = read_manifest(source)
        say(f"whole: a backup of {manifest.made_at}, {manifest.database}")
        tables = stored_rows.find_tables()
        if {stored_rows.model_label(model) for model in tables} != manifest.rows.keys():
            raise BackupUnreadable("This backup has other tables than this release.")
        strange = [name for name in manifest.media if not is_stored_name(name)]
        for name in strange:  # what somebody else laid there
            say(f"left out, no file of ours: {MEDIA}{name}")

        def write() -> None:
            for label in stored_rows.MADE_BY_MIGRATING:
                apps.get_model(label)._base_manager.all().delete()
            _write_rows(source, manifest, tables, stored_rows.check_row)
            stored_rows.end_restored_work()
            if SECRET_KEY in manifest.members:
                with source[SECRET_KEY]() as key:
                    write_whole(settings.VAR_DIR / SECRET_KEY, key.read(), mode=0o600)

        media = [name for name in manifest.media if name not in strange]
        _restore(source, manifest, media, write, say)
    return manifest


def import_study(folder: Path, *, say: Say) -> Manifest:
    """Check every file of a study's folder, then take its rows and pictures in.

    Raises:
        BackupUnreadable: It is no whole study.
        ArenaError: It is another release's, or this installation is not empty.
        OSError: It can't be read, or the pictures can't be written.
    """
    source = folder_members(folder)
    manifest = read_manifest(source, wanted=STUDY)
    if strange := sorted(manifest.rows.keys() - TRAVELLING):
        raise BackupUnreadable(f"This has tables that no study has: {', '.join(strange)}.")
    if strange := sorted(name for name in manifest.media if not is_stored_name(name)):
        raise BackupUnreadable(f"This has files that no study has: {MEDIA}{strange[0]}.")
    labels = manifest.rows.keys()
    tables = [m for m in stored_rows.find_tables() if stored_rows.model_label(m) in labels]

    def write() -> None:
        _write_rows(source, manifest, tables, _check_of_study)
        # Whatever a folder says: nobody of it rules here, and no key of ours goes to its servers.
        User.objects.update(
            is_staff=False, is_superuser=False, password=make_password(None), last_login=None
        )
        group, _ = Group.objects.get_or_create(name=EXPERT)
        group.user_set.set(User.objects.all())
        Endpoint.objects.update(key_variable="")

    _restore(source, manifest, manifest.media, write, say)
    return manifest


def _check_of_study(row: models.Model) -> None:
    """Refuse what a study's folder must not hold: work to be done, and code to be loaded."""
    stored_rows.check_row(row)
    if getattr(row, "state", None) in stored_rows.UNFINISHED.get(type(row), ()):
        raise ValueError(
            f"state: {getattr(row, 'state', '')!r} is not over; a study's folder holds what has "
            "ended"
        )
    if isinstance(row, Simulation) and row.planner not in list_allowed_planners():
        raise ValueError(
            f"planner: {row.planner!r} is not allowed here, only "
            f"{', '.join(list_allowed_planners())}; ARENA_PLANNERS names more"
        )


def _restore(
    source: Members, manifest: Manifest, media: list[str], write: Callable[[], None], say: Say
) -> None:
    """Take in pictures and rows, or neither."""
    ours, theirs = set(stored_rows.list_migrations()), set(manifest.migrations)
    later = ours - theirs
    if theirs - ours or later - EARLIER.keys():
        lacking = ", ".join(sorted(later)) or "nothing"
        beyond = ", ".join(sorted(theirs - ours)) or "nothing"
        raise ArenaError(
            f"This is of another release: it lacks {lacking}, and has {beyond} beyond this one. "
            "Restore it with the release that made it, then bring that up to date."
        )
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
            stored_rows.list_prepared_rows().delete()
            write()
            for migration in sorted(later):
                if change := EARLIER[migration][0]:
                    module = import_module(migration.replace(".", ".migrations."))
                    getattr(module, change)(apps, None)
    except BaseException:
        for name in written:
            default_storage.delete(name)
        raise
    say(f"rows: {sum(manifest.rows.values())} of {len(manifest.rows)} tables")


def _write_media(source: Members, media: list[str], written: list[str]) -> None:
    for name in media:
        with source[f"{MEDIA}{name}"]() as file:
            content = file.read()
        if default_storage.exists(name):
            with default_storage.open(name) as there:
                if there.read() == content:
                    continue
            raise ArenaError(f"Another picture of the name {name} is there.")
        written.append(name)
        default_storage.save(name, ContentFile(content))


def _write_rows(
    source: Members,
    manifest: Manifest,
    tables: list[type[models.Model]],
    check: Callable[[models.Model], None],
) -> None:
    """Store the rows and hold them against each other now, not when all is kept already."""
    later = EARLIER.keys() - manifest.migrations
    lacking = frozenset[str]().union(*(EARLIER[migration][1] for migration in later))
    for model in tables:
        label = stored_rows.model_label(model)
        try:
            with source[f"{ROWS}{label}.jsonl"]() as lines:
                number = stored_rows.write_rows(model, lines, check=check, lacking=lacking)
        except (ValueError, OSError, DatabaseError) as error:
            raise BackupUnreadable(f"{ROWS}{label}.jsonl can't be stored: {error}") from error
        if number != manifest.rows[label]:
            raise BackupUnreadable(f"{label} has {number} rows, not {manifest.rows[label]}.")
    try:
        connection.check_constraints()
    except IntegrityError as error:
        raise BackupUnreadable(f"Its rows don't fit each other: {error}") from error
    stored_rows.check_votes()
    with connection.cursor() as cursor:  # the next row of each table gets a key that none has
        for statement in connection.ops.sequence_reset_sql(no_style(), list(tables)):
            cursor.execute(statement)
