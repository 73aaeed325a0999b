"""The client against real HTTP on this computer: one row for each fault of the wire."""

import socket
import ssl
import threading
import traceback
from dataclasses import replace
from typing import Any
from unittest.mock import Mock

import pytest

from augment.errors import ModelFault, NotSent
from augment.fake_llm.server import FakeServer
from augment.llm import wire_transport
from augment.llm.addresses import Resolve
from augment.llm.messages import Request
from augment.llm.openai_wire import OpenAIWire
from tests.llm.json_server import GOOD, recorder
from tests.llm.raw_server import speaking, whole
from tests.llm.test_addresses import leading_to
from tests.llm.test_hostile_servers import ASKED, BODY

KEY = "sk-planted-4f7a9c0d1e2b3a"


def request(model: str) -> Request:
    return replace(ASKED, model=model, temperature=0.0, seed=7)


def fault_of(url: str, model: str) -> ModelFault:
    with OpenAIWire(base_url=url, api_key=None) as client, pytest.raises(ModelFault) as raised:
        client.complete(request(model))
    return raised.value


@pytest.mark.parametrize(
    ("model", "expected", "text"),
    [
        ("fake-429", (429, True, 1.0), "rate_limit_exceeded"),
        ("fake-quota", (429, False, None), "insufficient_quota"),
        ("fake-500", (500, True, None), "The server had an error"),
        ("nobody", (404, False, None), "fake-good"),
    ],
)
def test_a_fault_says_whether_it_may_pass(
    server: FakeServer, model: str, expected: tuple[object, ...], text: str
) -> None:
    broken = fault_of(server.url, model)
    assert text in str(broken)
    assert (broken.status, broken.retryable, broken.retry_after_s) == expected


def test_an_address_where_nobody_listens_was_sent_nothing_and_may_be_asked_again() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    broken = fault_of(f"http://127.0.0.1:{port}/v1", "fake-good")
    assert isinstance(broken, NotSent)
    assert broken.retryable
    assert "refused" in str(broken)


@pytest.mark.parametrize(
    "listed",
    [
        {"object": "list", "data": [{"id": "b"}, {"id": None}, None, 7, {"id": "a"}]},
        [{"id": "a"}, {"id": "b"}],
        ["a", "b"],
        {"data": ["b", "a"]},
        {"models": [{"name": "a", "model": "a"}, {"name": "b"}]},
        {"data": {"x": {"id": "a"}, "y": {"id": "b"}}},
    ],
    ids=str,
)
def test_models_are_listed_in_many_shapes(listed: object, monkeypatch: pytest.MonkeyPatch) -> None:
    with OpenAIWire(base_url="http://127.0.0.1:1/v1", api_key=None) as client:
        monkeypatch.setattr(client, "_exchange", lambda path: listed)
        assert client.list_models() == ["a", "b"]
        monkeypatch.setattr(client, "_exchange", lambda path: {"error": {"message": "No key."}})
        with pytest.raises(ModelFault, match=r"lists no models: No key\."):
            client.list_models()


def test_a_key_goes_to_its_endpoint_and_no_variable_does(monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_headers_of_the_environment_stop_the_client(monkeypatch: pytest.MonkeyPatch) -> None:
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


def named(port: int, names: Resolve, scheme: str = "http") -> OpenAIWire:
    """A client of a server by its name."""
    base_url = f"{scheme}://models.example:{port}/v1"
    return OpenAIWire(base_url=base_url, api_key=KEY, resolve=names)


@pytest.mark.parametrize("addresses", [["127.0.0.1"], ["::1", "127.0.0.1"]])
def test_a_name_leads_to_who_listens_and_keeps_its_host_header(addresses: list[str]) -> None:
    names = Mock(side_effect=leading_to(*addresses))
    with speaking(whole(BODY)) as server, named(server.port, names) as client:
        assert client.complete(ASKED).text == "Hi"
    assert names.call_count == 1, "what was checked is what is connected to"
    assert f"host: models.example:{server.port}\r\n".encode() in server.heard[0].lower()


@pytest.mark.parametrize("later", ["169.254.169.254", "127.0.0.1 fd00:ec2::254", "64:ff9b::1"])
def test_a_name_that_leads_to_a_forbidden_address_is_not_connected_to(later: str) -> None:
    with (
        speaking(whole(BODY)) as server,
        named(server.port, leading_to(*later.split())) as client,
        pytest.raises(NotSent, match=r"models\.example leads to .*metadata") as raised,
    ):
        client.complete(ASKED)
    assert not raised.value.retryable
    assert server.heard == []


def test_the_certificate_is_held_against_the_name_and_not_the_address() -> None:
    # The first bytes of a handshake name the server in clear.
    with (
        speaking(lambda connection: None, reads=False) as server,
        named(server.port, leading_to("127.0.0.1"), "https") as client,
        pytest.raises(NotSent, match="the connection failed"),
    ):
        client.complete(ASKED)
    assert b"models.example" in server.heard[0]


def test_a_name_never_found_takes_no_longer_than_a_call(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wire_transport, "CONNECT_TIMEOUT_S", 0.1)
    over = threading.Event()

    def resolve(*_: object, **__: object) -> list[Any]:
        over.wait()
        return []

    try:
        with (
            named(80, resolve) as client,
            pytest.raises(NotSent, match="the connection failed") as raised,
        ):
            client.complete(ASKED)
    finally:
        over.set()
    assert raised.value.retryable


def test_the_proxy_that_is_named_gets_everything_but_what_stays_here() -> None:
    with speaking(whole(BODY)) as proxy, speaking(whole(BODY)) as server:
        settings: dict[str, Any] = {"api_key": None, "proxy_url": f"http://127.0.0.1:{proxy.port}"}
        with OpenAIWire(base_url="http://models.example/v1", **settings) as client:
            client.complete(ASKED)
        with OpenAIWire(base_url=server.url, **settings) as client:
            client.complete(ASKED)
    (heard,) = proxy.heard
    assert heard.split()[1] == b"http://models.example/v1/chat/completions"
    assert len(server.heard) == 1
