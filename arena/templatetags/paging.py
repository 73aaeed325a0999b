"""Links from one page of a list to the next, with everything else that its address says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from django import template
from django.core.paginator import Page
from django.http import HttpRequest
from django.template.context import Context

register = template.Library()


@dataclass(frozen=True, slots=True, kw_only=True)
class PageLink:
    """A page to go to; without a number a gap between two."""

    number: int | None
    query: str = ""
    is_current: bool = False


@register.inclusion_tag("parts/pager.html", takes_context=True)
def pager(context: Context, page: Page[Any], name: str = "page", what: str = "") -> dict[str, Any]:
    """The way to the other pages; nothing where there is one alone.

    Args:
        context: With the request, whose address is kept but for the page.
        page: Which one is shown.
        name: What the address calls it.
        what: What is paged, for those who can't see where the links stand.
    """
    here, last = page.number, page.paginator.num_pages
    near = {1, last, *range(max(1, here - 1), min(last, here + 1) + 1)}
    links: list[PageLink] = []
    for number in sorted(near):
        previous = links[-1].number if links else None
        if previous is not None and number > previous + 1:
            links.append(PageLink(number=None))
        query = _query(context["request"], name, number)
        links.append(PageLink(number=number, query=query, is_current=number == here))
    return {
        "links": links if last > 1 else [],
        "what": what,
        "page": page,
        "previous": _query(context["request"], name, here - 1) if page.has_previous() else "",
        "next": _query(context["request"], name, here + 1) if page.has_next() else "",
    }


@register.simple_tag(takes_context=True)
def query_with(context: Context, **changes: object) -> str:
    """The address's query with these changes, from the first page on; empty values go."""
    query = context["request"].GET.copy()
    for name in ("page", "row", "column", "sample"):
        query.pop(name, None)
    for name, value in changes.items():
        query.pop(name, None)
        if value not in ("", None):
            query[name] = str(value)
    return f"?{query.urlencode()}"


# --- Private -----------------------------------------------------------------------------------


def _query(request: HttpRequest, name: str, number: int) -> str:
    query = request.GET.copy()
    query[name] = str(number)
    return f"?{query.urlencode()}"
