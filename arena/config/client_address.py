"""Where a request comes from, for the lock of the login."""

from __future__ import annotations

from ipaddress import ip_address

from django.conf import settings
from django.http import HttpRequest


def client_address(request: HttpRequest) -> str | None:
    """The address of whoever asks, None where there is none (a socket of this machine).

    A header is believed only as far as our own proxies wrote it: with N of them in front, the Nth
    entry from the right is what the outermost of ours saw. Everything further left may be made up.
    """
    seen = str(request.META.get("REMOTE_ADDR", ""))
    if settings.PROXIES:
        parts = str(request.META.get("HTTP_X_FORWARDED_FOR", "")).split(",")
        if len(parts) >= settings.PROXIES:
            seen = parts[-settings.PROXIES].strip()
    try:
        return str(ip_address(seen))
    except ValueError:
        return None
