"""What stands in the log of a study, as a person reads it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from django import template
from django.utils.functional import Promise
from django.utils.translation import gettext as _
from django.utils.translation import gettext_lazy, ngettext

from arena.templatetags.results import left_out, method_label, type_label
from augment.models import Event

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

_LABELS: dict[str, str | Promise] = {
    "batch": gettext_lazy("batch"),
    "contestant": gettext_lazy("contestant"),
    "ends_voting": gettext_lazy("votes no longer in this study"),
    "expert": gettext_lazy("expert"),
    "file": gettext_lazy("file"),
    "filters": gettext_lazy("which votes"),
    "matchups": gettext_lazy("pairs"),
    "method": gettext_lazy("method"),
    "name": gettext_lazy("name"),
    "seed": gettext_lazy("seed"),
    "sha256": gettext_lazy("SHA-256"),
    "snapshot": gettext_lazy("rating"),
    "state": gettext_lazy("state"),
    "votes": gettext_lazy("votes"),
    "what": gettext_lazy("seen"),
    "why": gettext_lazy("why"),
}
_STATES: dict[str, str | Promise] = {
    "open": gettext_lazy("open"),
    "closed": gettext_lazy("closed"),
    "cancelled": gettext_lazy("cancelled"),
}

Names = Mapping[str, str]


def _details(event: Event, names: Names) -> Iterable[Detail]:
    before, after = event.before or {}, event.after or {}
    for key, value in after.items():
        text = _text(key, value, names)
        if key in before and before[key] != value:
            text = _("%(before)s, then %(after)s") % {
                "before": _text(key, before[key], names), "after": text,
            }  # fmt: skip
        if text:
            rating = str(value) if key == "snapshot" else ""
            yield Detail(label=str(_LABELS.get(key, key)), text=text, rating=rating)
    for key, value in before.items():
        if key not in after and (text := _text(key, value, names)):
            yield Detail(label=_("before: %(what)s") % {"what": _LABELS.get(key, key)}, text=text)


def _text(key: str, value: Any, names: Names) -> str:
    written = _WRITERS.get(key)
    return written(value, names) if written else _plain(value, names)


def _plain(value: Any, names: Names) -> str:
    """Yes and no in words, names instead of codes, parts one after the other."""
    if value is None or value == "":
        return ""
    if isinstance(value, bool):
        return _("yes") if value else _("no")
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
    return _("yes") if value else ""


def _seen(value: Any, names: Names) -> str:
    return _("the results") if value == "results" else str(value)


def _filters(value: Any, names: Names) -> str:
    """Which votes a rating asked for; nothing where it asked for all main ones."""
    if not isinstance(value, Mapping):
        return _plain(value, names)
    said = []
    if types := value.get("types"):
        said.append(", ".join(type_label(name) for name in types))
    if experts := value.get("experts"):
        n = experts if isinstance(experts, int) else len(experts)
        said.append(ngettext("%(n)s expert", "%(n)s experts", n) % {"n": n})
    if "repeat" in value.get("kinds", ()):
        said.append(_("hidden repeats count"))
    if value.get("leave_out_settled"):
        said.append("pairs that nobody can tell apart are left out")
    if value.get("leave_out_own"):
        said.append(_("left out: %(what)s") % {"what": left_out("own")})
    return "; ".join(said) or _("all")


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
