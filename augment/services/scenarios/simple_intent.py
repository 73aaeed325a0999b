"""An intent of one request from the fields of a form; all else is entered as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from augment.errors import InvalidDocument
from augment.scene.intent_codec import intent_from_document, intent_to_document
from augment.scene.intent_words import Shape

KINDS = ("vehicles", "walk", "cones")
CHOICES: dict[str, tuple[str, ...]] = {
    "kind": ("", *KINDS),
    "count": (),
    "distance_m": (),
    "relation": ("ahead", "behind"),
    "lane": ("", "own", "left", "right", "oncoming"),
    "body": ("", "vehicle", "car", "bicycle", "van", "truck", "bus"),
    "speed_mps": (),
    "start": ("", "left", "right"),
    "shape": ("", *(one.value for one in Shape)),
}
"""By field, what can be chosen; where that is nothing, a number is entered."""

_OF_KIND = {"vehicles": ("body", "speed_mps"), "walk": ("start",), "cones": ("shape",)}


def simple_intent(fields: Mapping[str, str]) -> dict[str, Any] | None:
    """The intent document of what was filled in, None where no kind was chosen.

    Raises:
        InvalidDocument: A number is none, or the fields make no intent.
    """
    kind = fields.get("kind", "")
    if not kind:
        return None
    spot: dict[str, Any] = {"relation": fields.get("relation") or "ahead"}
    distance_m = _number(fields, "distance_m")
    if distance_m is not None:
        spot["distance"] = {"low_m": distance_m}
    if fields.get("lane"):
        spot["lane"] = fields["lane"]
    request: dict[str, Any] = {"kind": kind, "spot": spot}
    count = _number(fields, "count")
    request["count"] = 1 if count is None else int(count) if count == int(count) else count
    for name in _OF_KIND.get(kind, ()):
        value = _number(fields, name) if name.endswith("_mps") else fields.get(name)
        if value not in (None, ""):
            request[name] = value
    document = {"format": "scenario-arena/intent", "version": 1, "requests": [request]}
    return intent_to_document(intent_from_document(document))


def _number(fields: Mapping[str, str], name: str) -> float | None:
    text = fields.get(name, "").strip()
    if not text:
        return None
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InvalidDocument("intent", [(name, f"{text[:40]!r} is no number")])
    return number
