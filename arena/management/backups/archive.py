"""The file of a backup: a zip with one member a table, the pictures, and a manifest.

manifest.json          format, when, which migrations, every member with its SHA-256
rows/LABEL.jsonl       one row a line
media/...              the pictures as they are named in the rows
secret_key             where the installation keeps its own
"""

from __future__ import annotations

import hashlib
import json
import zipfile
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import IO, Any, Protocol

from arena.errors import ArenaError

FORMAT, VERSION = "scenario-arena-backup", 1
MANIFEST, SECRET_KEY = "manifest.json", "secret_key"
ROWS, MEDIA = "rows/", "media/"
UNREADABLE = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError)
"""What a member says that is broken, locked with a password, or packed in a way of others."""
CHUNK = 1 << 20
SMALL = 1 << 24
"""A manifest is far below this; a longer one is none of ours."""


class BackupUnreadable(ArenaError):
    """The file is no whole backup; nothing of it was restored."""


@dataclass(slots=True)
class Manifest:
    """What is in the file."""

    made_at: str
    database: str
    migrations: list[str]
    rows: dict[str, int] = field(default_factory=dict)
    members: dict[str, str] = field(default_factory=dict)

    def write(self, archive: zipfile.ZipFile) -> None:
        """Put it into the file, last."""
        document = {"format": FORMAT, "version": VERSION, **self._document()}
        archive.writestr(MANIFEST, json.dumps(document, indent=1))

    def _document(self) -> dict[str, Any]:
        return {
            "made_at": self.made_at,
            "database": self.database,
            "migrations": self.migrations,
            "rows": self.rows,
            "members": self.members,
        }


def add_member(
    archive: zipfile.ZipFile, manifest: Manifest, name: str, content: Iterable[bytes]
) -> None:
    """Write one member and its hash; pictures are small already and are not packed again."""
    digest = hashlib.sha256()
    member = zipfile.ZipInfo(name)
    packed = not name.startswith(MEDIA)
    member.compress_type = zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED
    with archive.open(member, "w", force_zip64=True) as file:
        for part in content:
            digest.update(part)
            file.write(part)
    manifest.members[name] = digest.hexdigest()


class MemberSource(Protocol):
    """What is restored from: a zip or a folder."""

    def find_names(self) -> set[str]:
        """The names of all members."""

    def open(self, name: str) -> IO[bytes]:
        """One member; lines and pieces can be read from it."""

    def size(self, name: str) -> int:
        """Its length in bytes."""


class ZipSource:
    """The members of a zip.

    Raises:
        BackupUnreadable: It is none.
    """

    def __init__(self, file: IO[bytes]) -> None:
        try:
            self._archive = zipfile.ZipFile(file)
        except zipfile.BadZipFile as error:
            raise BackupUnreadable(f"This is no backup: {error}.") from error

    def find_names(self) -> set[str]:
        """The names of all members."""
        return set(self._archive.namelist())

    def open(self, name: str) -> IO[bytes]:
        """One member."""
        return self._archive.open(name)

    def size(self, name: str) -> int:
        """Its length once it is unpacked."""
        return self._archive.getinfo(name).file_size


class FolderSource:
    """The files below a folder; links are none of them."""

    def __init__(self, root: Path) -> None:
        self._root = root

    def find_names(self) -> set[str]:
        """Their names, with slashes."""
        files = (path for path in self._root.rglob("*") if path.is_file())
        return {path.relative_to(self._root).as_posix() for path in files if not path.is_symlink()}

    def open(self, name: str) -> IO[bytes]:
        """One file."""
        return (self._root / name).open("rb")

    def size(self, name: str) -> int:
        """Its length."""
        return (self._root / name).stat().st_size


def read_manifest(source: MemberSource, *, wanted: str = FORMAT) -> Manifest:
    """What it says of itself, held against what is in it, every byte.

    Raises:
        BackupUnreadable: Another kind of file, a later version, or a member is missing, broken
            or not named.
    """
    manifest = _parse_manifest(source, wanted)
    there = source.find_names() - {MANIFEST}
    for name in sorted(there ^ manifest.members.keys()):
        what = "is not named in its manifest" if name in there else "is missing"
        raise BackupUnreadable(f"This is not whole: {name} {what}.")
    for name, expected in manifest.members.items():
        _check_place(name)
        digest = hashlib.sha256()
        try:
            with source.open(name) as file:
                while part := file.read(CHUNK):
                    digest.update(part)
        except UNREADABLE as error:
            raise BackupUnreadable(f"This is not whole: {name}: {error}.") from error
        if digest.hexdigest() != expected:
            raise BackupUnreadable(f"This is not whole: {name} has another content.")
    return manifest


def _parse_manifest(source: MemberSource, wanted: str) -> Manifest:
    try:
        if source.size(MANIFEST) > SMALL:
            raise BackupUnreadable(f"This can't be restored: its {MANIFEST} is too long.")
        with source.open(MANIFEST) as file:
            document = json.load(file)
        if document["format"] != wanted:
            raise BackupUnreadable(f"This can't be restored: its format is not {wanted}.")
        if document["version"] != VERSION:
            raise BackupUnreadable(
                f"This has version {document['version']} of its format; this release reads "
                f"{VERSION}."
            )
        return Manifest(
            made_at=str(document.get("made_at", "")),
            database=str(document.get("database", "")),
            migrations=[str(name) for name in document["migrations"]],
            rows={str(label): int(number) for label, number in document["rows"].items()},
            members={str(name): str(digest) for name, digest in document["members"].items()},
        )
    except (*UNREADABLE, KeyError, TypeError, ValueError, AttributeError, OSError) as error:
        text = f"This is no backup and no study: no {MANIFEST} that can be read."
        raise BackupUnreadable(text) from error


def _check_place(name: str) -> None:
    """Raise for what would be written outside of the media."""
    path = PurePosixPath(name)
    is_plain = str(path) == name  # else two names could lead to one file
    if not is_plain or path.is_absolute() or ".." in path.parts or "\\" in name or "\0" in name:
        raise BackupUnreadable(f"A member is at a place of none: {name!r}.")
