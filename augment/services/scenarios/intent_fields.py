"""An intent by the fields of a form, request by request, and back, without loss.

What no field holds (moves, landmarks, settings, ...) stays beside the fields as JSON: that of a
request in its row, that of the whole beside all rows. The codec reads what they make together.
"""

import json
import math
from collections.abc import Iterator, Mapping
from copy import deepcopy
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
TEXTS = ("anchor", "name")
MOST_REQUESTS = 20

Row = dict[str, str]
"""By the names of FIELDS; what is empty says nothing."""

NEW_ROW: Row = dict.fromkeys(FIELDS, "") | {"relation": "ahead", "count": "1"}

_PATHS: dict[str, tuple[str, ...]] = {
    "distance_m": ("spot", "distance", "low_m"),
    "distance_to_m": ("spot", "distance", "high_m"),
    **{name: ("spot", name) for name in ("relation", "anchor", "lane")},
    **{name: (name,) for name in ("count", "body", "speed_mps", "start", "shape", "name")},
}
_ONLY_OF = {
    "body": ("vehicles", "crash"),
    "speed_mps": ("vehicles", "walk"),
    "start": ("walk", "cones"),
    "shape": ("cones",),
}
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
    """The intent document of what was filled in; None where nothing was.

    Raises:
        InvalidDocument: A number is none, a field is of another kind, what stands beside the
            fields is no JSON object, or all together make no intent.
    """
    rows = [(n, row) for n, row in enumerate(given.rows) if row.get("kind") or row.get(REST)]
    rest = _object(given.rest, REST)
    if not rows and not rest:
        return None
    if len(rows) > MOST_REQUESTS:
        problem = f"{len(rows)} are too many for the fields, at most {MOST_REQUESTS}"
        raise InvalidDocument("intent", [("requests", problem)])
    problems = [problem for n, row in rows for problem in _misplaced(n, row)]
    if problems:
        raise InvalidDocument("intent", problems)
    document = _HEAD | rest | {"requests": [_request(n, row) for n, row in rows]}
    return intent_to_document(intent_from_document(document))


def fields_of_intent(document: object) -> IntentFields:
    """The fields that `intent_of_fields` makes the same intent of.

    Raises:
        InvalidDocument: It is no intent.
    """
    whole = intent_to_document(intent_from_document(document))
    rows = tuple(_row(request) for request in whole.pop("requests"))
    rest = {name: part for name, part in whole.items() if name not in _HEAD}
    return IntentFields(rows=rows or (NEW_ROW,), rest=_json(rest))


# --- Private -----------------------------------------------------------------------------------


def _row(request: Mapping[str, Any]) -> Row:
    rest = deepcopy(dict(request))
    row = dict.fromkeys(FIELDS, "") | {"kind": rest.pop("kind")}
    for name, path in _PATHS.items():
        if name in _ONLY_OF and row["kind"] not in _ONLY_OF[name]:
            continue
        *way, last = path
        held: Any = rest
        for step in way:
            held = held.get(step, {})
        if last in held:
            row[name] = _text(held.pop(last))
    row[REST] = _json(_pruned(rest))
    return row


def _request(number: int, row: Mapping[str, str]) -> dict[str, Any]:
    at = f"requests[{number}]"
    found = _object(row.get(REST, ""), f"{at}.{REST}") | {"kind": row.get("kind", "")}
    for name, path in _PATHS.items():
        value = _value(row, name, at)
        if value is None:
            continue
        *way, last = path
        held = found
        for step in way:
            held = held.setdefault(step, {})
            if not isinstance(held, dict):
                raise InvalidDocument("intent", [(f"{at}.{step}", "must be an object")])
        held[last] = value
    if "distance" in found.get("spot", {}):
        found["spot"].setdefault("relation", "ahead")
    return found


def _misplaced(number: int, row: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Fields that a request of this kind has no use for."""
    kind = row.get("kind", "")
    if kind not in KINDS:
        yield f"requests[{number}].kind", f"{kind[:40]!r} is none of {', '.join(KINDS)}"
        return
    for name, kinds in _ONLY_OF.items():
        if row.get(name) and kind not in kinds:
            yield f"requests[{number}].{name}", f"is for {' and '.join(kinds)}, not for {kind}"


def _value(row: Mapping[str, str], name: str, at: str) -> str | float | None:
    text = row.get(name, "").strip()
    if not text:
        return None
    if CHOICES[name] or name in TEXTS:
        return text
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        problem = f"{text[:40]!r} is no number"
        raise InvalidDocument("intent", [(f"{at}.{name}", problem)])
    return int(number) if name == "count" and number.is_integer() else number


def _text(value: str | float) -> str:
    return value if isinstance(value, str) else repr(value).removesuffix(".0")


def _pruned(value: dict[str, Any]) -> dict[str, Any]:
    """Without objects that nothing is left of."""
    found = {
        name: _pruned(part) if isinstance(part, dict) else part for name, part in value.items()
    }
    return {name: part for name, part in found.items() if part != {}}


def _json(value: dict[str, Any]) -> str:
    return json.dumps(value, ensure_ascii=False) if value else ""


def _object(text: str, path: str) -> dict[str, Any]:
    if not text.strip():
        return {}
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise InvalidDocument("intent", [(path, "is no JSON")]) from None
    if not isinstance(found, dict):
        raise InvalidDocument("intent", [(path, "must be a JSON object")])
    return found
