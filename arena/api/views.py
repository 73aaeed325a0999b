"""The base of every resource: roles, parsing, errors, caching, and work left to a worker."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar, cast

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Model
from django.http import HttpResponse
from django.views.decorators.cache import never_cache
from django.views.decorators.http import conditional_page
from rest_framework import serializers
from rest_framework.parsers import BaseParser
from rest_framework.request import Request
from rest_framework.response import Response
from rest_framework.views import APIView

from arena.api.access import RoleAllowed
from arena.api.errors import error_response
from arena.api.fields import SoundJSONParser
from augment.errors import QueueFault

Row = TypeVar("Row", bound=Model)


class ApiView(APIView):
    """A resource. Answers to a GET have an ETag; the same one sent back brings 304.

    Attributes:
        readers: Roles that may GET.
        writers: Roles that may POST.
        is_never_cached: Whether answers have no ETag and may not be stored.
    """

    permission_classes: Any = (RoleAllowed,)
    parser_classes: tuple[type[BaseParser], ...] = (SoundJSONParser,)
    readers: tuple[str, ...] = ()
    writers: tuple[str, ...] = ()
    is_never_cached = False

    @classmethod
    def as_view(cls, **initkwargs: Any) -> Any:
        """Return the view, with conditional GETs."""
        view = super().as_view(**initkwargs)
        return never_cache(view) if cls.is_never_cached else conditional_page(view)

    @property
    def user(self) -> User:
        """The account that asks."""
        return cast(User, self.request.user)

    def finalize_response(self, request: Request, response: Any, *args: Any, **kwargs: Any) -> Any:
        """Keep shared caches from storing the response."""
        response.headers.setdefault("Cache-Control", "private, no-cache")
        return super().finalize_response(request, response, *args, **kwargs)

    def handle_exception(self, exc: Exception) -> Response:
        """Return the response to an exception of the table; raise any other again."""
        found = error_response(exc)
        if found is None:
            raise exc
        found.exception = True
        return found


class FileView(ApiView):
    """Answers with a file, whatever the request accepts; errors stay JSON."""

    def perform_content_negotiation(self, request: Request, force: bool = False) -> Any:
        """Never answer 406."""
        return super().perform_content_negotiation(request, force=True)


class WarnedDocument(serializers.Serializer[Any]):
    """The result of a change that workers act on."""

    warnings = serializers.SerializerMethodField(
        help_text="What did not work: without a broker it waits until there is one."
    )

    def get_warnings(self, row: Any) -> list[str]:
        """Return the warnings that the request collected."""
        found: list[str] = self.context.get("warnings", [])
        return found


def keep_and_send(keep: Callable[[], Row], send: Callable[[int], object]) -> tuple[Row, list[str]]:
    """Write a row and, once that is committed, queue its work.

    Args:
        keep: Writes the row.
        send: Queues the row with this primary key; a missing broker becomes a warning.

    Returns:
        The row, and the warnings.
    """
    warnings: list[str] = []
    with transaction.atomic():
        row = keep()
        transaction.on_commit(partial(_send, warnings, send, row.pk))
    return row, warnings


def as_file(content: bytes, content_type: str, name: str) -> HttpResponse:
    """Return a file to be saved under that name."""
    return HttpResponse(
        content,
        content_type=content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


# --- Private -----------------------------------------------------------------------------------


def _send(warnings: list[str], send: Callable[[int], object], pk: int) -> None:
    try:
        send(pk)
    except QueueFault as error:
        warnings.append(str(error))
