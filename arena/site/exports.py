"""The log of administrative acts as CSV, written while it is read."""

import json
from collections.abc import Iterable, Iterator

from arena.exports.cells import csv_parts
from augment.models import Event

COLUMNS = ("at", "actor", "verb", "object_kind", "object_code", "before", "after")


def audit_csv(events: Iterable[Event]) -> Iterator[bytes]:
    """Yield one line an act; what changed is JSON in a cell, empty where there was nothing."""
    lines = (
        [
            event.at.isoformat(),
            "" if event.actor is None else event.actor.person.pseudonym,
            *(event.verb, event.object_kind, event.object_code),
            *(
                part and json.dumps(part, ensure_ascii=False)
                for part in (event.before, event.after)
            ),
        ]
        for event in events
    )
    return csv_parts(COLUMNS, lines)
