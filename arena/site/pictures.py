"""How a picture goes out: private, and saying nothing about its file."""

from django.core.files.storage import default_storage
from django.http import FileResponse, Http404, HttpRequest

from augment.services.scenarios.pictures import WIDTHS_PX, thumbnail_of


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


def sized_picture_response(request: HttpRequest, name: str) -> FileResponse:
    """The stored PNG of that name, or made smaller where the address says `?width=`.

    For pages of staff, who may know which pictures were made together.

    Raises:
        Http404: There is no such file, or no picture is made that wide.
    """
    width = request.GET.get("width", "")
    if not width:
        return picture_response(name)
    if width not in map(str, WIDTHS_PX):
        raise Http404
    return picture_response(thumbnail_of(name, int(width)))
