"""Which addresses an endpoint may have: anything but the doors to a cloud's own secrets.

Whoever may add a contestant decides where the server sends requests. This computer and the local
network stay allowed, because own model servers live there.
"""

from __future__ import annotations

import socket
from collections.abc import Callable
from ipaddress import IPv4Address, IPv6Address, ip_address
from typing import Any
from urllib.parse import SplitResult, urlsplit

from augment.errors import InvalidDocument

Resolve = Callable[..., list[Any]]
"""What `socket.getaddrinfo` does."""

_METADATA_NAMES = frozenset(
    {"metadata", "metadata.google.internal", "metadata.goog", "metadata.azure.internal"}
    | {"instance-data", "instance-data.ec2.internal"}
)
_METADATA_ADDRESSES = frozenset(
    ip_address(text)
    for text in ("100.100.100.200", "192.0.0.192", "168.63.129.16", "fd00:ec2::254")
)


def check_base_url(base_url: str) -> str:
    """The address without a slash at its end.

    Raises:
        InvalidDocument: It is no http(s) address, it carries a password or a query, or it leads
            to a link-local or metadata address.
    """
    problem = _problem(base_url)
    if problem:
        raise InvalidDocument("endpoint", [("base_url", f"{problem}")])
    return base_url.rstrip("/")


def check_resolved(base_url: str, *, resolve: Resolve = socket.getaddrinfo) -> None:
    """Look where the name leads today; a name that nobody knows leads nowhere and passes.

    Whoever owns a name can still change it between this look and the call.

    Raises:
        InvalidDocument: One of its addresses is link-local or metadata.
    """
    parts = _split(base_url)
    host = (parts.hostname if parts else None) or ""
    try:
        found = {entry[4][0] for entry in resolve(host, None, type=socket.SOCK_STREAM)}
    except (OSError, UnicodeError):
        return
    for text in sorted(map(str, found)):
        address = _address(text)
        if address is not None and _is_forbidden(address):
            problem = f"{host} leads to {text}, a link-local or metadata address"
            raise InvalidDocument("endpoint", [("base_url", problem)])


# --- Private -----------------------------------------------------------------------------------


def _problem(base_url: str) -> str | None:
    """What is wrong with the address, None when nothing is."""
    parts = _split(base_url)
    if parts is None or parts.scheme not in {"http", "https"} or not parts.hostname:
        return "an address such as https://api.openai.com/v1 is needed"
    if parts.username or parts.password or parts.query or parts.fragment:
        return "keys and passwords don't belong into the address; name a variable for the key"
    host = parts.hostname.rstrip(".").lower()
    address = _address(host)
    if host in _METADATA_NAMES or (address is not None and _is_forbidden(address)):
        return f"{host} is a link-local or metadata address, which no model is served from"
    return None


def _split(base_url: str) -> SplitResult | None:
    """The parts, None when it can't be taken apart (a port of letters, half a bracket)."""
    try:
        parts = urlsplit(base_url)
        parts.port  # noqa: B018 - reading it is what checks it
    except ValueError:
        return None
    return parts


def _address(host: str) -> IPv4Address | IPv6Address | None:
    """The number that a host is written as, also in the short and hexadecimal forms of C."""
    try:
        found = ip_address(host.partition("%")[0])
    except ValueError:
        try:
            return IPv4Address(socket.inet_aton(host))
        except OSError:
            return None
    if isinstance(found, IPv6Address) and found.ipv4_mapped:
        return found.ipv4_mapped
    return found


def _is_forbidden(address: IPv4Address | IPv6Address) -> bool:
    return (
        address.is_link_local
        or address.is_multicast
        or address.is_unspecified
        or address in _METADATA_ADDRESSES
    )
