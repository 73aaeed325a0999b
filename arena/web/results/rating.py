"""Rating a study from a page: at once, or by a worker where that takes longer."""

from __future__ import annotations

from functools import partial
from typing import Unpack

from django.contrib import messages
from django.db import transaction
from django.http import HttpRequest

from arena import tasks
from arena.models import Study
from arena.services.ratings import Choices, is_big, plan_snapshot, rate


def rate_or_send(request: HttpRequest, study: Study, **choices: Unpack[Choices]) -> None:
    """Rate a study's current votes; with many of them a worker does, and a message says so.

    Raises:
        ArenaError, AugmentError: Those of `plan_snapshot`; QueueFault where no worker is reached.
    """
    if not is_big(study):
        rate(study=study, **choices)
        return
    with transaction.atomic():
        planned = plan_snapshot(study=study, **choices)
        transaction.on_commit(partial(tasks.send_snapshot, planned.pk))
    messages.success(request, "The rating is being computed.")
