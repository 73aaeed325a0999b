"""What the address of a list asks for: a page, a word to look for."""

from __future__ import annotations

from typing import TypeVar

from django.core.paginator import Page, Paginator
from django.db.models import Model, QuerySet
from django.http import HttpRequest

LONGEST_SEARCH = 80

Row = TypeVar("Row", bound=Model)


def page_asked(request: HttpRequest, name: str = "page") -> int:
    """The number of a page, 1 where the address says none that there can be."""
    said = request.GET.get(name, "1")
    return int(said) if said.isascii() and said.isdigit() and len(said) < 9 and int(said) else 1


def search_asked(request: HttpRequest) -> str:
    """What somebody looks for; empty for everything."""
    return request.GET.get("q", "").replace("\0", "").strip()[:LONGEST_SEARCH]


def choice_asked(request: HttpRequest, name: str, allowed: list[str]) -> str:
    """What a filter is set to; empty where it is not, or to what there is not."""
    said = request.GET.get(name, "")
    return said if said in allowed else ""


def read_page(request: HttpRequest, rows: QuerySet[Row], *, size: int) -> Page[Row]:
    """The page of rows that the address asks for; beyond the last one it is the last one."""
    return Paginator(rows, size).get_page(page_asked(request))
