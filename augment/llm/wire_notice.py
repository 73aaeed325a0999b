"""One message to an address that somebody entered, by the network's rules for endpoints."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from dataclasses import dataclass

from augment.errors import InvalidDocument, NoticeLost
from augment.llm.addresses import Resolve
from augment.llm.client import watch_nothing
from augment.llm.wire_network import Network
from augment.llm.wire_transport import ACCEPTED, BadPacking, Transport
from augment.llm.wire_watch import OutOfTime, TooLong, Watch, Watches

MOST_BYTES = 64 * 1024
"""Of an answer; nobody needs more than its status and its first words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NoticeAnswer:
    """What a message was answered with."""

    status: int
    text: str


def post_notice(
    url: str,
    *,
    body: bytes,
    headers: Mapping[str, str],
    timeout_s: float,
    proxy_url: str = "",
    resolve: Resolve = socket.getaddrinfo,
) -> NoticeAnswer:
    """Send it once. Redirects are not followed: they lead where nobody looked.

    Args:
        url: As `check_notice_url` took it.
        body: What is sent.
        headers: Beside those of every request.
        timeout_s: From its start to the last byte of the answer.
        proxy_url: What all goes through, empty for none.
        resolve: From a name to addresses, which are checked and then connected to.

    Raises:
        NoticeLost: There was no answer; the text says why.
    """
    import httpx2

    watches = Watches()
    transport = Transport(
        Network(watches, resolve=resolve, checks=not proxy_url),
        watches,
        ssl_context=httpx2.create_ssl_context(verify=url.lower().startswith("https:")),
        proxy_url=proxy_url,
    )
    watch = Watch(longest_s=timeout_s, most_bytes=MOST_BYTES, still_wanted=watch_nothing)
    try:
        with (
            httpx2.Client(transport=transport, trust_env=False) as client,  # type: ignore[arg-type]
            watches.over(watch),
        ):
            answer = client.post(
                url,
                content=body,
                headers={"Accept-Encoding": ACCEPTED, **headers},
                follow_redirects=False,
            )
    except httpx2.HTTPError as error:
        raise NoticeLost(_why(error, watch, timeout_s)) from None
    return NoticeAnswer(status=answer.status_code, text=answer.text)


def _why(error: BaseException, watch: Watch, timeout_s: float) -> str:
    """In words, without anything of what was sent."""
    if isinstance(watch.ended_by, OutOfTime):
        return f"no answer within {timeout_s:g} s"
    inner: BaseException | None = error
    while inner is not None:
        if isinstance(inner, InvalidDocument):
            return inner.problems[0][1]
        if isinstance(inner, TooLong):
            return f"an answer of more than {MOST_BYTES} bytes"
        if isinstance(inner, BadPacking):
            return "an answer that can't be unpacked"
        if isinstance(inner, OSError) and inner.strerror:
            return inner.strerror
        error, inner = inner, inner.__cause__ or inner.__context__
    return type(error).__name__
