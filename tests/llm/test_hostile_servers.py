"""The wire to servers that drip and swell: each ends in a named fault, and in time."""

import json
import time
from typing import Any

import pytest

from augment.errors import CallDropped, JobCancelled, ModelFault, NotNeeded, NotSent
from augment.llm.answers import LONGEST_ARGUMENTS, LONGEST_EXTRA, MOST_CALLS
from augment.llm.messages import Message, Reply, Request, Speaker
from augment.llm.openai_wire import OpenAIWire
from augment.llm.wire_transport import OutOfTime, Watch
from tests.llm.json_server import GOOD
from tests.llm.raw_server import Say, drip, head, speaking, whole

ASKED = Request(model="m", messages=(Message(speaker=Speaker.USER, text="Hello"),))
BODY = json.dumps(GOOD).encode()
LIMIT_S = 0.25


def ask(say: Say, *, reads: bool = True, asked: Request = ASKED, **settings: Any) -> Reply:
    settings = {"timeout_s": 20.0, "api_key": None} | settings
    with (
        speaking(say, reads=reads) as server,
        OpenAIWire(base_url=server.url, **settings) as client,
    ):
        return client.complete(asked)


def fault(say: Say, **settings: Any) -> ModelFault:
    with pytest.raises(ModelFault) as raised:
        ask(say, **settings)
    return raised.value


def answered(body: object) -> Reply:
    return ask(whole(json.dumps(body).encode()))


def message(**parts: object) -> dict[str, object]:
    said = {"role": "assistant", "content": "Hi"} | parts
    return GOOD | {"choices": [{"index": 0, "finish_reason": "stop", "message": said}]}


# --- Time --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "say",
    [
        drip(b"", b"H"),
        drip(b"HTTP/1.1 200 OK\r\n", b"X: y\r\n"),
        drip(b"", b"HTTP/1.1 100 Continue\r\n\r\n"),
        drip(head("Content-Length: 100000"), b" "),
        drip(head("Transfer-Encoding: chunked"), b"1\r\n \r\n"),
        drip(head("Connection: close"), b"\n"),
    ],
    ids=["status", "headers", "continue", "body", "chunks", "until closed"],
)
def test_a_call_has_a_total_time_however_the_answer_drips(say: Say) -> None:
    started = time.monotonic()
    broken = fault(say, timeout_s=LIMIT_S)
    assert time.monotonic() - started < 20 * LIMIT_S
    assert broken.retryable
    assert "HTTP" not in str(broken)
    assert "took too long" in str(broken) or "connection failed" in str(broken)


def test_an_error_that_drips_is_still_that_error() -> None:
    say = drip(head("Content-Length: 100000", status="503 Busy"), b" ")
    broken = fault(say, timeout_s=LIMIT_S)
    assert (broken.status, broken.retryable) == (503, True)


@pytest.mark.parametrize(("now_s", "is_over"), [(9.99, False), (10.0, True), (10.01, True)])
def test_the_last_moment_of_a_call(now_s: float, is_over: bool) -> None:
    clock = [0.0]
    rest: dict[str, Any] = {"most_bytes": 1, "still_wanted": lambda: None, "look_every_s": 99.0}
    watch = Watch(longest_s=10.0, clock=lambda: clock[0], **rest)
    clock[0] = now_s
    if is_over:
        with pytest.raises(OutOfTime):
            watch.wait_s()
    else:
        assert watch.wait_s() == pytest.approx(10.0 - now_s)


# --- Whether anybody wants it ------------------------------------------------------------------


def test_a_call_in_flight_that_nobody_wants_any_more_is_given_up_at_the_next_look() -> None:
    looks = iter([True, True, False])

    def still_wanted() -> None:
        if not next(looks):
            raise JobCancelled

    looking: dict[str, Any] = {"still_wanted": still_wanted, "look_every_s": 0.03}
    broken = fault(drip(head("Content-Length: 100000"), b" "), timeout_s=60.0, **looking)
    assert isinstance(broken, CallDropped)
    assert isinstance(broken.why, JobCancelled)
    assert not broken.retryable


def test_a_call_that_nobody_wants_before_it_is_sent_is_not_sent() -> None:
    def unwanted() -> None:
        raise JobCancelled

    with pytest.raises(NotNeeded) as raised:
        ask(whole(BODY), still_wanted=unwanted, look_every_s=0.0)
    assert isinstance(raised.value, JobCancelled)


# --- Size --------------------------------------------------------------------------------------

MOST = 20_000


@pytest.mark.parametrize(("beyond", "fits"), [(0, True), (1, False)])
def test_an_answer_may_be_as_long_as_the_limit_and_no_longer(beyond: int, fits: bool) -> None:
    say = whole(BODY + b" " * (MOST - len(BODY) + beyond), "Content-Encoding: identity")
    if fits:
        assert ask(say, most_bytes=MOST).text == "Hi"
    else:
        broken = fault(say, most_bytes=MOST)
        assert (broken.status, broken.retryable) == (200, False)
        assert "longer than 0.02 MB" in str(broken)


@pytest.mark.parametrize(
    "say",
    [
        drip(head("Transfer-Encoding: chunked"), b"8000\r\n" + b"x" * 0x8000 + b"\r\n", every_s=0),
        drip(head("Connection: close"), b"x" * 0x8000, every_s=0),
        drip(b"", b"HTTP/1.1 100 Continue\r\n\r\n" * 1000, every_s=0),
    ],
    ids=["chunks", "until closed", "continue"],
)
def test_an_answer_without_end_stops_at_the_limit(say: Say) -> None:
    broken = fault(say, most_bytes=200_000)
    assert "longer than 0.2 MB" in str(broken)


@pytest.mark.parametrize("packing", ["br", "gzip", "gzip, gzip"])
def test_a_packing_that_nobody_asked_for_is_named(packing: str) -> None:
    broken = fault(whole(BODY, f"Content-Encoding: {packing}"))
    assert f"can't be unpacked: {packing}" in str(broken)


@pytest.mark.parametrize(
    ("body", "status", "kind", "retryable", "text"),
    [
        (b'[{"error": {"message": "Bad value."}}]', "400 Bad", "json", False, "Bad value."),
        (b'{"choices": []}', "200 OK", "json", True, "without a choice"),
        (b'{"choices"', "200 OK", "json", True, "not valid JSON"),
        (b"", "200 OK", "json", True, "an empty body"),
        (b" \n", "200 OK", "json", True, "an empty body"),
        (b"<p>Sign in</p>", "200 OK", "html", False, "instead of JSON"),
        (b'data: {"id":"x"}\n\n', "200 OK", "event-stream", False, "a stream of events"),
        (b': hi\ndata: {"error":{"code":502,"message":"Up."}}', "200 OK", "x", True, "Up."),
    ],
)
def test_what_is_no_answer_says_why(
    body: bytes, status: str, kind: str, retryable: bool, text: str
) -> None:
    said = f"HTTP/1.1 {status}\r\nContent-Type: text/{kind}\r\nContent-Length: {len(body)}"
    said = said.replace("text/json", "application/json")
    broken = fault(lambda connection: connection.sendall(f"{said}\r\n\r\n".encode() + body))
    assert (broken.retryable, text in str(broken)) == (retryable, True), broken


def test_an_answer_may_begin_with_a_byte_order_mark() -> None:
    assert ask(whole(b"\xef\xbb\xbf" + BODY)).text == "Hi"


@pytest.mark.parametrize("deep", ["[" * 100_000, '{"a":' * 100_000, "[" * 90_000 + "]" * 90_000])
def test_json_that_nests_without_end_is_a_fault(deep: str) -> None:
    broken = fault(whole(deep.encode()))
    assert broken.retryable
    assert "nested too deeply" in str(broken) or "not valid JSON" in str(broken)


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
    assert (len(reply.tool_calls), reply.remarks[-1]) == (MOST_CALLS, "left out: 2 more calls")
    first, second, *_ = reply.tool_calls
    assert len(first.arguments) == LONGEST_ARGUMENTS
    assert first.arguments.endswith("… [cut: 90000 characters]")
    assert (len(first.name), len(first.id)) == (200, 200)
    assert (first.extra, len(second.extra)) == ("", LONGEST_EXTRA)


@pytest.mark.parametrize(
    "said",
    [
        *(b"", b"HTTP/1.1 20", head("Content-Length: 500") + BODY[:40]),
        b"\x00\x01\x02 nonsense\r\n\r\n",
    ],
)
def test_a_connection_that_is_closed_midway_may_be_billed_and_may_pass(said: bytes) -> None:
    broken = fault(lambda connection: connection.sendall(said))
    assert broken.retryable
    assert "the connection failed" in str(broken)
    assert not isinstance(broken, NotSent)


@pytest.mark.parametrize("status", ["301 Moved", "302 Found", "303 See", "307 Moved", "308 Moved"])
def test_no_redirect_is_followed_not_even_to_this_computer(status: str) -> None:
    with speaking(whole(BODY)) as other:
        say = whole(b"", f"Location: {other.url}/chat/completions", status=status)
        broken = fault(say, api_key="sk-planted-4f7a9c0d1e2b3a")
    assert f"{status[:3]}: it leads to {other.url}" in str(broken)
    assert broken.status == int(status[:3])
    assert other.heard == []
