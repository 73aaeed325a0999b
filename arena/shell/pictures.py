"""Responses with pictures, private and without their file's name, and with files of workers."""

from collections.abc import Callable
from functools import wraps
from typing import Any

from django.core.files.storage import default_storage
from django.http import FileResponse, Http404, HttpRequest, JsonResponse
from django.http.response import HttpResponseBase

from arena.exports.drawing import recolour
from arena.exports.files import CONTENT_TYPE
from arena.models.files import WrittenFile
from augment.models import Augmentation
from augment.services.scenarios import WIDTHS_PX, film_document, shrink

_KEPT = "private, max-age=31536000, immutable"


def charts_for_pages(view: Callable[..., Any]) -> Callable[..., Any]:
    """Return a view whose charts have the pages' colours where the address says `?page`."""

    @wraps(view)
    def answer(request: HttpRequest, *args: Any, **kwargs: Any) -> Any:
        response = view(request, *args, **kwargs)
        if "page" in request.GET and response.get("Content-Type") == "image/svg+xml":
            response.content = recolour(response.content)
        return response

    return answer


def file_response(row: WrittenFile | None) -> FileResponse:
    """The zip that a worker has written.

    Raises:
        Http404: There is no row or no such file.
    """
    if row is None or not default_storage.exists(row.stored):
        raise Http404
    content = default_storage.open(row.stored)
    return FileResponse(content, as_attachment=True, filename=row.name, content_type=CONTENT_TYPE)


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
    response["Cache-Control"] = _KEPT
    return response


def send_picture(request: HttpRequest, name: str) -> HttpResponseBase:
    """The stored PNG of that name; its film where the address says `?film`, and what that needs.

    `?film=ground` is the picture that the film plays over.

    Raises:
        Http404: There is no such file.
    """
    if "film" not in request.GET:
        return picture_response(name)
    film = film_document(name)
    if film is None:
        raise Http404
    if request.GET["film"] == "ground":
        return picture_response(film["ground"])
    film["ground"] = f"{request.path}?film=ground&v={film['window']}"
    return JsonResponse(
        film, headers={"Cache-Control": _KEPT}, json_dumps_params={"separators": (",", ":")}
    )


def resize_picture(
    request: HttpRequest, name: str, changed: Augmentation | None = None
) -> HttpResponseBase:
    """What `send_picture` answers, or the PNG made smaller where the address says `?width=`.

    For pages of staff, who may know which pictures were made together. Of an augmentation that is
    given, the smaller one is cut to what it changes.

    Raises:
        Http404: There is no such file, or no picture is made that wide.
    """
    width = request.GET.get("width", "")
    if not width:
        return send_picture(request, name)
    if width not in map(str, WIDTHS_PX):
        raise Http404
    return picture_response(shrink(name, int(width), changed))
