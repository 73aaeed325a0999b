"""The log: one id from the request of a browser to the task of a worker, as lines or as JSON."""

import logging
import re
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from django.http import HttpRequest
from django.http.response import HttpResponseBase

HEADER = "X-Request-ID"

NOBODY = "-"
"""The id of work that no request began: a command, or a round of recovery."""

_GIVEN = re.compile(r"[A-Za-z0-9._-]{8,64}")
_current: ContextVar[str] = ContextVar("request_id", default=NOBODY)


def current_request_id() -> str:
    """Return the request id of this thread."""
    return _current.get()


@contextmanager
def working_for(request_id: str) -> Iterator[None]:
    """Attribute everything logged or sent in this block to one request."""
    token = _current.set(request_id)
    try:
        yield
    finally:
        _current.reset(token)


class RequestIdMiddleware:
    """Give each request an id: the one that a proxy sent if it is valid, else a new one."""

    def __init__(self, get_response: Callable[[HttpRequest], HttpResponseBase]) -> None:
        self.get_response = get_response

    def __call__(self, request: HttpRequest) -> HttpResponseBase:
        given = request.headers.get(HEADER, "")
        request_id = given if _GIVEN.fullmatch(given) else secrets.token_hex(8)
        with working_for(request_id):
            answer = self.get_response(request)
        answer.headers[HEADER] = request_id
        return answer


class AddRequestId(logging.Filter):
    """Write the request id into every line."""

    def filter(self, record: logging.LogRecord) -> bool:
        record.request_id = current_request_id()
        return True


_KEY_IN_ADDRESS = re.compile(r"(/(?:invitation|i|first|welcome)/)[A-Za-z0-9_-]+")


class HideKeys(logging.Filter):
    """Mask the tokens in addresses of invitations and pictures."""

    def filter(self, record: logging.LogRecord) -> bool:
        text = record.getMessage()
        hidden = _KEY_IN_ADDRESS.sub(r"\1...", text)
        if hidden != text:
            record.msg, record.args = hidden, None
        return True
