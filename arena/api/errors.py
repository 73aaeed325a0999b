"""The one form of every API error, and the status of each exception.

    {"error": {"code": "already_decided", "message": "...", "outcome": "A"}}

`message` is a sentence for people. `fields` (lists of sentences by field) comes with 422,
`outcome` (the stored one) with a pair that is already decided.
"""

from typing import Any

from django.core.exceptions import PermissionDenied, RequestDataTooBig
from django.http import Http404, JsonResponse
from django.utils.translation import gettext as _
from rest_framework.exceptions import APIException, NotAuthenticated, ParseError, ValidationError
from rest_framework.response import Response

from arena import errors
from arena.models import OUTCOME_LETTERS
from augment.errors import AugmentError, Conflict

STATUS: tuple[tuple[type[Exception], int, str], ...] = (
    (errors.TokenOver, 401, "signed_out"),
    (errors.TooManyRequests, 429, "too_many_requests"),
    (errors.NotYours, 404, "not_found"),
    (errors.NoSnapshot, 404, "not_found"),
    (errors.LinkOver, 410, "link_over"),
    (errors.StudyNotOpen, 410, "study_not_open"),
    (errors.StudyStillOpen, 403, "study_still_open"),
    (errors.AlreadyDecided, 409, "already_decided"),
    (errors.InvalidVote, 422, "invalid"),
    (errors.TooFast, 429, "too_fast"),
    (errors.DatabaseBusy, 503, "busy"),
    (errors.StillUnderWay, 409, "under_way"),
    (errors.BeingDrawn, 409, "being_drawn"),
    (errors.KeyReused, 422, "key_reused"),
    (Conflict, 409, "conflict"),
    (AugmentError, 400, "refused"),
    (Http404, 404, "not_found"),
    (PermissionDenied, 403, "forbidden"),
    (RequestDataTooBig, 413, "too_large"),
    (ValidationError, 422, "invalid"),
    (ParseError, 422, "invalid"),
)
"""The first match wins."""

CODES = {401: "signed_out", 403: "forbidden", 429: "too_fast"}
"""Of DRF's other exceptions, which have codes of their own where none stands here."""


def answer_error(exc: Exception, context: object = None) -> Response | None:
    """Return the response to an exception, None for a bug, which is raised again."""
    kinds = ((status, code) for kind, status, code in STATUS if isinstance(exc, kind))
    status, code = next(kinds, (0, ""))
    if not status and isinstance(exc, APIException):
        status = exc.status_code
        code = CODES.get(status, exc.default_code)
    if not status:
        return None
    headers = {}
    if status == 401:  # the browser can tell that it only has to sign in again
        is_token = isinstance(exc, errors.TokenOver)
        headers["WWW-Authenticate"] = "Bearer" if is_token else "Session"
    if hasattr(exc, "retry_after_s"):
        headers["Retry-After"] = str(exc.retry_after_s)
    error = {"code": code, "message": _message(exc), **_extras(exc)}
    return Response({"error": error}, status=status, headers=headers)


def fault(status: int, code: str, message: str) -> JsonResponse:
    """Return an error outside any view; it needs neither database nor session."""
    return JsonResponse({"error": {"code": code, "message": message}}, status=status)


def busy_message() -> str:
    """Say that the database can't be written, in the language of the request."""
    text = _(
        "The database can't be written just now (it is busy, or its disk is full), so nothing "
        "was saved. Try again in %(seconds)s s."
    )
    return text % {"seconds": errors.DatabaseBusy.retry_after_s}


# --- Private -----------------------------------------------------------------------------------


def _message(exc: Exception) -> str:
    match exc:
        case ValidationError():
            return "The request can't be read; see the fields."
        case NotAuthenticated():
            return "Please sign in again."
        case RequestDataTooBig():
            return "The request is too large to be read."
        case APIException():
            return str(exc.detail)
        case Http404():  # its own text names tables
            return _("There is nothing at this address.")
        case PermissionDenied():
            return _("Your account may not do this.")
        case errors.DatabaseBusy():
            return busy_message()
    return str(exc)


def _extras(exc: Exception) -> dict[str, Any]:
    match exc:
        case errors.AlreadyDecided():
            return {"outcome": OUTCOME_LETTERS[exc.outcome]}
        case ValidationError():
            return {"fields": exc.detail}
        case errors.InvalidVote():
            return {"fields": {name: [sentence] for name, sentence in exc.fields.items()}}
        case ParseError():
            return {"fields": {"body": [str(exc.detail)]}}
    return {}
