"""Webhooks in tests: an address with all events, and who takes their messages."""

from __future__ import annotations

import json
from datetime import datetime, timedelta
from typing import Any

from django.contrib.auth.models import User
from django.utils import timezone

from arena.queries.webhooks import EVENTS
from arena.services.webhooks import FreshWebhook, add_webhook, deliver_due, plan_deliveries
from augment.errors import NoticeLost
from augment.services.endpoints.notices import NoticeAnswer

URL = "http://127.0.0.1:9/hook"


def hook(admin: User, **given: Any) -> FreshWebhook:
    usual = {"name": "Chat", "url": URL, "events": [event.value for event in EVENTS]}
    return add_webhook(**(usual | given), actor=admin)


class Receiver:
    """Takes messages, and answers as told."""

    def __init__(self, *answers: int | str) -> None:
        self.answers = list(answers)
        self.taken: list[tuple[str, bytes, dict[str, str]]] = []

    def __call__(self, url: str, *, body: bytes, headers: dict[str, str]) -> NoticeAnswer:
        self.taken.append((url, body, headers))
        answer = self.answers.pop(0) if self.answers else 200
        if isinstance(answer, str):
            raise NoticeLost(answer)
        return NoticeAnswer(status=answer, text="ok" if answer == 200 else "no")

    @property
    def told(self) -> list[str]:
        return [json.loads(body)["type"] for _, body, _ in self.taken]


def tell(receiver: Receiver, now: datetime | None = None) -> int:
    now = now or timezone.now() + timedelta(seconds=1)
    plan_deliveries(now)
    return deliver_due(lambda: now, send=receiver)
