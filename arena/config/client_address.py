"""Where a request comes from, for the lock of the login."""

from __future__ import annotations

from ipaddress import IPv6Address, ip_address, ip_network

from django.conf import settings
from django.http import HttpRequest


def client_address(request: HttpRequest) -> str | None:
    """The address of whoever asks, None where there is none (a socket of this machine).

    A header is believed only as far as our own proxies wrote it: with N of them in front, the Nth
    entry from the right is what the outermost of ours saw. Everything further left may be made up.
    Of IPv6 the first 64 bits count, the rest being whoever's own to change as they like; an IPv4
    address written as IPv6 is that IPv4 address.
    """
    seen = str(request.META.get("REMOTE_ADDR", ""))
    if settings.PROXIES:
        parts = str(request.META.get("HTTP_X_FORWARDED_FOR", "")).split(",")
        if len(parts) >= settings.PROXIES:
            seen = parts[-settings.PROXIES].strip()
    try:
        address = ip_address(seen)
    except ValueError:
        return None
    if isinstance(address, IPv6Address):
        if address.ipv4_mapped is not None:
            return str(address.ipv4_mapped)
        return str(ip_network((address.packed, 64), strict=False).network_address)
    return str(address)
