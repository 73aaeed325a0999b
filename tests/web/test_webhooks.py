"""Webhooks over the network and on their pages: where they may lead, and what is logged."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from threading import enumerate as enumerate_threads
from typing import Any

import pytest
from django.contrib.auth.models import User
from django.urls import reverse

from arena import tasks
from arena.models import Webhook, WebhookDelivery
from arena.services.webhooks import (
    deliver_due,
    remove_webhook,
    send_test,
)
from augment.errors import AugmentError, InvalidDocument
from augment.models import Event
from augment.services.running import stopping
from tests.processes import wait_until
from tests.web.cast import people, signed_in
from tests.webhooks import Receiver, hook, tell

pytestmark = pytest.mark.django_db

State = WebhookDelivery.State


@pytest.fixture
def admin() -> User:
    return people()["admin"]


# --- Over the network --------------------------------------------------------------------------


@contextmanager
def listening(status: int, **headers: str) -> Iterator[tuple[str, list[bytes]]]:
    bodies: list[bytes] = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            bodies.append(self.rfile.read(int(self.headers["Content-Length"])))
            self.send_response(status)
            for name, value in {"Content-Length": "5", **headers}.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(b"hello")

        def log_message(self, format: str, *args: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = Thread(target=server.serve_forever, args=(0.01,), daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/hook?room=7", bodies
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def test_a_message_arrives_by_the_network_and_its_answer_is_kept(admin: User) -> None:
    with listening(200) as (url, bodies):
        send_test(webhook=hook(admin, url=url).webhook)
        assert deliver_due() == 1
    row = WebhookDelivery.objects.get()
    assert (row.state, row.last_status, row.last_answer) == (State.DELIVERED, 200, "hello")
    assert bodies == [row.body.encode()]


@pytest.mark.django_db(transaction=True)
def test_a_worker_that_is_ready_tells_without_being_asked(admin: User) -> None:
    with listening(200) as (url, bodies):
        send_test(webhook=hook(admin, url=url).webhook)
        stopping.withdraw_stop()
        try:
            tasks.start_telling()
            wait_until(lambda: bool(bodies), what="the message arrives")
            delivered = WebhookDelivery.objects.filter(state=State.DELIVERED)
            wait_until(delivered.exists, what="its answer is kept")
        finally:
            stopping.request_stop()
            for thread in enumerate_threads():
                if thread.name == "webhooks":
                    thread.join()
            stopping.withdraw_stop()


def test_a_redirect_is_not_followed(admin: User) -> None:
    with listening(200) as (target, taken), listening(302, Location=target) as (url, _):
        send_test(webhook=hook(admin, url=url).webhook)
        deliver_due()
    assert taken == []
    assert WebhookDelivery.objects.get().last_status == 302


def test_nobody_listening_is_said_in_words(admin: User) -> None:
    with listening(200) as (url, _):
        pass
    send_test(webhook=hook(admin, url=url).webhook)
    deliver_due()
    row = WebhookDelivery.objects.get()
    assert (row.state, row.last_status, row.last_answer) == (
        State.WAITING,
        None,
        "Connection refused",
    )


@pytest.mark.parametrize(
    "url",
    [
        "",
        "ftp://example.org/x",
        "example.org",
        "http://169.254.169.254/latest/meta-data",
        "http://metadata.google.internal/",
        "http://[::ffff:169.254.169.254]/",
        "http://me:secret@example.org/",
        "http://example.org/" + "x" * 500,
    ],
)
def test_an_address_that_no_message_may_go_to_is_refused(admin: User, url: str) -> None:
    with pytest.raises(InvalidDocument):
        hook(admin, url=url)
    assert not Webhook.objects.exists()


def test_a_name_that_leads_elsewhere_later_is_refused_when_it_is_called(
    admin: User, monkeypatch: pytest.MonkeyPatch
) -> None:
    leads_to = ["127.0.0.1"]

    def resolve(host: str, port: object, **_: object) -> list[Any]:
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (leads_to[0], 0))]

    monkeypatch.setattr("augment.services.endpoints.notices.RESOLVE", resolve)
    send_test(webhook=hook(admin, url="http://hooks.example.org/x").webhook)
    leads_to[0] = "169.254.169.254"
    deliver_due()
    assert "link-local" in WebhookDelivery.objects.get().last_answer


# --- Pages -------------------------------------------------------------------------------------


def test_the_page_lists_what_was_told_and_what_was_answered(admin: User) -> None:
    made = hook(admin).webhook
    send_test(webhook=made)
    tell(Receiver(503))
    page = signed_in(admin)
    shown = page.get(reverse("webhook", args=[made.code])).content.decode()
    assert "503 no" in " ".join(shown.split())
    row = WebhookDelivery.objects.get()
    page.post(reverse("webhook-repeat", args=[row.code]))
    assert WebhookDelivery.objects.get().attempts == 0


@pytest.mark.parametrize(
    ("act", "verb"), [("pause", "pause"), ("secret", "renew secret"), ("test", None)]
)
def test_every_change_is_logged(admin: User, act: str, verb: str | None) -> None:
    made = hook(admin, url="http://127.0.0.1:9/hook?token=of-the-chat").webhook
    signed_in(admin).post(reverse("webhook-change", args=[made.code]), {"act": act})
    events = Event.objects.filter(object_kind="webhook").order_by("pk")
    verbs = list(events.values_list("verb", flat=True))
    assert verbs == ["add", *([verb] if verb else [])]
    assert "of-the-chat" not in str(list(events.values()))


def test_removing_asks_first(admin: User) -> None:
    made, page = hook(admin).webhook, signed_in(admin)
    address = reverse("webhook-forget", args=[made.code])
    assert page.post(address).status_code == 200
    assert Webhook.objects.exists()
    page.post(address, {"sure": "1"})
    assert not Webhook.objects.exists()
    assert Event.objects.filter(verb="remove", object_kind="webhook").exists()


@pytest.mark.parametrize(
    "given", [{"events": []}, {"events": ["vote"]}, {"name": ""}, {"name": "a\nb"}]
)
def test_what_a_webhook_can_not_be_says_why(admin: User, given: dict[str, object]) -> None:
    with pytest.raises(AugmentError):
        hook(admin, **given)


def test_a_removed_webhook_takes_its_deliveries_along(admin: User) -> None:
    made = hook(admin).webhook
    send_test(webhook=made)
    remove_webhook(webhook=made, actor=admin)
    assert not WebhookDelivery.objects.exists()
