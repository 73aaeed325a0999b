"""Zips whose bytes depend on nothing but their files."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import IO

ZIP = "zip"
CONTENT_TYPE = "application/zip"

_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a zip can name: what is in it says when it was made."""

_READABLE = 0o100644 << 16
_UNIX = 3


def zip_folder(folder: Path, packed: IO[bytes]) -> None:
    """Write a zip of a folder's files into an open one, one file after the other."""
    with zipfile.ZipFile(packed, "w") as archive:
        for path in sorted(one for one in folder.rglob("*") if one.is_file()):
            archive.writestr(_entry(path.relative_to(folder).as_posix()), path.read_bytes())


def zip_bytes(files: Mapping[str, bytes]) -> bytes:
    """The files in one zip, by name."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name in sorted(files):
            archive.writestr(_entry(name), files[name])
    return packed.getvalue()


def _entry(name: str) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(name, date_time=_EPOCH)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.external_attr = _READABLE
    entry.create_system = _UNIX
    return entry
