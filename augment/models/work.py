"""What every row has that a worker brings to an outcome."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from typing import ClassVar

from django.db import models

FAILED = "failed"
"""The state of work that the machinery could not bring to another outcome; each kind has it."""


class Work(models.Model):
    """A row that a worker takes, works on and settles; `augment.services.work` says how.

    In a state of `UNDER_WAY` the row waits until it has a `claim`, and is worked on while it has
    one. Every other state is an outcome.

    Attributes:
        UNDER_WAY: The states in which something is still to be done.
        STARTED: The columns that change when a worker takes the row.
        GIVEN_BACK: The columns that change when the row waits again.
    """

    UNDER_WAY: ClassVar[tuple[str, ...]] = ("queued", "running")
    STARTED: ClassVar[Mapping[str, str]] = {"state": "running"}
    GIVEN_BACK: ClassVar[Mapping[str, str]] = {"state": "queued"}

    code = models.UUIDField(default=uuid.uuid4, unique=True, editable=False)
    state = models.CharField(max_length=20)
    reason = models.TextField(blank=True, help_text="why there is no result")
    claim = models.UUIDField(null=True, blank=True, help_text="who works on it right now")
    heartbeat_at = models.DateTimeField(null=True, blank=True)
    sent_at = models.DateTimeField(null=True, blank=True, help_text="last put on the queue")
    lost = models.PositiveSmallIntegerField(
        default=0, help_text="so many workers in a row ended over it without a word"
    )
    created_at = models.DateTimeField(auto_now_add=True)
    finished_at = models.DateTimeField(null=True, blank=True)

    class Meta:
        abstract = True

    def wait_again(self, **columns: object) -> bool:
        """Let failed work wait once more; False where it has not failed."""
        failed = type(self)._default_manager.filter(pk=self.pk, state=FAILED)
        again = {**self.GIVEN_BACK, "reason": "", "finished_at": None, "sent_at": None}
        is_waiting = bool(failed.update(**(again | columns)))
        self.refresh_from_db()
        return is_waiting
