"""The log of administrative acts as CSV and as JSON lines."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator

from arena.exports.formats import Format
from arena.services.cells import csv_text
from augment.models import Event

COLUMNS = ("at", "actor", "verb", "object_kind", "object_code", "before", "after")


def csv_bytes(events: Iterable[Event]) -> bytes:
    """One line an act; what changed is JSON in a cell, empty where there was nothing."""
    return csv_text(COLUMNS, map(_cells, events)).encode()


def jsonl_bytes(events: Iterable[Event]) -> bytes:
    """One object an act."""
    return "".join(_lines(events)).encode()


AUDIT_FORMATS: dict[str, Format[Iterable[Event]]] = {
    "csv": Format(
        suffix="csv", content_type="text/csv; charset=utf-8", is_text=True, write=csv_bytes
    ),
    "jsonl": Format(
        suffix="jsonl", content_type="application/jsonl", is_text=True, write=jsonl_bytes
    ),
}


def _lines(events: Iterable[Event]) -> Iterator[str]:
    for event in events:
        document = dict(zip(COLUMNS, (*_head(event), event.before, event.after), strict=True))
        yield json.dumps(document, ensure_ascii=False, sort_keys=True) + "\n"


def _head(event: Event) -> tuple[str, ...]:
    """Who by pseudonym, empty for the machine."""
    actor = "" if event.actor is None else event.actor.person.pseudonym
    return event.at.isoformat(), actor, event.verb, event.object_kind, event.object_code


def _cells(event: Event) -> list[object]:
    changes = (event.before, event.after)
    return [
        *_head(event),
        *("" if one is None else json.dumps(one, ensure_ascii=False) for one in changes),
    ]
