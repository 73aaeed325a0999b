"""The Celery app; its settings are the CELERY_ ones of Django's settings.

A message carries the id of the request that sent it, so that the lines of a worker can be found
by it. Workers log as everything else does: see arena/config/logs.py.
"""

import os
from contextlib import ExitStack
from typing import Any

from celery import Celery
from celery.signals import before_task_publish, setup_logging, task_postrun, task_prerun

from arena.config.logs import NOBODY, current_request_id, working_for

os.environ.setdefault("DJANGO_SETTINGS_MODULE", "arena.config.settings")

app = Celery("scenario_arena")
app.config_from_object("django.conf:settings", namespace="CELERY")
app.autodiscover_tasks()

REQUEST_ID = "arena_request_id"
"""The header of a message."""

_open: dict[str, ExitStack] = {}
"""What is to be closed behind each task that runs."""


@setup_logging.connect
def leave_the_log_alone(**_: object) -> None:
    """Keep Django's log settings: Celery configures none when this signal has a receiver."""


@before_task_publish.connect
def write_request_id(headers: dict[str, Any] | None = None, **_: object) -> None:
    """Add the request id to an outgoing message."""
    if headers is not None:
        headers[REQUEST_ID] = current_request_id()


@task_prerun.connect
def take_request_id(task_id: str = "", task: Any = None, **_: object) -> None:
    """Run the task under the request id of its message."""
    stack = _open.setdefault(task_id, ExitStack())
    stack.enter_context(working_for(task.request.get(REQUEST_ID) or NOBODY))


@task_postrun.connect
def leave_request_id(task_id: str = "", **_: object) -> None:
    """Reset the request id; both signals are sent in the thread of the task."""
    _open.pop(task_id, ExitStack()).close()
