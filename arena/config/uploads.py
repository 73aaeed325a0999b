"""Size limit of a file that comes by a form, before any page has looked at it."""

from typing import Any

from django.conf import settings
from django.core.files.uploadhandler import FileUploadHandler, SkipFile

from arena.scenarios.services import FILE_TOO_LARGE
from arena.serving.web_worker import CUT


class BoundedUpload(FileUploadHandler):
    """Stands before the handlers that keep a file, and skips the rest of one that is too large.

    The other fields of the form are read all the same, so that its page can say what was wrong.
    """

    _left = 0

    def new_file(self, *arguments: Any, **named: Any) -> None:
        """Begin to count; of a body that was cut no file is whole for sure."""
        super().new_file(*arguments, **named)
        is_cut = self.request is not None and f"HTTP_{CUT}" in self.request.META
        self._left = 0 if is_cut else settings.UPLOAD_MB * 1_000_000

    def receive_data_chunk(self, raw_data: bytes, start: int) -> bytes:
        """Hand the piece on, or skip what is left of the file."""
        self._left -= len(raw_data)
        if self._left < 0:
            if self.request is not None:
                self.request.META[FILE_TOO_LARGE] = True
            raise SkipFile
        return raw_data

    def file_complete(self, file_size: int) -> None:
        """Others keep it."""
