"""Random names in addresses."""

from __future__ import annotations

import secrets


def fresh_token() -> str:
    """A token that nobody can guess and that says nothing."""
    return secrets.token_urlsafe(24)
