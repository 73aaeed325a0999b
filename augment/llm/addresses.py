"""Allowed addresses of endpoints: all but those of a cloud's own secrets.

Whoever may add a contestant decides where the server sends requests. This computer and the local
network stay allowed, because own model servers live there. An IPv6 address that stands for an
IPv4 one (mapped, translated, tunnelled) is refused whatever it stands for: no model is served from
it, and where it leads is decided by whoever translates.
"""

import socket
from collections.abc import Callable
from ipaddress import IPv4Address, IPv6Address, IPv6Network, ip_address
from typing import Any
from urllib.parse import urlsplit

from augment.errors import InvalidDocument

Resolve = Callable[..., list[Any]]
"""What `socket.getaddrinfo` does."""

_METADATA_NAMES = frozenset(
    {"metadata", "metadata.google.internal", "metadata.goog", "metadata.azure.internal"}
    | {"instance-data", "instance-data.ec2.internal"}
)
# Beside those of 169.254.0.0/16, which are link-local: Alibaba, Oracle, Azure; AWS, its pods,
# Google, Scaleway.
_METADATA_ADDRESSES = frozenset(
    map(ip_address, ("100.100.100.200", "192.0.0.192", "168.63.129.16"))
) | frozenset(map(ip_address, ("fd00:ec2::254", "fd00:ec2::23", "fd20:ce::254", "fd00:42::42")))
_STAND_FOR_IPV4 = tuple(
    IPv6Network(text)
    for text in (
        *("::/96", "::ffff:0:0/96", "::ffff:0:0:0/96"),  # compatible, mapped, translated
        *("64:ff9b::/96", "64:ff9b:1::/48"),  # NAT64
        *("2001::/32", "2002::/16"),  # Teredo, 6to4
    )
)
_LOOPBACK = IPv6Address("::1")
_FORBIDDEN = "a link-local or metadata address, or one that stands for another"


def check_base_url(base_url: str) -> str:
    """Return the address without a slash at its end.

    Raises:
        InvalidDocument: It is no http(s) address, it carries a password or a query, or it is a
            link-local, metadata or translated address.
    """
    problem, host = "", ""
    try:
        parts = urlsplit(base_url)
        parts.port  # noqa: B018 - reading it is what checks it
        host = (parts.hostname or "").rstrip(".").lower()
    except ValueError:
        parts = urlsplit("")
    if parts.scheme not in {"http", "https"} or not host:
        problem = "an address such as https://api.openai.com/v1 is needed"
    elif parts.username or parts.password or parts.query or parts.fragment:
        problem = "keys and passwords don't belong into the address; name a variable for the key"
    elif host in _METADATA_NAMES or _is_forbidden(host):
        problem = f"{host} is {_FORBIDDEN}; no model is served from there"
    if problem:
        raise InvalidDocument("endpoint", [("base_url", problem)])
    return base_url.rstrip("/")


def resolve_host(
    host: str, *, resolve: Resolve = socket.getaddrinfo, checks: bool = True
) -> list[str]:
    """Return the addresses of a host as numbers, in the order in which they are to be tried.

    Args:
        host: A name or a number.
        resolve: From a name to addresses.
        checks: Whether they are held against the rule.

    Raises:
        InvalidDocument: One of its addresses is forbidden.
        OSError, UnicodeError: Nobody knows the name.
    """
    entries = resolve(host, None, type=socket.SOCK_STREAM)
    addresses = list(dict.fromkeys(str(entry[4][0]) for entry in entries))
    for text in addresses if checks else ():
        if _is_forbidden(text, unknown=True):
            problem = f"{host} leads to {text}, {_FORBIDDEN}"
            raise InvalidDocument("endpoint", [("base_url", problem)])
    return addresses


# Private


def _is_forbidden(host: str, *, unknown: bool = False) -> bool:
    """Return whether a number is forbidden, also in the forms of C; `unknown` for a name."""
    address: IPv4Address | IPv6Address
    try:
        address = ip_address(host.partition("%")[0])
    except ValueError:
        try:
            address = IPv4Address(socket.inet_aton(host))
        except OSError:
            return unknown
    is_other_v6 = isinstance(address, IPv6Address) and address != _LOOPBACK
    return (
        (is_other_v6 and any(address in network for network in _STAND_FOR_IPV4))
        or address.is_link_local
        or address.is_multicast
        or address.is_unspecified
        or address in _METADATA_ADDRESSES
    )
