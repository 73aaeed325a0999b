"""Addresses that are told what happens: entered, told, tried again, given up.

Rows are the truth: workers look again and again for what happened, and each message is a row that
whichever worker is first tries when it is due. Signed as Standard Webhooks has it: HMAC-SHA256 of
"id.timestamp.body" under a secret that is shown once.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any
from urllib.parse import urlsplit

from django.conf import settings
from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import F
from django.utils import timezone

from arena.models import Webhook, WebhookDelivery, fresh_token
from arena.queries.webhooks import EVENTS, Occurrence, occurrences_for
from augment.errors import Conflict, NoticeLost, UnknownName
from augment.sentences import sentence
from augment.services.endpoints.notices import NoticeAnswer, check_address, send_notice
from augment.services.events import log_event
from augment.services.texts import make_storable, one_line

State = WebhookDelivery.State

WAITS_S = (30, 120, 600, 3_600, 6 * 3_600, 24 * 3_600)
"""How long after each failed try the next one comes; after the last one it is given up."""

HELD_S = 60
"""So long nobody else tries a message that a worker took; it may die over it."""

MOST_AT_ONCE = 50
KEPT_DELIVERIES = 500
"""So many ended messages of an address are kept, the newest."""

LONGEST_ANSWER = 300

Send = Callable[..., NoticeAnswer]
Clock = Callable[[], datetime]


@dataclass(frozen=True, slots=True, kw_only=True)
class FreshWebhook:
    """An address with its secret, which is shown this once."""

    webhook: Webhook
    secret: str


@transaction.atomic
def add_webhook(*, name: str, url: str, events: Sequence[str], actor: User) -> FreshWebhook:
    """Enter an address.

    Raises:
        InvalidDocument: The name or the address can't be used.
        UnknownName: There is no such event.
        Conflict: No event is chosen.
    """
    known = [event.value for event in EVENTS]
    for event in events:
        if event not in known:
            raise UnknownName("event", event, known)
    if not events:
        raise Conflict(sentence("Choose at least one event."))
    webhook = Webhook.objects.create(
        name=one_line("name", name, what="webhook", longest=80),
        url=check_address(url),
        events=[event for event in known if event in events],
        made_by=actor,
    )
    _log(webhook, actor, "add")
    return FreshWebhook(webhook=webhook, secret=_secret(webhook))


@transaction.atomic
def renew_secret(*, webhook: Webhook, actor: User) -> FreshWebhook:
    """Sign with another secret from now on; the old one signs nothing any more."""
    webhook.salt = fresh_token()
    webhook.save(update_fields=["salt"])
    _log(webhook, actor, "renew secret")
    return FreshWebhook(webhook=webhook, secret=_secret(webhook))


@transaction.atomic
def set_webhook_active(*, webhook: Webhook, is_active: bool, actor: User) -> None:
    """Pause an address or let it go on; what happened meanwhile is told then."""
    if webhook.is_active != is_active:
        webhook.is_active = is_active
        webhook.save(update_fields=["is_active"])
        _log(webhook, actor, "resume" if is_active else "pause")


@transaction.atomic
def remove_webhook(*, webhook: Webhook, actor: User) -> None:
    """Forget an address and what it was told."""
    _log(webhook, actor, "remove")
    webhook.delete()


@transaction.atomic
def send_again(*, delivery: WebhookDelivery) -> None:
    """Let a message be tried at once, with all its tries anew."""
    rows = WebhookDelivery.objects.filter(pk=delivery.pk)
    rows.update(state=State.WAITING, attempts=0, due_at=timezone.now(), ended_at=None)


@transaction.atomic
def send_test(*, webhook: Webhook) -> WebhookDelivery:
    """A message that says nothing but that it arrived."""
    now = timezone.now()
    found = Occurrence(name=uuid.uuid4().hex, at=now, about={"name": webhook.name})
    row = _row(webhook, Webhook.What.TEST.value, found, now)
    row.save()
    return row


def plan_deliveries(now: datetime) -> int:
    """Write a row for each thing that happened and was not told yet; twice does no harm.

    Returns:
        How many addresses were looked after.
    """
    webhooks = list(Webhook.objects.filter(is_active=True))
    for webhook in webhooks:
        rows = [_row(webhook, event, found, now) for event, found in occurrences_for(webhook)]
        with transaction.atomic():
            WebhookDelivery.objects.bulk_create(rows, ignore_conflicts=True)
            Webhook.objects.filter(pk=webhook.pk).update(looked_at=now)
            if rows:
                _forget_old(webhook)
    return len(webhooks)


def deliver_due(clock: Clock = timezone.now, *, send: Send = send_notice) -> int:
    """Try every message that is due; of two workers one takes it.

    Args:
        clock: Says the time, anew for each message: those before it may have taken minutes.
        send: Sends one message.

    Returns:
        How many were tried.
    """
    waiting = WebhookDelivery.objects.filter(state=State.WAITING, webhook__is_active=True)
    due = waiting.filter(due_at__lte=clock()).order_by("due_at", "pk")
    tried = 0
    for pk in list(due.values_list("pk", flat=True)[:MOST_AT_ONCE]):
        now = clock()
        mine = waiting.filter(pk=pk, due_at__lte=now)
        if mine.update(due_at=now + timedelta(seconds=HELD_S), attempts=F("attempts") + 1):
            row = WebhookDelivery.objects.select_related("webhook").get(pk=pk)
            _try(row, send)
            tried += 1
    return tried


def signature_of(secret: str, *, message: str, timestamp: int, body: bytes) -> str:
    """What `webhook-signature` says; receivers compute the same."""
    key = base64.b64decode(secret.removeprefix("whsec_"))
    signed = f"{message}.{timestamp}.".encode() + body
    digest = hmac.new(key, signed, hashlib.sha256).digest()
    return "v1," + base64.b64encode(digest).decode()


# --- Private -----------------------------------------------------------------------------------


def _secret(webhook: Webhook) -> str:
    made_of = f"arena.webhook.{webhook.code}.{webhook.salt}".encode()
    key = hmac.new(settings.SECRET_KEY.encode(), made_of, hashlib.sha256).digest()
    return "whsec_" + base64.b64encode(key).decode()


def _row(webhook: Webhook, event: str, found: Occurrence, now: datetime) -> WebhookDelivery:
    told: dict[str, Any] = {"type": event, "timestamp": found.at.isoformat(), "data": found.about}
    return WebhookDelivery(
        webhook=webhook,
        event=event,
        occurrence=found.name,
        body=json.dumps(told, separators=(",", ":")),
        due_at=now,
    )


def _try(row: WebhookDelivery, send: Send) -> None:
    try:
        answer = send(row.webhook.url, body=row.body.encode(), headers=_headers(row))
    except NoticeLost as error:
        _keep(row, status=None, text=str(error), is_taken=False)
    else:
        is_taken = 200 <= answer.status < 300
        _keep(row, status=answer.status, text=answer.text, is_taken=is_taken)


def _headers(row: WebhookDelivery) -> Mapping[str, str]:
    timestamp = int(timezone.now().timestamp())
    message = f"msg_{row.code.hex}"
    signature = signature_of(
        _secret(row.webhook), message=message, timestamp=timestamp, body=row.body.encode()
    )
    return {
        "Content-Type": "application/json",
        "User-Agent": "Scenario-Arena",
        "webhook-id": message,
        "webhook-timestamp": str(timestamp),
        "webhook-signature": signature,
    }


def _keep(row: WebhookDelivery, *, status: int | None, text: str, is_taken: bool) -> None:
    """What came of a try; what was sent again by hand meanwhile waits on."""
    now = timezone.now()
    kept: dict[str, Any] = {
        "last_status": status,
        "last_answer": make_storable(" ".join(text.split()))[:LONGEST_ANSWER],
    }
    if is_taken:
        kept |= {"state": State.DELIVERED, "ended_at": now}
    elif row.attempts > len(WAITS_S):
        kept |= {"state": State.FAILED, "ended_at": now}
    else:
        kept["due_at"] = now + timedelta(seconds=WAITS_S[row.attempts - 1])
    WebhookDelivery.objects.filter(pk=row.pk, attempts=row.attempts).update(**kept)


def _forget_old(webhook: Webhook) -> None:
    """Drop the oldest ended messages, but none that what is looked at anew would make again."""
    ended = webhook.deliveries.exclude(state=State.WAITING).order_by("-pk")
    last = ended.values_list("pk", flat=True)[KEPT_DELIVERIES : KEPT_DELIVERIES + 1].first()
    if last is not None:
        before = timezone.now() - timedelta(days=30)
        old = ended.filter(pk__lte=last, made_at__lt=before)
        old.exclude(event=Webhook.What.SNAPSHOT_FROZEN).delete()


def _log(webhook: Webhook, actor: User, verb: str) -> None:
    log_event(
        actor=actor,
        verb=verb,
        object_kind="webhook",
        object_code=webhook.code,
        # The host alone: what follows it is a key, where chats are told.
        after={
            "name": webhook.name,
            "host": urlsplit(webhook.url).hostname,
            "events": webhook.events,
        },
    )
