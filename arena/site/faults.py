"""What a person sees when something is refused, missing or broken."""

from __future__ import annotations

from datetime import timedelta

from axes.helpers import get_cool_off
from django.http import HttpRequest, HttpResponse
from django.shortcuts import render
from django.template.loader import render_to_string


def answer_refused(request: HttpRequest, exception: Exception | None = None) -> HttpResponse:
    """403: signed in, but not for this page."""
    return render(request, "403.html", status=403)


def answer_missing(request: HttpRequest, exception: Exception | None = None) -> HttpResponse:
    """404: nothing here, or nothing that this person may know of."""
    return render(request, "404.html", status=404)


def answer_broken(request: HttpRequest) -> HttpResponse:
    """500: asks nothing of database or session, which may be what broke."""
    return HttpResponse(render_to_string("500.html"), status=500)


def answer_busy(request: HttpRequest) -> HttpResponse:
    """503: the database can't be written just now, so nothing is asked of it here."""
    return HttpResponse(render_to_string("503.html"), status=503)


def answer_without_media(request: HttpRequest) -> HttpResponse:
    """503: what keeps the pictures does not answer; the log says why."""
    return HttpResponse(render_to_string("503.html", {"lacks_pictures": True}), status=503)


def answer_forged(request: HttpRequest, reason: str = "") -> HttpResponse:
    """403 for a form whose token is missing or old; nothing of it was kept."""
    return render(request, "403_csrf.html", status=403)


def answer_locked(
    request: HttpRequest, answer: HttpResponse | None = None, credentials: object = None
) -> HttpResponse:
    """429: too many wrong passwords; says for how long, and what to do meanwhile."""
    minutes = (get_cool_off(request) or timedelta()) // timedelta(minutes=1)
    return render(request, "locked.html", {"minutes": minutes}, status=429)
