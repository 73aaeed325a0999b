"""Messages to addresses that admins entered, by the rules and the proxy of this installation."""

from __future__ import annotations

import socket
from collections.abc import Mapping

from django.conf import settings

from augment.llm.addresses import Resolve, check_notice_url, check_resolved
from augment.llm.wire_notice import NoticeAnswer, post_notice

TIMEOUT_S = 10.0
RESOLVE: Resolve = socket.getaddrinfo
"""From a name to addresses."""

__all__ = ["NoticeAnswer", "check_address", "send_notice"]


def check_address(url: str) -> str:
    """An address that messages may go to, looked up today.

    Raises:
        InvalidDocument: It is none, or leads to a link-local or metadata address.
    """
    checked = check_notice_url(url)
    if not settings.LLM_PROXY:
        check_resolved(checked, resolve=RESOLVE)
    return checked


def send_notice(url: str, *, body: bytes, headers: Mapping[str, str]) -> NoticeAnswer:
    """Send it once; where the name leads is looked up, checked and connected to anew.

    Raises:
        NoticeLost: There was no answer.
    """
    return post_notice(
        url,
        body=body,
        headers=headers,
        timeout_s=TIMEOUT_S,
        proxy_url=settings.LLM_PROXY,
        resolve=RESOLVE,
    )
