"""Whether a fault is told as a page or in the shape of the wire."""

from __future__ import annotations

from django.http import HttpRequest, HttpResponse
from django.views.defaults import bad_request

from arena.api import faults as wire
from arena.errors import DatabaseBusy
from arena.web import faults as pages


def unreadable(request: HttpRequest, exception: Exception) -> HttpResponse:
    """400."""
    found = wire.unreadable if _is_of_the_wire(request) else bad_request
    return found(request, exception)


def refused(request: HttpRequest, exception: Exception | None = None) -> HttpResponse:
    """403."""
    found = wire.refused if _is_of_the_wire(request) else pages.refused
    return found(request, exception)


def forged(request: HttpRequest, reason: str = "") -> HttpResponse:
    """403 for a missing or old token."""
    found = wire.forged if _is_of_the_wire(request) else pages.forged
    return found(request, reason)


def missing(request: HttpRequest, exception: Exception | None = None) -> HttpResponse:
    """404."""
    found = wire.missing if _is_of_the_wire(request) else pages.missing
    return found(request, exception)


def broken(request: HttpRequest) -> HttpResponse:
    """500."""
    return wire.broken(request) if _is_of_the_wire(request) else pages.broken(request)


def busy(request: HttpRequest) -> HttpResponse:
    """503."""
    answer = wire.busy(request) if _is_of_the_wire(request) else pages.busy(request)
    answer.headers["Retry-After"] = str(DatabaseBusy.retry_after_s)
    return answer


def _is_of_the_wire(request: HttpRequest) -> bool:
    """By its address, or because a program asks for JSON (a transcript, say) and for no page."""
    if request.path_info.startswith("/api/"):
        return True
    wanted = request.get_preferred_type(["text/html", "application/json"])
    return wanted == "application/json"
