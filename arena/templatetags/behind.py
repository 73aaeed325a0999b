"""Links from numbers to the votes behind them, and what an act of the log changed."""

from collections.abc import Mapping
from typing import Any
from urllib.parse import urlencode

from django import template
from django.template import Context
from django.urls import reverse
from django.utils.html import format_html
from django.utils.safestring import SafeString

from arena.rating.lines import join_counts
from arena.results.queries.search import VoteSearch
from augment.models import Event

register = template.Library()


@register.simple_tag(takes_context=True)
def votes_url(context: Context, **search: Any) -> str:
    """The address of the votes of the shown rating that are looked for so."""
    values = {name: str(value) for name, value in search.items() if value}
    query = {"rating": str(context["snapshot"].code), **VoteSearch(**values).as_query()}
    return f"{reverse('results-votes', args=[context['study'].code])}?{urlencode(query)}"


@register.simple_tag(takes_context=True)
def behind(
    context: Context, number: int | None, text: object = None, settled: Any = None, **search: Any
) -> SafeString | str:
    """A number, or what stands for it, as a link to so many votes; plain where there are none.

    Args:
        context: With the study, the rating and whether whoever asks may see single votes.
        number: Of votes.
        text: What is written instead.
        settled: How many of them are ties that nobody was shown, written after a plus.
        search: Of `VoteSearch`.
    """
    shown = join_counts(number, settled) if text is None else text
    if not number or not context.get("has_evidence"):
        return str(shown)
    return format_html(
        '<a class="behind" href="{}" data-votes="{}">{}</a>',
        votes_url(context, **search),
        number,
        shown,
    )


@register.simple_tag
def details_of(event: Event, names: Mapping[str, str] | None = None) -> str:
    """Return an event's changes, with old and new values.

    Args:
        event: Of the log.
        names: Pseudonyms by code and by account, names of contestants by slug.
    """
    before, after = event.before or {}, event.after or {}
    parts = []
    for key in {**before, **after}:
        values = [_plain(part.get(key), names or {}) for part in (before, after)]
        text = " → ".join(value for value in dict.fromkeys(values) if value)
        parts += [f"{key.replace('_', ' ')}: {text}"] if text else []
    return "; ".join(parts) or "–"


def _plain(value: Any, names: Mapping[str, str]) -> str:
    """Return a value as text, with names instead of codes."""
    match value:
        case None | "":
            return ""
        case bool():
            return "yes" if value else "no"
        case Mapping():
            parts = {
                names.get(k) or k.replace("_", " "): _plain(v, names) for k, v in value.items()
            }
            return ", ".join(f"{key}: {text}" for key, text in parts.items() if text)
        case list() | tuple():
            return ", ".join(_plain(item, names) for item in value)
    return names.get(str(value), str(value))
