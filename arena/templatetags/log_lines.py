"""What stands in the log of a study, as a person reads it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from django import template

from arena.templatetags.results import left_out, method_label
from augment.models import Event
from augment.services.scenarios.scenes import type_label

register = template.Library()


@dataclass(frozen=True, slots=True, kw_only=True)
class Detail:
    """A part of what happened: its name, how it reads, and the rating that it leads to."""

    label: str
    text: str
    rating: str = ""


@register.simple_tag
def details_of(event: Event, names: Mapping[str, str]) -> list[Detail]:
    """The parts of an event that say something.

    Args:
        event: Of the log.
        names: Pseudonyms by code and by account, names of contestants by slug.
    """
    return list(_details(event, names))


# --- Private -----------------------------------------------------------------------------------

_LABELS: dict[str, str] = {
    "batch": "batch",
    "contestant": "contestant",
    "ends_voting": "votes no longer in this study",
    "expert": "expert",
    "file": "file",
    "filters": "which votes",
    "matchups": "pairs",
    "method": "method",
    "name": "name",
    "seed": "seed",
    "sha256": "SHA-256",
    "snapshot": "rating",
    "state": "state",
    "votes": "votes",
    "what": "seen",
    "why": "why",
}
_STATES: dict[str, str] = {"open": "open", "closed": "closed", "cancelled": "cancelled"}

Names = Mapping[str, str]


def _details(event: Event, names: Names) -> Iterable[Detail]:
    before, after = event.before or {}, event.after or {}
    for key, value in after.items():
        text = _text(key, value, names)
        if key in before and before[key] != value:
            text = f"{_text(key, before[key], names)}, then {text}"  # fmt: skip
        if text:
            rating = str(value) if key == "snapshot" else ""
            yield Detail(label=str(_LABELS.get(key, key)), text=text, rating=rating)
    for key, value in before.items():
        if key not in after and (text := _text(key, value, names)):
            yield Detail(label=f"before: {_LABELS.get(key, key)}", text=text)


def _text(key: str, value: Any, names: Names) -> str:
    written = _WRITERS.get(key)
    return written(value, names) if written else _plain(value, names)


def _plain(value: Any, names: Names) -> str:
    """Yes and no in words, names instead of codes, parts one after the other."""
    if value is None or value == "":
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        parts = ((names.get(str(k), str(k)), _plain(v, names)) for k, v in value.items())
        return ", ".join(f"{key}: {text}" for key, text in parts if text)
    if isinstance(value, list | tuple):
        return ", ".join(_plain(one, names) for one in value)
    return names.get(str(value), str(value))


def _number(value: Any, names: Names) -> str:
    """How many; older lines name each."""
    return str(len(value)) if isinstance(value, list) else _plain(value, names)


def _only_yes(value: Any, names: Names) -> str:
    return "yes" if value else ""


def _seen(value: Any, names: Names) -> str:
    return "the results" if value == "results" else str(value)


def _filters(value: Any, names: Names) -> str:
    """Which votes a rating asked for; nothing where it asked for all main ones."""
    if not isinstance(value, Mapping):
        return _plain(value, names)
    said = []
    if types := value.get("types"):
        said.append(", ".join(type_label(name) for name in types))
    if experts := value.get("experts"):
        n = experts if isinstance(experts, int) else len(experts)
        said.append(("%(n)s expert" if n == 1 else "%(n)s experts") % {"n": n})
    if "repeat" in value.get("kinds", ()):
        said.append("hidden repeats count")
    if value.get("leave_out_settled"):
        said.append("pairs that nobody can tell apart are left out")
    if value.get("leave_out_own"):
        said.append(f"left out: {left_out('own')}")
    return "; ".join(said) or "all"


_WRITERS: dict[str, Callable[[Any, Names], str]] = {
    "ends_voting": _only_yes,
    "filters": _filters,
    "matchups": _number,
    "method": lambda value, names: method_label(value),
    "snapshot": lambda value, names: str(value)[:8],
    "sha256": lambda value, names: f"{str(value)[:12]}…",
    "state": lambda value, names: str(_STATES.get(value, value)),
    "what": _seen,
}
