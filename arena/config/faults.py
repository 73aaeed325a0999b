"""Whether a fault is told as a page or in the shape of the wire."""

from __future__ import annotations

from django.http import HttpRequest, HttpResponse
from django.views.defaults import bad_request

from arena.api import faults as wire
from arena.errors import DatabaseBusy
from arena.web import faults as pages


def answer_unreadable(request: HttpRequest, exception: Exception) -> HttpResponse:
    """400."""
    answer = wire.answer_unreadable if _is_of_the_wire(request) else bad_request
    return answer(request, exception)


def answer_refused(request: HttpRequest, exception: Exception | None = None) -> HttpResponse:
    """403."""
    answer = wire.answer_refused if _is_of_the_wire(request) else pages.answer_refused
    return answer(request, exception)


def answer_forged(request: HttpRequest, reason: str = "") -> HttpResponse:
    """403 for a missing or old token."""
    answer = wire.answer_forged if _is_of_the_wire(request) else pages.answer_forged
    return answer(request, reason)


def answer_missing(request: HttpRequest, exception: Exception | None = None) -> HttpResponse:
    """404."""
    answer = wire.answer_missing if _is_of_the_wire(request) else pages.answer_missing
    return answer(request, exception)


def answer_broken(request: HttpRequest) -> HttpResponse:
    """500."""
    answer = wire.answer_broken if _is_of_the_wire(request) else pages.answer_broken
    return answer(request)


def answer_busy(request: HttpRequest) -> HttpResponse:
    """503."""
    answer = wire.answer_busy(request) if _is_of_the_wire(request) else pages.answer_busy(request)
    answer.headers["Retry-After"] = str(DatabaseBusy.retry_after_s)
    return answer


def answer_without_media(request: HttpRequest) -> HttpResponse:
    """503."""
    build = wire.answer_without_media if _is_of_the_wire(request) else pages.answer_without_media
    answer = build(request)
    answer.headers["Retry-After"] = str(DatabaseBusy.retry_after_s)
    return answer


def _is_of_the_wire(request: HttpRequest) -> bool:
    """By its address, or because a program asks for JSON (a transcript, say) and for no page."""
    if request.path_info.startswith("/api/"):
        return True
    wanted = request.get_preferred_type(["text/html", "application/json"])
    return wanted == "application/json"
