"""The one form of every API error, and the status of each exception.

    {"error": {"code": "already_decided", "message": "...", "outcome": "A"}}

`message` is a sentence for people. `fields` (lists of sentences by field) comes with 422,
`outcome` (the stored one) with a pair that is already decided.
"""

from typing import Any

from django.core.exceptions import PermissionDenied, RequestDataTooBig
from django.http import Http404, JsonResponse
from django.utils.translation import gettext as _
from rest_framework import exceptions
from rest_framework.response import Response

from arena.errors import (
    AlreadyDecided,
    ArenaError,
    DatabaseBusy,
    InvalidVote,
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
    (InvalidVote, 422, "invalid"),
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
"""The first match wins; an exception without a row is a bug and is raised again."""


def error_response(exc: Exception) -> Response | None:
    """Return the response to an exception, None for one that is not in the table."""
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


def fault(status: int, code: str, message: str) -> JsonResponse:
    """Return an error outside any view; it needs neither database nor session."""
    return JsonResponse({"error": {"code": code, "message": message}}, status=status)


def busy_message() -> str:
    """Say that the database can't be written, in the language of the request."""
    text = _(
        "The database can't be written just now (it is busy, or its disk is full), so nothing "
        "was saved. Try again in %(seconds)s s."
    )
    return text % {"seconds": DatabaseBusy.retry_after_s}


# --- Private -----------------------------------------------------------------------------------


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
    if isinstance(exc, DatabaseBusy):
        return busy_message()
    return str(exc)


def _extras(exc: Exception) -> dict[str, Any]:
    if isinstance(exc, AlreadyDecided):
        return {"outcome": OUTCOME_LETTERS[exc.outcome]}
    if isinstance(exc, exceptions.ValidationError):
        return {"fields": exc.detail}
    if isinstance(exc, InvalidVote):
        return {"fields": {name: [sentence] for name, sentence in exc.fields.items()}}
    if isinstance(exc, exceptions.ParseError):
        return {"fields": {"body": [str(exc.detail)]}}
    return {}
