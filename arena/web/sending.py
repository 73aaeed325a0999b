"""Leaving work to a worker from a page: the row is written, a fault of the queue is only told."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from django.contrib import messages
from django.db import transaction
from django.http import HttpRequest

from augment.errors import QueueFault

LOOKS = 40
"""So often a page looks again for something that a worker makes."""


def send_later(request: HttpRequest, send: Callable[[int], object], pk: int) -> None:
    """Send a message with the key of a row once what was written is committed."""
    transaction.on_commit(partial(_send, request, send, pk))


def looks_again(request: HttpRequest, *, waits: bool) -> int:
    """How often a page has looked for what it waits for, once more than before; 0 to look no more.

    Args:
        request: Whose address counts the looks.
        waits: Whether there is anything to wait for.
    """
    given = request.GET.get("look", "0")
    looked = int(given) if given.isdecimal() and len(given) < 4 else 0
    return looked + 1 if waits and looked < LOOKS else 0


def _send(request: HttpRequest, send: Callable[[int], object], pk: int) -> None:
    try:
        send(pk)
    except QueueFault as error:
        messages.warning(request, str(error))
