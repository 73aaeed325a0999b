"""The client against real HTTP on this computer: one row for each fault of the wire."""

from __future__ import annotations

import socket
import ssl
import time
import traceback
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from augment.errors import ModelFault, NotSent
from augment.fake_llm.server import FakeServer, running
from augment.llm.messages import Message, Reply, Request, Speaker
from augment.llm.openai_wire import OpenAIWire
from tests.llm.recorder import GOOD, recorder

KEY = "sk-planted-4f7a9c0d1e2b3a"

Ask = Callable[..., Reply]


def request(model: str) -> Request:
    return Request(
        model=model,
        messages=(Message(speaker=Speaker.USER, text="Hello"),),
        temperature=0.0,
        seed=7,
    )


@pytest.fixture
def ask(server: FakeServer) -> Iterator[Ask]:
    with OpenAIWire(base_url=server.url, api_key=None, timeout_s=60.0) as client:
        yield lambda model: client.complete(request(model))


def fault(ask: Ask, model: str) -> ModelFault:
    with pytest.raises(ModelFault) as raised:
        ask(model)
    return raised.value


def test_an_answer_comes_with_model_usage_and_latency(ask: Ask) -> None:
    started = time.monotonic()
    reply = ask("fake-good")
    took_s = time.monotonic() - started
    assert reply.text.startswith("I can't find a scene")
    assert (reply.model, reply.finish_reason, reply.refusal) == ("fake-good", "stop", None)
    assert reply.prompt_tokens is not None
    assert reply.completion_tokens is not None
    assert reply.latency_s is not None
    assert 0.0 < reply.latency_s <= took_s


@pytest.mark.parametrize(
    ("model", "status", "retryable", "retry_after_s", "text"),
    [
        ("fake-429", 429, True, 1.0, "rate_limit_exceeded"),
        ("fake-429-long", 429, True, 600.0, "Rate limit reached"),
        ("fake-quota", 429, False, None, "insufficient_quota"),
        ("fake-500", 500, True, None, "The server had an error"),
        ("fake-context", 400, False, None, "context_length_exceeded"),
        ("fake-list-error", 400, False, None, "Invalid value."),
        ("nobody", 404, False, None, "fake-good"),
        ("fake-html", 200, False, None, "instead of JSON"),
        ("fake-no-choices", 200, True, None, "without a choice"),
        ("fake-null-choices", 200, True, None, "without a choice"),
        ("fake-broken-json", None, True, None, "not valid JSON"),
        ("fake-dropped", None, True, None, "the connection failed"),
    ],
)
def test_a_fault_says_whether_it_may_pass(
    ask: Ask,
    model: str,
    status: int | None,
    retryable: bool,
    retry_after_s: float | None,
    text: str,
) -> None:
    broken = fault(ask, model)
    assert text in str(broken)
    assert (broken.status, broken.retryable, broken.retry_after_s) == (
        status,
        retryable,
        retry_after_s,
    )


def test_a_slow_endpoint_is_given_up_after_the_timeout() -> None:
    with (
        running(slow_s=3600.0) as server,
        OpenAIWire(base_url=server.url, api_key=None, timeout_s=0.3) as client,
    ):
        broken = fault(lambda model: client.complete(request(model)), "fake-slow")
    assert (broken.retryable, broken.status) == (True, None)
    assert "took too long" in str(broken)


def test_an_address_where_nobody_listens_was_sent_nothing_and_may_be_asked_again() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with OpenAIWire(base_url=f"http://127.0.0.1:{port}/v1", api_key=None) as client:
        broken = fault(lambda model: client.complete(request(model)), "fake-good")
    assert isinstance(broken, NotSent)
    assert broken.retryable
    assert "refused" in str(broken)


def test_a_refusal_and_a_filtered_answer_are_replies(ask: Ask) -> None:
    assert ask("fake-refuse").refusal == "I can't help with that."
    filtered = ask("fake-filtered")
    assert (filtered.text, filtered.finish_reason) == ("", "content_filter")


@pytest.mark.parametrize("body", [[], "text", 7, None, {"choices": [None]}, {"choices": {}}])
def test_any_other_json_is_a_fault(body: object) -> None:
    with (
        recorder(body=body) as server,
        OpenAIWire(base_url=server.url, api_key=None) as client,
        pytest.raises(ModelFault),
    ):
        client.complete(request("m"))


@pytest.mark.parametrize(
    ("headers", "wait_s"),
    [
        ({"retry-after-ms": "250"}, 0.25),
        ({"Retry-After": "7"}, 7.0),
        ({"Retry-After": "Wed, 21 Oct 2015 07:28:00 GMT"}, 0.0),
        ({"Retry-After": "nan"}, None),
        ({"Retry-After": "soon"}, None),
        ({}, None),
    ],
)
def test_the_wait_that_an_endpoint_asks_for(headers: dict[str, str], wait_s: float | None) -> None:
    with (
        recorder(503, {"error": {"message": "busy"}}, headers) as server,
        OpenAIWire(base_url=server.url, api_key=None) as client,
    ):
        assert fault(lambda model: client.complete(request(model)), "m").retry_after_s == wait_s


def test_a_key_goes_to_its_endpoint_and_nothing_of_the_environment(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("OPENAI_API_KEY", "OPENAI_ORG_ID", "OPENAI_PROJECT_ID", "OPENAI_ADMIN_KEY"):
        monkeypatch.setenv(name, "leak")
    with recorder() as server:
        for key in (KEY, None):
            with OpenAIWire(base_url=server.url, api_key=key) as client:
                client.complete(request("m"))
    with_key, without_key = server.heard
    assert with_key["authorization"] == f"Bearer {KEY}"
    for headers in server.heard:
        assert not {"openai-organization", "openai-project"} & headers.keys()
    assert "leak" not in str(server.heard)
    assert KEY not in str(without_key)


def test_custom_headers_of_the_environment_stop_the_client(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("OPENAI_CUSTOM_HEADERS", f"X-Secret: {KEY}")
    with pytest.raises(ModelFault, match="OPENAI_CUSTOM_HEADERS is set") as raised:
        OpenAIWire(base_url="http://127.0.0.1:1/v1", api_key=None)
    assert KEY not in str(raised.value)


def test_a_proxy_is_not_asked_for_what_listens_here(
    server: FakeServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("HTTP_PROXY", "http_proxy", "ALL_PROXY", "all_proxy"):
        monkeypatch.setenv(name, "http://127.0.0.1:1")
    with OpenAIWire(base_url=server.url, api_key=None) as client:
        assert client.complete(request("fake-good")).model == "fake-good"


@pytest.mark.parametrize("key", [f"{KEY}\nX: y", f"{KEY} b", f"{KEY}\u00e9", f"{KEY}\x00"])
def test_a_key_that_can_not_be_sent_is_refused_unseen(key: str) -> None:
    with pytest.raises(ModelFault, match="the key has characters") as raised:
        OpenAIWire(base_url="http://127.0.0.1:1/v1", api_key=key)
    assert KEY not in str(raised.value)


def test_a_redirect_is_not_followed() -> None:
    with recorder() as other:
        moved = {"Location": f"{other.url}/chat/completions"}
        with (
            recorder(307, {}, moved) as server,
            OpenAIWire(base_url=server.url, api_key=KEY) as client,
        ):
            broken = fault(lambda model: client.complete(request(model)), "m")
    assert (broken.status, broken.retryable) == (307, False)
    assert other.heard == []


@pytest.mark.parametrize("status", [200, 401, 500])
def test_a_key_that_a_server_echoes_is_taken_out(status: int) -> None:
    said = f"Incorrect key {KEY}."
    message = {"role": "assistant", "content": said, "refusal": said}
    choice = {"index": 0, "finish_reason": KEY, "message": message}
    body = GOOD | {"model": KEY, "choices": [choice]}
    body |= {"error": {"message": said, "code": KEY}} if status != 200 else {}
    with recorder(status, body) as server, OpenAIWire(base_url=server.url, api_key=KEY) as client:
        try:
            shown = repr(client.complete(request("m")))
        except ModelFault as broken:
            shown = "".join(traceback.format_exception(broken)) + repr(vars(broken))
        assert KEY not in shown
        assert KEY not in repr(client)
    assert "[key]" in shown


def test_the_certificate_of_an_endpoint_is_checked() -> None:
    with OpenAIWire(base_url="HTTPS://127.0.0.1:1/v1", api_key=None) as client:
        inner: Any = client._client
        checked_by = inner._client._transport._pool._ssl_context
    assert checked_by.verify_mode is ssl.CERT_REQUIRED
    assert checked_by.check_hostname
