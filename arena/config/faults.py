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
    page = bad_request(request, exception)
    return _as_json(request, page, "bad_request", "The request can’t be read.")


def answer_refused(request: HttpRequest, exception: Exception | None = None) -> HttpResponse:
    """Answer 403: signed in, but not allowed to do this."""
    page = render(request, "403.html", status=403)
    return _as_json(request, page, "forbidden", "Your account may not do this.")


def answer_forged(request: HttpRequest, reason: str = "") -> HttpResponse:
    """Answer 403: the CSRF token is missing or old."""
    page = render(request, "403_csrf.html", status=403)
    return _as_json(request, page, "forbidden", "The CSRF token is missing or old.")


def answer_missing(request: HttpRequest, exception: Exception | None = None) -> HttpResponse:
    """Answer 404: no such address, or nothing that this account may know of."""
    page = render(request, "404.html", status=404)
    return _as_json(request, page, "not_found", "There is nothing at this address.")


def answer_locked(
    request: HttpRequest, answer: HttpResponse | None = None, credentials: object = None
) -> HttpResponse:
    """Answer 429: too many wrong passwords; says for how long, and what to do meanwhile."""
    minutes = (get_cool_off(request) or timedelta()) // timedelta(minutes=1)
    return render(request, "locked.html", {"minutes": minutes}, status=429)


# The pages below ask nothing of database or session, which may be what broke.


def answer_broken(request: HttpRequest) -> HttpResponse:
    """Answer 500: a bug, which is in the log."""
    page = HttpResponse(render_to_string("500.html"), status=500)
    message = "Something broke on our side; it was written to the log."
    return _as_json(request, page, "broken", message)


def answer_busy(request: HttpRequest, *, lacks_pictures: bool = False) -> HttpResponse:
    """Answer 503: the database can't be written now, or the picture storage does not respond."""
    page = HttpResponse(
        render_to_string("503.html", {"lacks_pictures": lacks_pictures}), status=503
    )
    code, message = "busy", busy_message()
    if lacks_pictures:
        code, message = "no_pictures", "Pictures can’t be reached just now. Try again later."
    answer = _as_json(request, page, code, message)
    answer.headers["Retry-After"] = str(DatabaseBusy.retry_after_s)
    return answer


def _as_json(request: HttpRequest, page: HttpResponse, code: str, message: str) -> HttpResponse:
    """Return the page, or the error as JSON for who asks at the API or accepts no page.

    A program that asks for a transcript accepts JSON alone, for example.
    """
    wanted = request.get_preferred_type(["text/html", "application/json"])
    if request.path_info.startswith("/api/") or wanted == "application/json":
        return fault(page.status_code, code, message)
    return page
