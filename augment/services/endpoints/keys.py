"""Which environment variables may hold an endpoint's key, and the key itself at the moment of use.

An endpoint names a variable and a host, and the variable's value goes to that host. So only
variables that are meant for keys may be named: `*_API_KEY`, and what ARENA_KEY_VARIABLES lists.
"""

from __future__ import annotations

import os
import re
from urllib.parse import urlsplit

from django.conf import settings
from django.contrib.auth.models import User

from augment.errors import InvalidDocument, KeyMissing, KeyNotAllowed
from augment.models import Endpoint
from augment.services.events import log_event

_A_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,79}")
_FOR_KEYS = re.compile(r"[A-Za-z_][A-Za-z0-9_]*_API_KEY")

RULE = "a variable whose name ends in _API_KEY, or one that ARENA_KEY_VARIABLES lists"


def may_hold_key(variable: str) -> bool:
    """Whether an endpoint may be sent what this variable holds."""
    return bool(_FOR_KEYS.fullmatch(variable)) or variable in settings.KEY_VARIABLES


def check_key_variable(variable: str) -> None:
    """Nothing for a variable that an endpoint may name, or for none.

    Raises:
        InvalidDocument: It is no name, or not meant for keys. What is no name is not repeated,
            because it may be the key itself.
    """
    if not variable:
        return
    problem = ""
    if not _A_NAME.fullmatch(variable):
        problem = "the name of an environment variable is needed, not the key"
    elif not may_hold_key(variable):
        problem = (
            f"{variable} may not be sent to an endpoint: a variable whose name ends in _API_KEY, "
            "or one that ARENA_KEY_VARIABLES lists is needed"
        )
    if problem:
        raise InvalidDocument("endpoint", [("key_variable", problem)])


def is_key_here(variable: str) -> bool:
    """Whether this process has the key; workers elsewhere may have it all the same."""
    return bool(os.environ.get(variable, "").strip())


def list_key_variables() -> list[str]:
    """Names, and only names, of the variables that may hold a key and are set or listed here."""
    here = {name for name in os.environ if _FOR_KEYS.fullmatch(name)}
    return sorted(here | set(settings.KEY_VARIABLES))


def move_of(*, endpoint: Endpoint, base_url: str, key_variable: str) -> tuple[str, str] | None:
    """Where an endpoint's key went so far and would go, None where it goes on to the same server.

    Args:
        endpoint: As it is stored.
        base_url: As it is to be.
        key_variable: As it is to be.
    """
    before, after = _server(endpoint.base_url), _server(base_url)
    has_key = bool(endpoint.key_variable and key_variable)
    return (before, after) if has_key and before != after else None


def log_move(move: tuple[str, str] | None, *, endpoint: Endpoint, actor: User | None) -> None:
    """Note that a key goes elsewhere from now on; nothing where it does not."""
    if move is not None:
        log_event(
            actor=actor,
            verb="move key",
            object_kind="endpoint",
            object_code=endpoint.code,
            before={"server": move[0]},
            after={"server": move[1], "key_variable": endpoint.key_variable},
        )


def key_of(endpoint: Endpoint) -> str | None:
    """The endpoint's key, read from the environment at the moment of the call.

    Raises:
        KeyNotAllowed: The variable is not meant for keys, whoever wrote it into the row.
        KeyMissing: The variable is not set; the sentence names it.
    """
    variable = endpoint.key_variable
    if not variable:
        return None
    if not may_hold_key(variable):
        raise KeyNotAllowed(variable, endpoint.label, RULE)
    key = os.environ.get(variable, "").strip()
    if not key:
        raise KeyMissing(variable, endpoint.label)
    return key


# --- Private -----------------------------------------------------------------------------------


def _server(base_url: str) -> str:
    """Scheme, host and port: a key sent without encryption goes elsewhere, too."""
    parts = urlsplit(base_url)
    scheme = parts.scheme.lower()
    port = parts.port or {"http": 80, "https": 443}.get(scheme)
    return f"{scheme}://{(parts.hostname or '').rstrip('.')}:{port}"
