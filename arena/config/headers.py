"""What every answer says, whoever made it: page, wire, picture, static file or error."""

from __future__ import annotations

from collections.abc import Callable

from django.http import HttpRequest
from django.http.response import HttpResponseBase

NOT_KEPT = "private, no-store"
"""Nothing of a page stays behind in a browser after signing out, nor in a proxy."""

NOT_USED = (
    *("accelerometer", "autoplay", "bluetooth", "browsing-topics", "camera", "display-capture"),
    *("encrypted-media", "fullscreen", "geolocation", "gyroscope", "hid", "idle-detection"),
    *("local-fonts", "magnetometer", "microphone", "midi", "payment", "picture-in-picture"),
    *("publickey-credentials-get", "screen-wake-lock", "serial", "usb", "xr-spatial-tracking"),
)
"""Features of browsers that no page needs, so none may ask for them."""

POLICY = ", ".join(f"{feature}=()" for feature in NOT_USED)


class HeaderMiddleware:
    """Stands first, so that redirects and errors of all others pass through it as well."""

    def __init__(self, get_response: Callable[[HttpRequest], HttpResponseBase]) -> None:
        self.get_response = get_response

    def __call__(self, request: HttpRequest) -> HttpResponseBase:
        """The answer; what says itself how it may be kept goes on saying so."""
        answer = self.get_response(request)
        answer.headers.setdefault("Cache-Control", NOT_KEPT)
        answer.headers.setdefault("Permissions-Policy", POLICY)
        return answer
