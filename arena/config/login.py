"""Login limits per account and address, and where a request comes from."""

from ipaddress import IPv6Address, ip_address, ip_network
from typing import Any

from axes.attempts import get_cool_off_threshold
from axes.handlers.database import AxesDatabaseHandler
from axes.helpers import get_failure_limit
from axes.models import AccessAttempt
from django.conf import settings
from django.db.models import Sum
from django.http import HttpRequest


class LoginLimit(AxesDatabaseHandler):  # type: ignore[misc] # untyped
    """Count failures per address as well, against trying every account a few times.

    A successful login clears the count of its own account only.
    """

    def get_failures(self, request: HttpRequest, credentials: dict[str, Any] | None = None) -> int:
        """Return the failures of the account here; the limit if the address reached its own."""
        failures = int(super().get_failures(request, credentials))
        address = getattr(request, "axes_ip_address", None)
        if address is None:
            return failures
        recent = AccessAttempt.objects.filter(
            ip_address=address, attempt_time__gt=get_cool_off_threshold(request)
        )
        total = recent.aggregate(total=Sum("failures_since_start"))["total"] or 0
        if total < settings.ADDRESS_FAILURE_LIMIT:
            return failures
        return max(failures, int(get_failure_limit(request, credentials)))


def client_address(request: HttpRequest) -> str | None:
    """Return the client's address, None for a local socket.

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
