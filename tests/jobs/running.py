"""Running one row of a job, with endpoints that answer from a script."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

from augment.errors import ModelFault
from augment.llm.client import ChatClient
from augment.llm.messages import Reply
from augment.models import Augmentation, Endpoint
from augment.services.running import runner
from tests.llm.scripted import ScriptedClient


class Wire:
    """Endpoints that all answer from one script, and what they were asked for."""

    def __init__(self, *answers: str | Reply | ModelFault) -> None:
        self.client: ChatClient = ScriptedClient(answers)
        self.opened: list[str] = []

    def __call__(self, endpoint: Endpoint) -> AbstractContextManager[ChatClient]:
        self.opened.append(endpoint.label)
        return self._session()

    @contextmanager
    def _session(self) -> Iterator[ChatClient]:
        yield self.client


def ran(row: Augmentation, wire: Wire | None = None) -> Augmentation:
    assert runner.work_on(augmentation_pk=row.pk, worker="w", connect=wire or Wire())
    row.refresh_from_db()
    return row
