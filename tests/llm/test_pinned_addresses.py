"""The address that was checked is the one that is connected to."""

from __future__ import annotations

import socket
import threading
from typing import Any

import pytest

from augment.errors import NotSent
from augment.llm import wire_transport
from augment.llm.openai_wire import OpenAIWire
from tests.llm.hostile import ASKED, BODY
from tests.llm.raw_server import speaking, whole

KEY = "sk-planted-4f7a9c0d1e2b3a"


class Names:
    """A name service whose every look finds the next answer; the last one stays."""

    def __init__(self, *answers: str) -> None:
        self.answers = list(answers)
        self.asked: list[str] = []

    def __call__(self, host: str, port: object, **_: object) -> list[Any]:
        self.asked.append(host)
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        return [(0, 0, 0, "", (address, 0)) for address in answer.split()]


def test_a_name_is_connected_to_where_it_was_looked_up_and_keeps_its_host_header() -> None:
    names = Names("127.0.0.1")
    with (
        speaking(whole(BODY)) as server,
        OpenAIWire(
            base_url=f"http://models.example:{server.port}/v1", api_key=KEY, resolve=names
        ) as client,
    ):
        assert client.complete(ASKED).text == "Hi"
    assert f"host: models.example:{server.port}\r\n".encode() in server.heard[0].lower()
    assert names.asked == ["models.example"] * 2


@pytest.mark.parametrize("later", ["169.254.169.254", "127.0.0.1 fd00:ec2::254", "64:ff9b::1"])
def test_a_name_that_leads_elsewhere_after_the_check_is_not_connected_to(later: str) -> None:
    with (
        speaking(whole(BODY)) as server,
        OpenAIWire(
            base_url=f"http://models.example:{server.port}/v1",
            api_key=KEY,
            resolve=Names("127.0.0.1", later),
        ) as client,
        pytest.raises(NotSent, match=r"models\.example leads to .*metadata") as raised,
    ):
        client.complete(ASKED)
    assert not raised.value.retryable
    assert server.heard == []


def test_the_next_address_is_tried_where_nobody_listens_at_the_first() -> None:
    with (
        speaking(whole(BODY)) as server,
        OpenAIWire(
            base_url=f"http://models.example:{server.port}/v1",
            api_key=None,
            resolve=Names("::1 127.0.0.1"),
        ) as client,
    ):
        assert client.complete(ASKED).text == "Hi"


def test_the_certificate_is_held_against_the_name_and_not_the_address() -> None:
    # The first bytes of a handshake name the server in clear.
    with (
        speaking(lambda connection: None, reads=False) as server,
        OpenAIWire(
            base_url=f"https://models.example:{server.port}/v1",
            api_key=KEY,
            resolve=Names("127.0.0.1"),
        ) as client,
        pytest.raises(NotSent, match="the connection failed"),
    ):
        client.complete(ASKED)
    assert b"models.example" in server.heard[0]


def test_a_name_that_is_never_found_takes_no_longer_than_a_call(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(wire_transport, "CONNECT_TIMEOUT_S", 0.1)
    over = threading.Event()
    is_first = iter([True, False])

    def resolve(*_: object, **__: object) -> list[Any]:
        if not next(is_first):
            over.wait()
        return Names("127.0.0.1")("", None)

    try:
        with (
            OpenAIWire(
                base_url="http://models.example/v1", api_key=None, resolve=resolve
            ) as client,
            pytest.raises(NotSent, match="the connection failed") as raised,
        ):
            client.complete(ASKED)
    finally:
        over.set()
    assert raised.value.retryable


def test_a_name_that_nobody_knows_was_sent_nothing() -> None:
    def nobody(*_: object, **__: object) -> list[Any]:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    with (
        OpenAIWire(base_url="http://models.example/v1", api_key=None, resolve=nobody) as client,
        pytest.raises(NotSent, match="Name or service not known"),
    ):
        client.complete(ASKED)


def test_the_proxy_that_is_named_gets_everything_but_what_stays_here() -> None:
    with speaking(whole(BODY)) as proxy, speaking(whole(BODY)) as server:
        settings: dict[str, Any] = {"api_key": None, "proxy_url": f"http://127.0.0.1:{proxy.port}"}
        with OpenAIWire(base_url="http://models.example/v1", **settings) as client:
            client.complete(ASKED)
        with OpenAIWire(base_url=server.url, **settings) as client:
            client.complete(ASKED)
    assert [heard.split()[1] for heard in proxy.heard] == [
        b"http://models.example/v1/chat/completions"
    ]
    assert len(server.heard) == 1
