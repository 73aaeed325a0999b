"""Zips whose bytes depend on nothing but their files."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

ZIP = "zip"
CONTENT_TYPE = "application/zip"

_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a zip can name: what is in it says when it was made."""

_READABLE = 0o100644 << 16
_UNIX = 3


def zip_bytes(files: Mapping[str, bytes]) -> bytes:
    """The files in one zip, by name."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, date_time=_EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = _READABLE
            entry.create_system = _UNIX
            archive.writestr(entry, files[name])
    return packed.getvalue()
