"""An intent by the fields of a form, request by request, and back, without loss.

What no field holds (moves, landmarks, settings, ...) stays beside the fields as JSON: that of a
request in its row, that of the whole beside all rows. The codec reads what they make together.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from augment.errors import InvalidDocument
from augment.scene.codec import intent_from_document, intent_to_document
from augment.scene.intent import Body, Shape

KINDS = ("vehicles", "walk", "cones", "crash")
CHOICES: dict[str, tuple[str, ...]] = {
    "kind": ("", *KINDS),
    "count": (),
    "distance_m": (),
    "distance_to_m": (),
    "relation": ("ahead", "behind", ""),
    "anchor": (),
    "lane": ("", "own", "left", "right", "oncoming"),
    "body": ("", *(one.value for one in Body)),
    "speed_mps": (),
    "start": ("", "left", "right"),
    "shape": ("", *(one.value for one in Shape)),
    "name": (),
}
"""By field, what can be chosen; where that is nothing, a number or a text is entered."""

REST = "rest"
"""The field of a row for what the others don't hold, as JSON."""

FIELDS = (*CHOICES, REST)

Row = dict[str, str]
"""By the names of FIELDS; what is empty says nothing."""

NEW_ROW: Row = dict.fromkeys(FIELDS, "") | {"relation": "ahead", "count": "1"}

_NUMBERS = ("count", "distance_m", "distance_to_m", "speed_mps")
_WITHIN = {
    "distance_m": ("spot", "distance", "low_m"),
    "distance_to_m": ("spot", "distance", "high_m"),
    **{name: ("spot", name) for name in ("relation", "anchor", "lane")},
}
"""Where fields stand that are not of the request itself."""
_HEAD = {"format": "scenario-arena/intent", "version": 1}


@dataclass(frozen=True, slots=True, kw_only=True)
class IntentFields:
    """What stands in the fields.

    Attributes:
        rows: One for each request, in their order; those without a kind say nothing.
        rest: What else the intent says, as JSON; empty for nothing.
    """

    rows: tuple[Row, ...] = (NEW_ROW,)
    rest: str = ""


def intent_of_fields(given: IntentFields) -> dict[str, Any] | None:
    """Return the intent document of what was filled in; None where nothing was.

    Raises:
        InvalidDocument: A number is none, what stands beside the fields is no JSON object, or
            all together make no intent.
    """
    rows = [(n, row) for n, row in enumerate(given.rows) if row.get("kind") or row.get(REST)]
    rest = _object(given.rest, REST)
    if not rows and not rest:
        return None
    document = _HEAD | rest | {"requests": [_request(f"requests[{n}]", row) for n, row in rows]}
    return intent_to_document(intent_from_document(document))


def fields_of_intent(document: object) -> IntentFields:
    """Return the fields that `intent_of_fields` makes the same intent of.

    Raises:
        InvalidDocument: It is no intent.
    """
    whole = intent_to_document(intent_from_document(document))
    rows = tuple(_row(request) for request in whole.pop("requests"))
    rest = {name: part for name, part in whole.items() if name not in _HEAD}
    return IntentFields(rows=rows or (NEW_ROW,), rest=_json(rest))


# --- Private -----------------------------------------------------------------------------------


def _row(request: dict[str, Any]) -> Row:
    """Take what the fields hold out of a request; what is left becomes JSON."""
    row = dict.fromkeys(FIELDS, "")
    for name in CHOICES:
        *way, last = _WITHIN.get(name, (name,))
        part: Any = request
        for step in way:
            part = part.get(step, {})
        value = part.pop(last, "")
        row[name] = value if isinstance(value, str) else repr(value).removesuffix(".0")
    row[REST] = _json(_pruned(request))
    return row


def _request(at: str, row: Mapping[str, str]) -> dict[str, Any]:
    request = _object(row.get(REST, ""), f"{at}.{REST}")
    for name in CHOICES:
        text = row.get(name, "").strip()
        if not text:
            continue
        *way, last = _WITHIN.get(name, (name,))
        part: Any = request
        for step in way:
            part = part.setdefault(step, {})
            if not isinstance(part, dict):
                raise InvalidDocument("intent", [(f"{at}.{step}", "must be an object")])
        part[last] = _number(text, f"{at}.{name}") if name in _NUMBERS else text
    if "distance" in request.get("spot", {}):
        request["spot"].setdefault("relation", "ahead")
    return request


def _number(text: str, path: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InvalidDocument("intent", [(path, f"{text[:40]!r} is no number")])
    return int(number) if path.endswith(".count") and number.is_integer() else number


def _pruned(value: dict[str, Any]) -> dict[str, Any]:
    """Return it without objects that nothing is left of."""
    parts = {
        name: _pruned(part) if isinstance(part, dict) else part for name, part in value.items()
    }
    return {name: part for name, part in parts.items() if part != {}}


def _json(value: dict[str, Any]) -> str:
    return json.dumps(value, ensure_ascii=False) if value else ""


def _object(text: str, path: str) -> dict[str, Any]:
    try:
        value = json.loads(text) if text.strip() else {}
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise InvalidDocument("intent", [(path, "must be a JSON object")])
    return value
