"""The wire to servers that drip and swell: each ends in a named fault, and in time."""

from __future__ import annotations

import gzip
import time
import tracemalloc
import zlib

import pytest

from augment.errors import Abandoned, JobCancelled, Unwanted
from augment.llm.wire_transport import OutOfTime, Watch
from tests.llm.hostile import BODY, EMPTY_BLOCK, LIMIT_S, PACKED, ask, fault
from tests.llm.raw_server import Say, drip, head, whole

# --- Time --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "say",
    [
        drip(b"", b"H"),
        drip(b"HTTP/1.1 200 OK\r\n", b"X: y\r\n"),
        drip(b"", b"HTTP/1.1 100 Continue\r\n\r\n"),
        drip(head("Content-Length: 100000"), b" "),
        drip(head("Transfer-Encoding: chunked"), b"1\r\n \r\n"),
        drip(PACKED, EMPTY_BLOCK),
        drip(head("Connection: close"), b"\n"),
    ],
    ids=["status", "headers", "continue", "body", "chunks", "packed", "until closed"],
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
    watch = Watch(
        longest_s=10.0,
        most_bytes=1,
        still_wanted=lambda: None,
        look_every_s=99.0,
        clock=lambda: clock[0],
    )
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

    broken = fault(
        drip(head("Content-Length: 100000"), b" "),
        still_wanted=still_wanted,
        look_every_s=0.03,
        timeout_s=60.0,
    )
    assert isinstance(broken, Abandoned)
    assert isinstance(broken.why, JobCancelled)
    assert not broken.retryable


def test_a_call_that_nobody_wants_before_it_is_sent_is_not_sent() -> None:
    def unwanted() -> None:
        raise JobCancelled

    with pytest.raises(Unwanted) as raised:
        ask(whole(BODY), still_wanted=unwanted, look_every_s=0.0)
    assert isinstance(raised.value, JobCancelled)


# --- Size --------------------------------------------------------------------------------------

MOST = 20_000


@pytest.mark.parametrize("packing", ["gzip", "identity"])
@pytest.mark.parametrize(("beyond", "fits"), [(0, True), (1, False)])
def test_an_answer_may_be_as_long_as_the_limit_and_no_longer(
    packing: str, beyond: int, fits: bool
) -> None:
    body = BODY + b" " * (MOST - len(BODY) + beyond)
    packed = gzip.compress(body) if packing == "gzip" else body
    say = whole(packed, f"Content-Encoding: {packing}")
    if fits:
        assert ask(say, most_bytes=MOST).text == "Hi"
    else:
        broken = fault(say, most_bytes=MOST)
        assert (broken.status, broken.retryable) == (200, False)
        assert "longer than 0.02 MB" in str(broken)


def test_a_small_answer_that_unpacks_to_a_large_one_is_never_held() -> None:
    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    bomb = packer.compress(bytes(40_000_000)) + packer.flush()
    tracemalloc.start()
    try:
        broken = fault(whole(bomb, "Content-Encoding: gzip"), most_bytes=100_000)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert "longer than 0.1 MB" in str(broken)
    assert peak < 4_000_000


@pytest.mark.parametrize(
    "say",
    [
        drip(head("Transfer-Encoding: chunked"), b"8000\r\n" + b"x" * 0x8000 + b"\r\n", every_s=0),
        drip(head("Connection: close"), b"x" * 0x8000, every_s=0),
        drip(b"", b"HTTP/1.1 100 Continue\r\n\r\n" * 1000, every_s=0),
        drip(PACKED, EMPTY_BLOCK * 1000, every_s=0),
    ],
    ids=["chunks", "until closed", "continue", "packed"],
)
def test_an_answer_without_end_stops_at_the_limit(say: Say) -> None:
    broken = fault(say, most_bytes=200_000)
    assert "longer than 0.2 MB" in str(broken)


@pytest.mark.parametrize(
    "say",
    [
        drip(b"HTTP/1.1 200 OK\r\n", b"X: " + b"y" * 30_000 + b"\r\n", every_s=0),
        drip(b"HTTP/1.1 200 OK\r\nX: ", b"y" * 30_000, every_s=0),
    ],
)
def test_headers_without_end_are_a_broken_connection(say: Say) -> None:
    assert "the connection failed" in str(fault(say))


@pytest.mark.parametrize("packing", ["br", "zstd", "gzip, gzip", "deflate"])
def test_a_packing_that_nobody_asked_for_is_named(packing: str) -> None:
    broken = fault(whole(BODY, f"Content-Encoding: {packing}"))
    assert f"can't be unpacked: {packing}" in str(broken)


@pytest.mark.parametrize("packed", [gzip.compress(BODY)[:-12], b"nonsense", b""])
def test_a_packed_answer_that_is_broken_is_named(packed: bytes) -> None:
    assert "can't be unpacked: gzip" in str(fault(whole(packed, "Content-Encoding: gzip")))
