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
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import PurePosixPath
from typing import IO, Any

from arena.errors import ArenaError

FORMAT, VERSION = "scenario-arena-backup", 1
MANIFEST, SECRET_KEY = "manifest.json", "secret_key"
ROWS, MEDIA = "rows/", "media/"
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


def open_archive(file: IO[bytes]) -> zipfile.ZipFile:
    """The file as a zip.

    Raises:
        BackupUnreadable: It is none.
    """
    try:
        return zipfile.ZipFile(file)
    except zipfile.BadZipFile as error:
        raise BackupUnreadable(f"This is no backup: {error}.") from error


def read_manifest(archive: zipfile.ZipFile) -> Manifest:
    """What the file says of itself, held against what is in it, every byte.

    Raises:
        BackupUnreadable: Another kind of file, a later version, or a member is missing, broken
            or not named.
    """
    manifest = _parse_manifest(archive)
    there = set(archive.namelist()) - {MANIFEST}
    for name in sorted(there ^ manifest.members.keys()):
        what = "is not named in its manifest" if name in there else "is missing"
        raise BackupUnreadable(f"This backup is not whole: {name} {what}.")
    for name, expected in manifest.members.items():
        _check_place(name)
        digest = hashlib.sha256()
        try:
            for part in read_member(archive, name):
                digest.update(part)
        except (zipfile.BadZipFile, EOFError, OSError) as error:
            raise BackupUnreadable(f"This backup is not whole: {name}: {error}.") from error
        if digest.hexdigest() != expected:
            raise BackupUnreadable(f"This backup is not whole: {name} has another content.")
    return manifest


def read_member(archive: zipfile.ZipFile, name: str) -> Iterator[bytes]:
    """Its content in pieces."""
    with archive.open(name) as file:
        while part := file.read(CHUNK):
            yield part


def _parse_manifest(archive: zipfile.ZipFile) -> Manifest:
    try:
        if archive.getinfo(MANIFEST).file_size > SMALL:
            raise BackupUnreadable(f"This is no backup: its {MANIFEST} is too long.")
        document = json.loads(archive.read(MANIFEST))
        if document["format"] != FORMAT:
            raise BackupUnreadable(f"This is no backup: its format is not {FORMAT}.")
        if document["version"] != VERSION:
            raise BackupUnreadable(
                f"This backup has version {document['version']} of its format; this release "
                f"reads {VERSION}."
            )
        return Manifest(
            made_at=str(document["made_at"]),
            database=str(document["database"]),
            migrations=[str(name) for name in document["migrations"]],
            rows={str(label): int(number) for label, number in document["rows"].items()},
            members={str(name): str(digest) for name, digest in document["members"].items()},
        )
    except (KeyError, TypeError, ValueError, AttributeError, zipfile.BadZipFile) as error:
        raise BackupUnreadable(f"This is no backup: no {MANIFEST} that can be read.") from error


def _check_place(name: str) -> None:
    """Raise for what would be written outside of the media."""
    parts = PurePosixPath(name).parts
    is_known = name == SECRET_KEY or name.startswith((ROWS, MEDIA))
    if not is_known or name.startswith("/") or ".." in parts or "\\" in name or "\0" in name:
        raise BackupUnreadable(f"This backup has a member at a place of none: {name!r}.")
