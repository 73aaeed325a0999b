"""What the address of a list asks for: a page, a word to look for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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


def said_choices(choices: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """The choices of a column with their words in the language of whoever reads them."""
    return [(str(value), str(label)) for value, label in choices]


def read_page(request: HttpRequest, rows: QuerySet[Row], *, size: int) -> Page[Row]:
    """The page of rows that the address asks for; beyond the last one it is the last one."""
    return Paginator(rows, size).get_page(page_asked(request))


@dataclass(frozen=True, slots=True, kw_only=True)
class ListChoice:
    """A filter: what the address calls it, what there is to choose, what is chosen."""

    name: str
    label: str
    options: tuple[tuple[str, str], ...]
    chosen: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Listing:
    """The form above a list.

    Attributes:
        kept: What else the address says and goes on to say.
    """

    search: str
    choices: tuple[ListChoice, ...]
    kept: tuple[tuple[str, str], ...] = ()

    @property
    def is_narrowed(self) -> bool:
        """Whether the list may leave something out."""
        return bool(self.search or any(choice.chosen for choice in self.choices))

    def chosen(self, name: str) -> str:
        """What a filter is set to."""
        return next((choice.chosen for choice in self.choices if choice.name == name), "")


def read_listing(
    request: HttpRequest,
    choices: Mapping[str, tuple[str, Sequence[tuple[str, str]]]],
    *,
    keep: Sequence[str] = (),
) -> Listing:
    """What the address asks a list for.

    Args:
        request: With the address.
        choices: By name each filter's label, and its values with their labels.
        keep: Names whose values stay in the address when the form is sent.
    """
    return Listing(
        search=search_asked(request),
        choices=tuple(
            ListChoice(
                name=name,
                label=label,
                options=tuple((value, str(said)) for value, said in options),
                chosen=choice_asked(request, name, [value for value, _said in options]),
            )
            for name, (label, options) in choices.items()
        ),
        kept=tuple((name, request.GET[name]) for name in keep if request.GET.get(name)),
    )
