"""Lists in pages: a word to look for, filters, and which page the address asks for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from django.core.paginator import Page, Paginator
from django.db.models import Model, Q, QuerySet
from django.http import HttpRequest

LONGEST_SEARCH = 80

Row = TypeVar("Row", bound=Model)


def page_asked(request: HttpRequest, name: str = "page") -> int:
    """Return the number of a page, 1 where the address names none that there can be."""
    text = request.GET.get(name, "1")
    return int(text) if text.isascii() and text.isdigit() and len(text) < 9 and int(text) else 1


def choice_asked(request: HttpRequest, name: str, allowed: list[str]) -> str:
    """Return the chosen value of a filter; empty for an unknown one."""
    value = request.GET.get(name, "")
    return value if value in allowed else ""


def read_page(request: HttpRequest, rows: QuerySet[Row], *, size: int) -> Page[Row]:
    """Return the page of rows that the address asks for; beyond the last one it is the last."""
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
        """Return whether the list may leave something out."""
        return bool(self.search or any(choice.chosen for choice in self.choices))

    def find_choice(self, name: str) -> str:
        """Return the value of a filter."""
        return next((choice.chosen for choice in self.choices if choice.name == name), "")

    def narrow(self, rows: QuerySet[Row], *columns: str, by: Sequence[str]) -> QuerySet[Row]:
        """Return the rows that the form asks for.

        Args:
            rows: Of the list.
            columns: Where the word is looked for, whatever its case.
            by: Filters that are columns of the rows.
        """
        matches = Q()
        for column in columns:
            matches |= Q(**{f"{column}__icontains": self.search})
        chosen = {name: self.find_choice(name) for name in by if self.find_choice(name)}
        return rows.filter(matches if self.search else Q(), **chosen)


def read_listing(
    request: HttpRequest,
    choices: Mapping[str, tuple[str, Sequence[tuple[str, object]]]],
    *,
    keep: Sequence[str] = (),
) -> Listing:
    """Return the list's page, search and filters from the address.

    Args:
        request: With the address.
        choices: By name each filter's label, and its values with their labels.
        keep: Names whose values stay in the address when the form is sent.
    """
    return Listing(
        search=request.GET.get("q", "").strip()[:LONGEST_SEARCH],
        choices=tuple(
            ListChoice(
                name=name,
                label=label,
                options=tuple((str(value), str(text)) for value, text in options),
                chosen=choice_asked(request, name, [str(value) for value, _text in options]),
            )
            for name, (label, options) in choices.items()
        ),
        kept=tuple((name, request.GET[name]) for name in keep if request.GET.get(name)),
    )
