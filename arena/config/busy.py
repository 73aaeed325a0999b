"""Nobody waits long for a database that something else keeps to itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from django.conf import settings
from django.db.backends.base.base import BaseDatabaseWrapper
from django.db.backends.signals import connection_created
from django.http import HttpRequest, HttpResponse
from django.http.response import HttpResponseBase

from arena.config import faults
from arena.errors import DatabaseBusy
from arena.services.turns import is_lock_fault, limit_waiting


class BusyMiddleware:
    """Answers 503 where a lock was not to be had in time; what was asked can be asked again."""

    def __init__(self, get_response: Callable[[HttpRequest], HttpResponseBase]) -> None:
        self.get_response = get_response

    def __call__(self, request: HttpRequest) -> HttpResponseBase:
        """The answer of whoever is next."""
        return self.get_response(request)

    def process_exception(self, request: HttpRequest, exception: Exception) -> HttpResponse | None:
        """Tell it from faults of ours, which stay what they are."""
        if isinstance(exception, DatabaseBusy) or is_lock_fault(exception):
            return faults.answer_busy(request)
        return None


def limit_connections() -> None:
    """Have the connections of a web server wait for locks no longer than a vote may.

    Workers and commands have nobody who waits for an answer: theirs wait longer.
    """
    connection_created.connect(_limit)


def _limit(connection: BaseDatabaseWrapper, **_: Any) -> None:
    limit_waiting(connection, settings.VOTE_WAIT_S)
