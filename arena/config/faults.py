"""Errors outside any view: as JSON for programs, as a page for people."""

from __future__ import annotations

from django.http import HttpRequest, HttpResponse
from django.views.defaults import bad_request

from arena.api.errors import busy_message, fault
from arena.errors import DatabaseBusy
from arena.site import faults as pages


def answer_unreadable(request: HttpRequest, exception: Exception) -> HttpResponse:
    """Answer 400: the request is invalid, its host name for example."""
    if _wants_json(request):
        return fault(400, "bad_request", "The request can’t be read.")
    return bad_request(request, exception)


def answer_refused(request: HttpRequest, exception: Exception | None = None) -> HttpResponse:
    """Answer 403: signed in, but not allowed to do this."""
    if _wants_json(request):
        return fault(403, "forbidden", "Your account may not do this.")
    return pages.answer_refused(request, exception)


def answer_forged(request: HttpRequest, reason: str = "") -> HttpResponse:
    """Answer 403: the CSRF token is missing or old."""
    if _wants_json(request):
        return fault(403, "forbidden", "The CSRF token is missing or old.")
    return pages.answer_forged(request, reason)


def answer_missing(request: HttpRequest, exception: Exception | None = None) -> HttpResponse:
    """Answer 404: no such address, or nothing that this account may know of."""
    if _wants_json(request):
        return fault(404, "not_found", "There is nothing at this address.")
    return pages.answer_missing(request, exception)


def answer_broken(request: HttpRequest) -> HttpResponse:
    """Answer 500: a bug, which is in the log."""
    if _wants_json(request):
        return fault(500, "broken", "Something broke on our side; it was written to the log.")
    return pages.answer_broken(request)


def answer_busy(request: HttpRequest) -> HttpResponse:
    """Answer 503: the database can't be written at the moment."""
    if _wants_json(request):
        answer: HttpResponse = fault(503, "busy", busy_message())
    else:
        answer = pages.answer_busy(request)
    answer.headers["Retry-After"] = str(DatabaseBusy.retry_after_s)
    return answer


def answer_without_media(request: HttpRequest) -> HttpResponse:
    """Answer 503: the picture storage does not respond; the log says why."""
    if _wants_json(request):
        message = "Pictures can’t be reached just now. Try again later."
        answer: HttpResponse = fault(503, "no_pictures", message)
    else:
        answer = pages.answer_without_media(request)
    answer.headers["Retry-After"] = str(DatabaseBusy.retry_after_s)
    return answer


def _wants_json(request: HttpRequest) -> bool:
    """By its address, or because a program accepts JSON (a transcript) but no page."""
    if request.path_info.startswith("/api/"):
        return True
    wanted = request.get_preferred_type(["text/html", "application/json"])
    return wanted == "application/json"
