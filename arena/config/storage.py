"""Storage of pictures and static files on this machine."""

from __future__ import annotations

import logging
from datetime import datetime
from pathlib import Path

from django.core.files.base import File
from django.core.files.storage import FileSystemStorage
from whitenoise.storage import CompressedManifestStaticFilesStorage

from arena.exports.files import write_pieces
from augment.errors import MediaFault

logger = logging.getLogger(__name__)


class WholeFiles(FileSystemStorage):
    """Store files atomically, readable by their owner alone; the last writer wins.

    Django's own storage creates an empty file and fills it: another worker with the same picture
    would read half of it, and a worker that is killed would leave that half behind.
    """

    def __init__(self, location: str | Path | None = None, base_url: str | None = None) -> None:
        super().__init__(location=location, base_url=base_url, allow_overwrite=True)

    def find_older(self, folder: str, before: datetime) -> list[str]:
        """Return the files of a folder that were written before that time."""
        files = Path(self.path(folder)).glob("*")
        at = before.timestamp()
        return [f"{folder}/{file.name}" for file in files if file.stat().st_mtime < at]

    def _save(self, name: str, content: File[bytes]) -> str:
        path = Path(self.path(name))
        try:
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_pieces(path, content.chunks(), mode=0o600)
        except OSError as fault:  # a full disk, a folder that somebody took away
            cause = fault.strerror or str(fault)
            logger.error("Could not write %s: %s", path, fault)
            raise MediaFault("write", str(self.location), cause) from fault
        return name


class ModuleStorage(CompressedManifestStaticFilesStorage):  # type: ignore[misc] # untyped
    """Static files with hashed names, also inside `import` statements."""

    support_js_module_import_aggregation = True
