"""Errors that reach no resource, in the one shape of the wire: see arena.api.errors.

They ask nothing of database or session, which may be what broke.
"""

from __future__ import annotations

from django.http import HttpRequest, JsonResponse
from django.utils.translation import gettext as _

from arena.errors import DatabaseBusy
from augment.services.wording import translate


def answer_unreadable(request: HttpRequest, exception: Exception | None = None) -> JsonResponse:
    """400: the request itself can't be trusted, by its host name for example."""
    return _fault(400, "bad_request", _("The request can’t be read."))


def answer_refused(request: HttpRequest, exception: Exception | None = None) -> JsonResponse:
    """403: signed in, but not for this."""
    return _fault(403, "forbidden", _("Your account may not do this."))


def answer_forged(request: HttpRequest, reason: str = "") -> JsonResponse:
    """403 for a request whose token is missing or old; nothing of it was kept."""
    return _fault(403, "forbidden", _("The CSRF token is missing or old."))


def answer_missing(request: HttpRequest, exception: Exception | None = None) -> JsonResponse:
    """404: no such address, or nothing that this account may know of."""
    return _fault(404, "not_found", _("There is nothing at this address."))


def answer_broken(request: HttpRequest) -> JsonResponse:
    """500: a fault of ours, in the log."""
    return _fault(500, "broken", _("Something broke on our side; it was written to the log."))


def answer_busy(request: HttpRequest) -> JsonResponse:
    """503: the database can't be written just now."""
    return _fault(503, "busy", translate(DatabaseBusy()))


def answer_without_media(request: HttpRequest) -> JsonResponse:
    """503: what keeps the pictures does not answer; the log says why."""
    return _fault(503, "no_pictures", _("Pictures can’t be reached just now. Try again later."))


def _fault(status: int, code: str, message: str) -> JsonResponse:
    return JsonResponse({"error": {"code": code, "message": message}}, status=status)
