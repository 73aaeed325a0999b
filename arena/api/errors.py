"""One shape for everything that goes wrong on the wire, and one table of status codes.

    {"error": {"code": "already_decided", "message": "...", "outcome": "A"}}

`message` is a sentence for a person. `fields` (per field a list of sentences) comes with 422,
`outcome` (the stored one) with a matchup that is decided already. What pages show of them is in
the language of whoever asks.
"""

from __future__ import annotations

from typing import Any

from django.core.exceptions import PermissionDenied, RequestDataTooBig
from django.http import Http404
from django.utils.translation import gettext as _
from django.views.decorators.cache import never_cache
from django.views.decorators.http import conditional_page
from rest_framework import exceptions
from rest_framework.parsers import BaseParser
from rest_framework.request import Request
from rest_framework.response import Response
from rest_framework.views import APIView

from arena.api.parsing import SoundJSONParser
from arena.api.schema import ArenaSchema
from arena.errors import (
    AlreadyDecided,
    AlreadyLabelled,
    ArenaError,
    DatabaseBusy,
    InvalidPreference,
    InvalidVote,
    LabellingClosed,
    LinkOver,
    NoSnapshot,
    NotYours,
    StudyNotOpen,
    StudyStillOpen,
    TokenOver,
    TooFast,
    TooManyRequests,
)
from arena.models import OUTCOME_LETTERS
from augment.errors import AugmentError, Conflict
from augment.services.wording import translate

STATUS: tuple[tuple[type[Exception], int, str], ...] = (
    (TokenOver, 401, "signed_out"),
    (TooManyRequests, 429, "too_many_requests"),
    (NotYours, 404, "not_found"),
    (NoSnapshot, 404, "not_found"),
    (exceptions.NotFound, 404, "not_found"),
    (LinkOver, 410, "link_over"),
    (Http404, 404, "not_found"),
    (StudyNotOpen, 410, "study_not_open"),
    (StudyStillOpen, 403, "study_still_open"),
    (AlreadyDecided, 409, "already_decided"),
    (AlreadyLabelled, 409, "already_labelled"),
    (LabellingClosed, 410, "labelling_closed"),
    (InvalidVote, 422, "invalid"),
    (InvalidPreference, 422, "invalid"),
    (TooFast, 429, "too_fast"),
    (DatabaseBusy, 503, "busy"),
    (Conflict, 409, "conflict"),
    (ArenaError, 400, "refused"),
    (AugmentError, 400, "refused"),
    (exceptions.ValidationError, 422, "invalid"),
    (exceptions.ParseError, 422, "invalid"),
    (exceptions.NotAuthenticated, 401, "signed_out"),
    (exceptions.AuthenticationFailed, 401, "signed_out"),
    (exceptions.PermissionDenied, 403, "forbidden"),
    (PermissionDenied, 403, "forbidden"),
    (exceptions.MethodNotAllowed, 405, "method_not_allowed"),
    (exceptions.NotAcceptable, 406, "not_acceptable"),
    (RequestDataTooBig, 413, "too_large"),
    (exceptions.UnsupportedMediaType, 415, "unsupported_media_type"),
    (exceptions.Throttled, 429, "too_fast"),
)
"""The first row that fits decides; what is in no row is a fault of ours and stays one."""


class ApiView(APIView):
    """What every resource shares: how a body is read, how errors look, and what a GET is worth.

    Every answer to a GET that may be kept has an ETag; the same one asked for again is 304.

    Attributes:
        is_never_cached: Whether its answers are nobody's to keep.
        is_public: Whether it is for those who are not signed in.
        may_miss: Whether a GET can find nothing, beside what its path names.
        read_errors: Further statuses that a GET can have, for the document.
    """

    parser_classes: tuple[type[BaseParser], ...] = (SoundJSONParser,)
    schema = ArenaSchema()
    is_never_cached = False
    is_public = False
    may_miss = False
    read_errors: tuple[int, ...] = ()

    @classmethod
    def as_view(cls, **initkwargs: Any) -> Any:
        """The view, with its conditional GETs."""
        view = super().as_view(**initkwargs)
        return never_cache(view) if cls.is_never_cached else conditional_page(view)

    def finalize_response(self, request: Request, response: Any, *args: Any, **kwargs: Any) -> Any:
        """The answer, which no cache between may keep."""
        response.headers.setdefault("Cache-Control", "private, no-cache")
        return super().finalize_response(request, response, *args, **kwargs)

    def handle_exception(self, exc: Exception) -> Response:
        """Turn an error of the table into its response; any other is raised again."""
        found = _response(exc)
        if found is None:
            raise exc
        found.exception = True
        return found


def _response(exc: Exception) -> Response | None:
    for kind, status, code in STATUS:
        if isinstance(exc, kind):
            headers = {}
            if status == 401:  # the browser can tell that it only has to sign in again
                headers["WWW-Authenticate"] = "Bearer" if isinstance(exc, TokenOver) else "Session"
            if isinstance(exc, (TooFast, TooManyRequests, DatabaseBusy)):
                headers["Retry-After"] = str(exc.retry_after_s)
            error = {"code": code, "message": _message(exc), **_extras(exc)}
            return Response({"error": error}, status=status, headers=headers)
    return None


def _message(exc: Exception) -> str:
    if isinstance(exc, exceptions.ValidationError):
        return "The request can't be read; see the fields."
    if isinstance(exc, exceptions.NotAuthenticated):
        return "Please sign in again."
    if isinstance(exc, RequestDataTooBig):
        return "The request is too large to be read."
    if isinstance(exc, exceptions.APIException):
        return str(exc.detail)
    if isinstance(exc, Http404):  # its own text names tables
        return _("There is nothing at this address.")
    if isinstance(exc, PermissionDenied):
        return _("Your account may not do this.")
    return translate(exc)


def _extras(exc: Exception) -> dict[str, Any]:
    if isinstance(exc, AlreadyDecided):
        return {"outcome": OUTCOME_LETTERS[exc.outcome]}
    if isinstance(exc, exceptions.ValidationError):
        return {"fields": exc.detail}
    if isinstance(exc, (InvalidVote, InvalidPreference)):
        return {"fields": {name: [translate(sentence)] for name, sentence in exc.fields.items()}}
    if isinstance(exc, exceptions.ParseError):
        return {"fields": {"body": [str(exc.detail)]}}
    return {}
