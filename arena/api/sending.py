"""Leaving work to a worker from a resource, and taking files."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

from django.core.exceptions import RequestDataTooBig
from django.db import transaction
from django.db.models import Model
from rest_framework import serializers
from rest_framework.parsers import MultiPartParser
from rest_framework.request import Request

from arena.api.errors import ApiView
from arena.services.sent_files import was_too_large
from augment.errors import QueueFault
from augment.services.wording import translate

Row = TypeVar("Row", bound=Model)


class WarnedDocument(serializers.Serializer[Any]):
    """What came of a change that workers have to hear of."""

    warnings = serializers.ListField(
        child=serializers.CharField(),
        default=list,
        help_text="What did not work: without a broker it waits until there is one.",
    )


class FormView(ApiView):
    """A resource that takes files, in the form that browsers send."""

    parser_classes = (MultiPartParser,)


def keep_and_send(keep: Callable[[], Row], send: Callable[[int], object]) -> tuple[Row, list[str]]:
    """Write a row, and once that is committed leave the rest to a worker.

    Args:
        keep: Writes the row.
        send: Takes its primary key to the queue; a fault of that is only told.

    Returns:
        The row, and the warnings.
    """
    warnings: list[str] = []
    with transaction.atomic():
        row = keep()
        transaction.on_commit(partial(_send, warnings, send, row.pk))
    return row, warnings


def refuse_cut_files(request: Request) -> None:
    """Nothing where every file came whole.

    Raises:
        RequestDataTooBig: One was larger than any may be, and was let pass by unread.
    """
    if was_too_large(request.META):
        raise RequestDataTooBig


# --- Private -----------------------------------------------------------------------------------


def _send(warnings: list[str], send: Callable[[int], object], pk: int) -> None:
    try:
        send(pk)
    except QueueFault as error:
        warnings.append(translate(error))
