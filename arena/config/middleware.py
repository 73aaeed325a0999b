"""Middleware: 503 for a busy database, and headers that every answer carries."""

import logging
from collections.abc import Callable
from typing import Any

from django.conf import settings
from django.contrib.auth.middleware import LoginRequiredMiddleware
from django.contrib.auth.views import redirect_to_login
from django.db.backends.base.base import BaseDatabaseWrapper
from django.http import HttpRequest, HttpResponse, HttpResponseRedirect
from django.http.response import HttpResponseBase
from django.utils.http import url_has_allowed_host_and_scheme

from arena.config import faults
from arena.errors import DatabaseBusy, NotYours
from arena.voting.services.turns import limit_waiting
from augment.errors import MediaFault
from augment.services import is_passing

logger = logging.getLogger(__name__)


class FaultMiddleware:
    """Answer 404 for what is somebody else's, as for what does not exist.

    And 503 while the database can't be written or the picture storage is unreachable.
    """

    def __init__(self, get_response: Callable[[HttpRequest], HttpResponseBase]) -> None:
        self.get_response = get_response

    def __call__(self, request: HttpRequest) -> HttpResponseBase:
        if "%00" in request.get_full_path():  # PostgreSQL has no such text
            return faults.answer_missing(request)
        return self.get_response(request)

    def process_exception(self, request: HttpRequest, exception: Exception) -> HttpResponse | None:
        """Return the answer, or None for any other exception."""
        if isinstance(exception, NotYours):
            return faults.answer_missing(request, exception)
        if isinstance(exception, DatabaseBusy) or is_passing(exception):
            logger.warning("%s", exception.__cause__ or exception)
            return faults.answer_busy(request)
        if isinstance(exception, MediaFault):
            logger.error("%s", exception)
            return faults.answer_busy(request, lacks_pictures=True)
        return None


class SignInMiddleware(LoginRequiredMiddleware):
    """Lead who is not signed in to the login, and from there to a page that can be looked at."""

    def handle_no_permission(
        self, request: HttpRequest, view_func: Callable[..., Any]
    ) -> HttpResponseRedirect:
        """Return the redirect; what was sent is lost, and its address often takes nothing else."""
        page = request.headers.get("Referer")
        if request.method == "POST" and url_has_allowed_host_and_scheme(page, request.get_host()):
            return redirect_to_login(str(page))
        return super().handle_no_permission(request, view_func)


def limit_connection(connection: BaseDatabaseWrapper, **_: Any) -> None:
    """Limit how long a new connection of a web server waits for locks; workers may wait longer."""
    limit_waiting(connection, settings.VOTE_WAIT_S)


NOT_KEPT = "private, no-store"
"""Nothing of a page stays behind in a browser after signing out, nor in a proxy."""

NOT_USED = (
    *("camera", "display-capture", "geolocation", "microphone", "midi", "payment"),
    *("publickey-credentials-get", "serial", "usb"),
)
"""Features of browsers that no page needs, so none may ask for them.

Bluetooth is none of them: Chromium on Linux does not know it and warns on every page.
"""

POLICY = ", ".join(f"{feature}=()" for feature in NOT_USED)


class HeaderMiddleware:
    """Add caching and permissions headers; stands first, so that errors get them as well."""

    def __init__(self, get_response: Callable[[HttpRequest], HttpResponseBase]) -> None:
        self.get_response = get_response

    def __call__(self, request: HttpRequest) -> HttpResponseBase:
        answer = self.get_response(request)
        answer.headers.setdefault("Cache-Control", NOT_KEPT)
        answer.headers.setdefault("Permissions-Policy", POLICY)
        return answer
