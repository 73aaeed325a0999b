"""When endpoints had the addresses that they have now, from the log of what was changed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from datetime import datetime

from augment.models import Endpoint, Event

Spell = tuple[datetime | None, datetime | None]
"""From when until when; None where it has no such end."""


def spells_at_address(endpoints: Sequence[Endpoint]) -> dict[str, list[Spell]]:
    """By label, when an endpoint had its address; only those that were ever moved are in it."""
    codes = {str(row.code): row for row in endpoints}
    changes = Event.objects.filter(
        object_kind="endpoint", object_code__in=codes, verb="change"
    ).order_by("at", "pk")
    moves: dict[str, list[tuple[datetime, str, str]]] = defaultdict(list)
    for code, at, before, after in changes.values_list("object_code", "at", "before", "after"):
        left, taken = _address(before), _address(after)
        if left != taken:
            moves[code].append((at, left, taken))
    return {codes[code].label: _spells(codes[code], found) for code, found in moves.items()}


# --- Private -----------------------------------------------------------------------------------


def _spells(endpoint: Endpoint, moves: Sequence[tuple[datetime, str, str]]) -> list[Spell]:
    wanted = endpoint.base_url.rstrip("/")
    found: list[Spell] = []
    since: datetime | None = None
    for at, left, _ in moves:
        if left == wanted:
            found.append((since, at))
        since = at
    if moves[-1][2] == wanted:
        found.append((since, None))
    return found


def _address(facts: object) -> str:
    """The address in what the log keeps of an endpoint; two are one but for a slash at the end."""
    return str(facts.get("base_url", "")).rstrip("/") if isinstance(facts, dict) else ""
