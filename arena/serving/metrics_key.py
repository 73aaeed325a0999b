"""Who may read the metrics without an account."""

from __future__ import annotations

import secrets

from django.conf import settings


def opens_metrics(authorization: str | None) -> bool:
    """Whether a header bears the token of the settings; without a token none does."""
    expected = settings.METRICS_TOKEN
    scheme, _, given = (authorization or "").partition(" ")
    is_bearer = scheme.lower() == "bearer" and bool(expected)
    return is_bearer and secrets.compare_digest(given.strip().encode(), expected.encode())
