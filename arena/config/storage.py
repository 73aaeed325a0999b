"""Where pictures are kept: a folder in which every file is whole."""

from __future__ import annotations

import logging
from pathlib import Path

from django.core.files.base import File
from django.core.files.storage import FileSystemStorage

from arena.config import private
from arena.exports.files import write_pieces
from augment.errors import MediaFault

logger = logging.getLogger(__name__)


class WholeFiles(FileSystemStorage):
    """Files of this machine that are there whole or not at all; the last writer wins.

    Only their owner reads them: what contestants made is nobody's until a study shows it.

    Django's own storage makes an empty file and fills it: another worker with the same picture
    would meet half of it, and a worker that is killed would leave that half behind.
    """

    def __init__(self, location: str | Path | None = None, base_url: str | None = None) -> None:
        """Take the folder and the address from the settings unless they are given."""
        super().__init__(location=location, base_url=base_url, allow_overwrite=True)

    def _save(self, name: str, content: File[bytes]) -> str:
        path = Path(self.path(name))
        try:
            private.make_folder(path.parent)
            write_pieces(path, content.chunks(), mode=private.FILE)
        except OSError as fault:  # a full disk, a folder that somebody took away
            cause = fault.strerror or str(fault)
            logger.error("Could not write %s: %s", path, fault)
            raise MediaFault("write", str(self.location), cause) from fault
        return name
