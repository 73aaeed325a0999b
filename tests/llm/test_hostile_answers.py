"""The wire to servers that nest, lie and hang up: each ends in a named fault."""

from __future__ import annotations

import json
import socket

import pytest

from augment.errors import NotSent
from augment.llm.openai_wire import LONGEST_ARGUMENTS, LONGEST_EXTRA, MOST_CALLS, MOST_TOKENS
from tests.llm.hostile import BODY, answered, ask, fault, message
from tests.llm.raw_server import head, speaking, whole
from tests.llm.recorder import GOOD


@pytest.mark.parametrize("deep", ["[" * 100_000, '{"a":' * 100_000, "[" * 90_000 + "]" * 90_000])
def test_json_that_nests_without_end_is_a_fault(deep: str) -> None:
    broken = fault(whole(deep.encode()))
    assert broken.retryable
    assert "nested too deeply" in str(broken) or "not valid JSON" in str(broken)


def test_a_call_with_extras_that_nest_as_deep_as_can_be_read_is_an_answer() -> None:
    deep = json.loads("[" * 300 + "]" * 300)
    call = {"id": "1", "function": {"name": "f", "arguments": "{}"}, "x": deep}
    assert [made.name for made in answered(message(tool_calls=[call])).tool_calls] == ["f"]


@pytest.mark.parametrize(
    ("said", "wait_s"),
    [
        ("0", 0.0),
        ("-5", 0.0),
        ("1e3", 1000.0),
        ("99999999999999999999", 1e20),
        ("inf", None),
        ("1e400", None),
        ("-inf", None),
        ("9" * 5000, None),
        ("Wed, 21 Oct 2015 07:28:00 -0000", 0.0),
        ("Wed, 21 Oct 99999 07:28:00 GMT", None),
        ("Wed, 21 Oct 999999999999999999999999 07:28:00 GMT", None),
        ("Mon, 01 Jan 0001 00:00:00 +2359", 0.0),
        ("Wed, 21 Oct 2015 07:28:00 +999999999999999", None),
        (",", None),
    ],
)
def test_a_wait_that_no_clock_knows_is_none(said: str, wait_s: float | None) -> None:
    broken = fault(whole(b"{}", f"Retry-After: {said}", status="429 Too Many"))
    assert (broken.status, broken.retryable) == (429, True)
    assert broken.retry_after_s == wait_s


@pytest.mark.parametrize(
    ("written", "count"),
    [
        ("0", 0),
        ("7", 7),
        ("7.0", 7),
        ("7.5", None),
        ("-1", None),
        ("true", None),
        ('"7"', None),
        ("null", None),
        ("[7]", None),
        (str(MOST_TOKENS), MOST_TOKENS),
        (str(MOST_TOKENS + 1), None),
        ("9" * 400, None),
        ("1e300", None),
        ("1e999", None),
        ("NaN", None),
    ],
)
def test_a_count_of_tokens_that_can_not_be_is_unknown(written: str, count: int | None) -> None:
    body = json.dumps(GOOD | {"usage": {"prompt_tokens": "HERE", "completion_tokens": "HERE"}})
    reply = ask(whole(body.replace('"HERE"', written).encode()))
    assert (reply.text, reply.prompt_tokens, reply.completion_tokens) == ("Hi", count, count)


def test_a_number_of_five_thousand_digits_is_no_json() -> None:
    body = json.dumps(GOOD | {"usage": {"prompt_tokens": "HERE"}}).replace('"HERE"', "9" * 5000)
    assert "not valid JSON" in str(fault(whole(body.encode())))


@pytest.mark.parametrize("code", ["c" * 80, "c" * 81, "c" * 1_000_000])
def test_what_an_error_says_is_cut_with_a_mark(code: str) -> None:
    body = json.dumps({"error": {"message": "m" * 1_000_000, "code": code}}).encode()
    said = str(fault(whole(body, status="400 Bad")))
    assert len(said) < 500
    assert "m… [cut: 1000000 characters]" in said
    assert (f"c… [cut: {len(code)} characters]" in said) == (len(code) > 80)


def test_calls_of_tools_are_bounded_in_number_and_length() -> None:
    call = {"id": "i" * 9000, "function": {"name": "n" * 9000, "arguments": "a" * 90_000}}
    kept = {"x": "y" * (LONGEST_EXTRA - 9)}
    assert len(json.dumps(kept)) == LONGEST_EXTRA
    calls = [call | {"x": "y" * LONGEST_EXTRA}, call | kept] + [call] * MOST_CALLS
    reply = answered(message(tool_calls=calls))
    assert (len(reply.tool_calls), reply.calls_left_out) == (MOST_CALLS, 2)
    first, second, *_ = reply.tool_calls
    assert len(first.arguments) == LONGEST_ARGUMENTS
    assert first.arguments.endswith("… [cut: 90000 characters]")
    assert (len(first.name), len(first.id)) == (200, 200)
    assert (first.extra, len(second.extra)) == ("", LONGEST_EXTRA)


@pytest.mark.parametrize(
    "said",
    [
        b"",
        b"HTTP/1.1 20",
        head("Content-Length: 500") + BODY[:40],
        b"\x00\x01\x02 nonsense\r\n\r\n",
    ],
)
def test_a_connection_that_is_closed_midway_may_be_billed_and_may_pass(said: bytes) -> None:
    broken = fault(lambda connection: connection.sendall(said))
    assert broken.retryable
    assert "the connection failed" in str(broken)
    assert not isinstance(broken, NotSent)


def test_a_connection_that_is_reset_midway_is_named() -> None:
    def reset(connection: socket.socket) -> None:
        connection.sendall(head("Content-Length: 500"))
        linger = b"\x01\x00\x00\x00\x00\x00\x00\x00"
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)

    assert "the connection failed" in str(fault(reset))


@pytest.mark.parametrize("status", ["301 Moved", "302 Found", "303 See", "307 Moved", "308 Moved"])
def test_no_redirect_is_followed_not_even_to_this_computer(status: str) -> None:
    with speaking(whole(BODY)) as other:
        say = whole(b"", f"Location: {other.url}/chat/completions", status=status)
        broken = fault(say, api_key="sk-planted-4f7a9c0d1e2b3a")
    assert broken.status == int(status[:3])
    assert other.heard == []
