"""The log of administrative acts as CSV and as JSON lines, written while it is read."""

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from arena.exports.cells import csv_parts
from augment.models import Event

COLUMNS = ("at", "actor", "verb", "object_kind", "object_code", "before", "after")


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamedFormat:
    """How the log is written, however long it is; `parts` makes the file's bytes one by one."""

    suffix: str
    content_type: str
    parts: Callable[[Iterable[Event]], Iterator[bytes]]


def csv_of(events: Iterable[Event]) -> Iterator[bytes]:
    """One line an act; what changed is JSON in a cell, empty where there was nothing."""
    return csv_parts(COLUMNS, map(_cells, events))


def jsonl_of(events: Iterable[Event]) -> Iterator[bytes]:
    """One object an act."""
    for event in events:
        document = dict(zip(COLUMNS, (*_head(event), event.before, event.after), strict=True))
        yield (json.dumps(document, ensure_ascii=False, sort_keys=True) + "\n").encode()


AUDIT_FORMATS = {
    "csv": StreamedFormat(suffix="csv", content_type="text/csv; charset=utf-8", parts=csv_of),
    "jsonl": StreamedFormat(suffix="jsonl", content_type="application/jsonl", parts=jsonl_of),
}


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
