"""Asking once more before an act that has no way back, on a page of its own."""

from __future__ import annotations

from dataclasses import dataclass, field

from django.http import HttpRequest, HttpResponse
from django.shortcuts import render

SURE = "sure"
"""What the page's own button sends; without it nothing is done."""

CHANGE = "change"
"""What the other button sends, where there is a form to go back to."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Confirmation:
    """What somebody is asked before it is done.

    Attributes:
        title: The question itself.
        facts: What will happen, with its numbers, a sentence each.
        button: What the act is called.
        back: Where "no" leads.
        is_final: Whether something ends by it, rather than begins.
        crumbs: The way here: names and addresses.
    """

    title: str
    facts: tuple[str, ...]
    button: str
    back: str
    is_final: bool = True
    crumbs: tuple[tuple[str, str], ...] = field(default=())


def is_sure(request: HttpRequest) -> bool:
    """Whether this is the answer "yes" of the page below."""
    return request.method == "POST" and SURE in request.POST


def wants_to_change(request: HttpRequest) -> bool:
    """Whether somebody went back to the form, which is shown as it was filled in."""
    return CHANGE in request.POST


def ask(request: HttpRequest, question: Confirmation) -> HttpResponse:
    """The page that asks; it sends along what came in by a form, and works without a script."""
    ours = {"csrfmiddlewaretoken", SURE, CHANGE}
    given = [
        (name, value)
        for name, values in request.POST.lists()
        if name not in ours
        for value in values
    ]
    context = {"question": question, "given": given, "sure": SURE, "change": CHANGE}
    return render(request, "ask.html", context)
