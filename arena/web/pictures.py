"""How a picture goes out: private, and saying nothing about its file."""

from __future__ import annotations

from django.core.files.storage import default_storage
from django.http import FileResponse, Http404


def picture_response(name: str) -> FileResponse:
    """The stored PNG of that name.

    Neither ETag nor Last-Modified nor a file name goes with it: they would tell which pictures
    were made together.

    Raises:
        Http404: There is no name or no such file.
    """
    if not name or not default_storage.exists(name):
        raise Http404
    response = FileResponse(default_storage.open(name), content_type="image/png")
    response["Content-Disposition"] = "inline"
    response["Cache-Control"] = "private, max-age=31536000, immutable"
    return response
