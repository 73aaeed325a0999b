"""Numbers of the results that lead to what is behind them."""

from __future__ import annotations

from typing import Any
from urllib.parse import urlencode

from django import template
from django.template import Context
from django.urls import reverse
from django.utils.html import format_html
from django.utils.safestring import SafeString

from arena.results.queries.search import VoteSearch

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
        votes_url(context, **search), number, said,
    )  # fmt: skip
