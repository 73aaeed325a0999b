"""Webhooks: told once, signed, tried again, given up; no secret twice; no result in them."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
from datetime import timedelta
from typing import Any

import pytest
from django.contrib.auth.models import User
from django.urls import reverse
from django.utils import timezone

from arena.models import Webhook, WebhookDelivery
from arena.queries.webhooks import EVENTS
from arena.services.ratings import rate
from arena.services.studies import close_study
from arena.services.webhooks import (
    HELD_S,
    WAITS_S,
    deliver_due,
    renew_secret,
    send_again,
    send_test,
    set_webhook_active,
)
from augment.models import Event, GenerationJob
from augment.services.endpoints.notices import NoticeAnswer
from tests.jobs import rows
from tests.study_rows import a_study, matchups_of, vote
from tests.web.cast import people, signed_in
from tests.webhooks import URL, Receiver, hook, tell

pytestmark = pytest.mark.django_db

State = WebhookDelivery.State


@pytest.fixture
def admin() -> User:
    return people()["admin"]


# --- What is told ------------------------------------------------------------------------------


def test_each_of_the_four_events_is_told_once(admin: User) -> None:
    hook(admin)
    receiver = Receiver()
    assert tell(receiver) == 0
    finished = rows.launch(scenarios=1)
    GenerationJob.objects.filter(pk=finished.pk).update(
        state=GenerationJob.State.FINISHED, finished_at=timezone.now()
    )
    Event.objects.create(
        verb="stop",
        object_kind="job",
        object_code=str(finished.code),
        after={"state": "stopped_at_cap", "cap": "5 calls"},
    )
    study = a_study()
    for matchup in matchups_of(study, "eva"):
        vote(matchup, "left")
    snapshot = rate(study=close_study(study=study), rounds=20)
    for _ in range(3):
        tell(receiver, timezone.now() + timedelta(seconds=5))
    assert sorted(receiver.told) == sorted(event.value for event in EVENTS)
    said = {json.loads(body)["type"]: json.loads(body)["data"] for _, body, _ in receiver.taken}
    assert said["job.finished"]["job"] == str(finished.code)
    assert said["job.budget_hit"]["cap"] == "5 calls"
    assert said["study.closed"] == {"study": str(study.code), "name": study.name}
    assert said["snapshot.frozen"]["snapshot"] == str(snapshot.code)


def test_no_message_tells_who_leads_or_takes_part(admin: User) -> None:
    hook(admin)
    study = a_study(contestants=("zanzibar", "quixotic", "xylophone"))
    rate(study=close_study(study=study), rounds=20)
    receiver = Receiver()
    tell(receiver, timezone.now() + timedelta(seconds=5))
    assert receiver.told == ["study.closed", "snapshot.frozen"]
    everything = b"".join(body for _, body, _ in receiver.taken).decode().lower()
    assert not any(name in everything for name in ("zanzibar", "quixotic", "xylophone"))


def test_a_job_that_finishes_again_after_a_retry_is_told_again(admin: User) -> None:
    hook(admin)
    job, receiver = rows.launch(scenarios=1), Receiver()
    for _ in range(2):
        GenerationJob.objects.filter(pk=job.pk).update(
            state=GenerationJob.State.FINISHED, finished_at=timezone.now()
        )
        tell(receiver, timezone.now() + timedelta(seconds=1))
    assert receiver.told == ["job.finished"] * 2


def test_what_was_before_and_what_nobody_asked_for_is_not_told(admin: User) -> None:
    study = close_study(study=a_study())
    hook(admin)
    hook(admin, name="jobs alone", events=["job.finished"])
    rate(study=study, rounds=20)
    receiver = Receiver()
    tell(receiver, timezone.now() + timedelta(seconds=5))
    assert receiver.told == ["snapshot.frozen"]


def test_what_happens_during_a_pause_is_told_after_it(admin: User) -> None:
    made = hook(admin).webhook
    set_webhook_active(webhook=made, is_active=False, actor=admin)
    close_study(study=a_study())
    receiver = Receiver()
    assert tell(receiver) == 0
    set_webhook_active(webhook=made, is_active=True, actor=admin)
    assert tell(receiver, timezone.now() + timedelta(seconds=5)) == 1


# --- Signed ------------------------------------------------------------------------------------


def signed_with(secret: str, headers: dict[str, str], body: bytes) -> str:
    """As a receiver computes it, written anew from Standard Webhooks."""
    key = base64.b64decode(secret.partition("_")[2])
    text = headers["webhook-id"].encode() + b"." + headers["webhook-timestamp"].encode()
    return "v1," + base64.b64encode(hmac.digest(key, text + b"." + body, "sha256")).decode()


def test_a_receiver_can_check_that_a_message_is_ours_and_new(admin: User) -> None:
    fresh, receiver = hook(admin), Receiver(500, 200)
    send_test(webhook=fresh.webhook)
    now = timezone.now() + timedelta(seconds=1)
    tell(receiver, now)
    tell(receiver, now + timedelta(hours=1))
    (_, first, one), (_, second, two) = receiver.taken
    for body, headers in ((first, one), (second, two)):
        assert headers["webhook-signature"] == signed_with(fresh.secret, headers, body)
        age_s = timezone.now().timestamp() - int(headers["webhook-timestamp"])
        assert abs(age_s) < 60
    assert (first, one["webhook-id"]) == (second, two["webhook-id"])
    forged = signed_with(fresh.secret, one, first.replace(b"Chat", b"Cha7"))
    assert forged != one["webhook-signature"]


def test_a_new_secret_ends_the_old_one(admin: User) -> None:
    old, receiver = hook(admin), Receiver()
    new = renew_secret(webhook=old.webhook, actor=admin)
    send_test(webhook=old.webhook)
    tell(receiver)
    ((_, body, headers),) = receiver.taken
    assert new.secret != old.secret
    assert headers["webhook-signature"] == signed_with(new.secret, headers, body)


def test_a_secret_is_shown_once_and_stored_nowhere(admin: User) -> None:
    page = signed_in(admin)
    given = {"name": "Chat", "url": URL, "events": ["job.finished"]}
    shown = page.post(reverse("webhooks"), given).content.decode()
    secret = shown.partition('id="secret" value="')[2].partition('"')[0]
    assert secret.startswith("whsec_")
    key = base64.b64decode(secret.removeprefix("whsec_"))
    webhook = Webhook.objects.get()
    stored = str(list(Webhook.objects.values())) + str(list(Event.objects.values()))
    for hidden in (secret, secret[6:], key.hex()):
        assert hidden not in stored
    assert len(key) == hashlib.sha256().digest_size
    for address in (reverse("webhooks"), reverse("webhook", args=[webhook.code])):
        assert secret not in page.get(address).content.decode()


# --- Tried again -------------------------------------------------------------------------------


@pytest.mark.parametrize("answer", [500, 404, 302, "no route"])
def test_a_message_is_tried_again_later_and_later_and_then_given_up(
    admin: User, answer: int | str
) -> None:
    send_test(webhook=hook(admin).webhook)
    receiver = Receiver(*[answer] * 20)
    now = timezone.now() + timedelta(seconds=1)
    waits = []
    for number in range(1, len(WAITS_S) + 2):
        assert tell(receiver, now) == 1
        row = WebhookDelivery.objects.get()
        assert row.attempts == len(receiver.taken) == number
        if row.state == State.WAITING:
            waits.append(round((row.due_at - timezone.now()).total_seconds()))
            assert tell(receiver, timezone.now()) == 0, "not before it is due"
            now = row.due_at
    assert waits == pytest.approx(WAITS_S, abs=5)
    assert (row.state, row.ended_at is not None) == (State.FAILED, True)
    assert tell(receiver, now + timedelta(days=9)) == 0
    send_again(delivery=row)
    receiver.answers = [204]
    assert tell(receiver) == 1
    row.refresh_from_db()
    assert (row.state, row.last_status, row.attempts) == (State.DELIVERED, 204, 1)


def test_of_two_workers_one_sends_and_a_dead_ones_message_is_taken_over(admin: User) -> None:
    send_test(webhook=hook(admin).webhook)
    now = timezone.now() + timedelta(seconds=1)

    def meanwhile(url: str, *, body: bytes, headers: Any) -> NoticeAnswer:
        assert deliver_due(lambda: now, send=receiver) == 0, "the other one finds nothing"
        raise SystemExit

    receiver = Receiver()
    with pytest.raises(SystemExit):
        deliver_due(lambda: now, send=meanwhile)
    assert tell(receiver, now + timedelta(seconds=HELD_S - 1)) == 0
    assert tell(receiver, now + timedelta(seconds=HELD_S)) == 1
    assert WebhookDelivery.objects.get().state == State.DELIVERED


def test_a_message_is_held_from_when_it_is_taken_however_slow_those_before_were(
    admin: User,
) -> None:
    webhook = hook(admin).webhook
    for _ in range(3):
        send_test(webhook=webhook)
    now = timezone.now() + timedelta(seconds=1)

    def slowly(url: str, *, body: bytes, headers: Any) -> NoticeAnswer:
        nonlocal now
        now += timedelta(seconds=HELD_S - 1)
        sent.append(body)
        if len(sent) == 3:
            assert deliver_due(lambda: now, send=Receiver()) == 0, "another worker finds nothing"
        return NoticeAnswer(status=200, text="ok")

    sent: list[bytes] = []
    assert deliver_due(lambda: now, send=slowly) == 3
    assert set(WebhookDelivery.objects.values_list("state", "attempts")) == {("delivered", 1)}
