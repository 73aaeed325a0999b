"""Errors outside any view: as JSON for programs, as a page for people."""

from datetime import timedelta

from axes.helpers import get_cool_off
from django.http import HttpRequest, HttpResponse
from django.shortcuts import render
from django.template.loader import render_to_string
from django.views.defaults import bad_request

from arena.api.errors import busy_message, fault
from arena.errors import DatabaseBusy


def answer_unreadable(request: HttpRequest, exception: Exception) -> HttpResponse:
    """Answer 400: the request is invalid, its host name for example."""
    if _wants_json(request):
        return fault(400, "bad_request", "The request can’t be read.")
    return bad_request(request, exception)


def answer_refused(request: HttpRequest, exception: Exception | None = None) -> HttpResponse:
    """Answer 403: signed in, but not allowed to do this."""
    if _wants_json(request):
        return fault(403, "forbidden", "Your account may not do this.")
    return render(request, "403.html", status=403)


def answer_forged(request: HttpRequest, reason: str = "") -> HttpResponse:
    """Answer 403: the CSRF token is missing or old."""
    if _wants_json(request):
        return fault(403, "forbidden", "The CSRF token is missing or old.")
    return render(request, "403_csrf.html", status=403)


def answer_missing(request: HttpRequest, exception: Exception | None = None) -> HttpResponse:
    """Answer 404: no such address, or nothing that this account may know of."""
    if _wants_json(request):
        return fault(404, "not_found", "There is nothing at this address.")
    return render(request, "404.html", status=404)


def answer_locked(
    request: HttpRequest, answer: HttpResponse | None = None, credentials: object = None
) -> HttpResponse:
    """Answer 429: too many wrong passwords; says for how long, and what to do meanwhile."""
    minutes = (get_cool_off(request) or timedelta()) // timedelta(minutes=1)
    return render(request, "locked.html", {"minutes": minutes}, status=429)


# The pages below ask nothing of database or session, which may be what broke.


def answer_broken(request: HttpRequest) -> HttpResponse:
    """Answer 500: a bug, which is in the log."""
    if _wants_json(request):
        return fault(500, "broken", "Something broke on our side; it was written to the log.")
    return HttpResponse(render_to_string("500.html"), status=500)


def answer_busy(request: HttpRequest) -> HttpResponse:
    """Answer 503: the database can't be written at the moment."""
    return _later(request, "busy", busy_message())


def answer_without_media(request: HttpRequest) -> HttpResponse:
    """Answer 503: the picture storage does not respond; the log says why."""
    message = "Pictures can’t be reached just now. Try again later."
    return _later(request, "no_pictures", message, lacks_pictures=True)


def _later(request: HttpRequest, code: str, message: str, **context: bool) -> HttpResponse:
    answer = HttpResponse(render_to_string("503.html", context), status=503)
    if _wants_json(request):
        answer = fault(503, code, message)
    answer.headers["Retry-After"] = str(DatabaseBusy.retry_after_s)
    return answer


def _wants_json(request: HttpRequest) -> bool:
    """By its address, or because a program accepts JSON (a transcript) but no page."""
    if request.path_info.startswith("/api/"):
        return True
    wanted = request.get_preferred_type(["text/html", "application/json"])
    return wanted == "application/json"
