"""What is behind the results: links from numbers to votes, and the log of a study in words."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlencode

from django import template
from django.template import Context
from django.urls import reverse
from django.utils.html import format_html
from django.utils.safestring import SafeString

from arena.results.queries.search import VoteSearch
from arena.templatetags.results import label_of
from augment.models import Event
from augment.services.scenarios.scenes import type_label

register = template.Library()


@register.simple_tag(takes_context=True)
def votes_url(context: Context, **search: Any) -> str:
    """The address of the votes of the shown rating that are looked for so."""
    given = {name: str(value) for name, value in search.items() if value}
    query = {"rating": str(context["snapshot"].code), **VoteSearch(**given).as_query()}
    return f"{reverse('results-votes', args=[context['study'].code])}?{urlencode(query)}"


@register.simple_tag(takes_context=True)
def behind(
    context: Context, number: int | None, text: object = None, **search: Any
) -> SafeString | str:
    """A number, or what stands for it, as a link to so many votes; plain where there are none.

    Who may not see single votes gets no link.

    Args:
        context: With the study, the rating and whether staff asks.
        number: Of votes.
        text: What is written instead.
        search: Of `VoteSearch`.
    """
    said = number if text is None else text
    if not number or not context.get("is_staff"):
        return str(said)
    return format_html(
        '<a class="behind" href="{}" data-votes="{}">{}</a>',
        votes_url(context, **search),
        number,
        said,
    )


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
    before, after = event.before or {}, event.after or {}
    details = []
    for key, value in after.items():
        text = _text(key, value, names)
        if key in before and before[key] != value:
            text = f"{_text(key, before[key], names)}, then {text}"
        rating = str(value) if key == "snapshot" else ""
        details.append(Detail(label=LABELS.get(key, key), text=text, rating=rating))
    for key in before.keys() - after.keys():
        text = _text(key, before[key], names)
        details.append(Detail(label=f"before: {LABELS.get(key, key)}", text=text))
    return [detail for detail in details if detail.text]


LABELS = {
    "ends_voting": "votes no longer in this study",
    "filters": "which votes",
    "matchups": "pairs",
    "sha256": "SHA-256",
    "snapshot": "rating",
    "what": "seen",
}
"""What parts of an event are called, where it is not by their key."""


def _text(key: str, value: Any, names: Mapping[str, str]) -> str:
    """Return a part of an event as a person reads it, empty where it says nothing."""
    match key:
        case "ends_voting":
            return "yes" if value else ""
        case "filters" if isinstance(value, Mapping):
            return _filters(value)
        case "matchups" if isinstance(value, list):  # older lines name each
            return str(len(value))
        case "method":
            return label_of("method_label", value)
        case "snapshot":
            return str(value)[:8]
        case "sha256":
            return f"{str(value)[:12]}…"
        case "what" if value == "results":
            return "the results"
        case _:
            return _plain(value, names)


def _plain(value: Any, names: Mapping[str, str]) -> str:
    """Return yes and no in words, names instead of codes, parts one after the other."""
    if value is None or value == "":
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        parts = ((names.get(str(k), str(k)), _plain(v, names)) for k, v in value.items())
        return ", ".join(f"{key}: {text}" for key, text in parts if text)
    if isinstance(value, list | tuple):
        return ", ".join(_plain(item, names) for item in value)
    return names.get(str(value), str(value))


def _filters(value: Mapping[str, Any]) -> str:
    """Return which votes a rating asked for; "all" where it asked for all main ones."""
    texts = []
    if types := value.get("types"):
        texts.append(", ".join(type_label(name) for name in types))
    if experts := value.get("experts"):
        n = experts if isinstance(experts, int) else len(experts)
        texts.append("1 expert" if n == 1 else f"{n} experts")
    if "repeat" in value.get("kinds", ()):
        texts.append("hidden repeats count")
    if value.get("leave_out_settled"):
        texts.append("pairs that nobody can tell apart are left out")
    if value.get("leave_out_own"):
        texts.append(f"left out: {label_of('left_out', 'own')}")
    return "; ".join(texts) or "all"
