"""Asking once more before an act that has no way back, on a page of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import cast

from django.contrib import messages
from django.forms import BaseForm
from django.http import HttpRequest, HttpResponse
from django.shortcuts import render
from django.utils.text import slugify

from arena.errors import ArenaError
from augment.errors import AugmentError

SURE = "sure"
"""What the page's own button sends; without it nothing is done."""

CHANGE = "change"
"""What the other button sends, where there is a form to go back to."""

TYPED, WHY = "typed", "why"
"""What the question's own fields send: a name as it was typed, and a reason."""


REFUSALS = (ArenaError, AugmentError)
"""What a service raises; its text is for whoever asked."""


@contextmanager
def _told_by(tell: Callable[[str], object]) -> Iterator[None]:
    try:
        yield
    except REFUSALS as error:
        tell(str(error))


def refusals_told(request: HttpRequest) -> AbstractContextManager[None, bool]:
    """Show what a service refuses as a message on the next page."""
    return cast(AbstractContextManager[None, bool], _told_by(partial(messages.error, request)))


def refusals_in(form: BaseForm, field: str | None = None) -> AbstractContextManager[None, bool]:
    """Show what a service refuses as an error of the form."""
    return cast(AbstractContextManager[None, bool], _told_by(partial(form.add_error, field)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Confirmation:
    """What somebody is asked before it is done.

    Attributes:
        title: The question itself.
        facts: What will happen, with its numbers, a sentence each.
        button: What the act is called.
        back: Where "no" leads.
        is_final: Whether something ends by it, rather than begins.
        phrase: What has to be typed before it is done; empty where a second click will do.
        asks_why: Whether a reason may be given.
        crumbs: The way here: names and addresses.
    """

    title: str
    facts: tuple[str, ...]
    button: str
    back: str
    is_final: bool = True
    phrase: str = ""
    asks_why: bool = False
    crumbs: tuple[tuple[str, str], ...] = field(default=())


def is_sure(request: HttpRequest) -> bool:
    """Whether this is the answer "yes" of the page below."""
    return request.method == "POST" and SURE in request.POST


def is_typed(request: HttpRequest, name: str) -> bool:
    """Whether the answer is "yes" and the name was typed, as it stands or as a slug."""
    given = " ".join(request.POST.get(TYPED, "").split()).casefold()
    return is_sure(request) and given in {" ".join(name.split()).casefold(), slugify(name)} - {""}


def wants_to_change(request: HttpRequest) -> bool:
    """Whether somebody went back to the form, which is shown as it was filled in."""
    return CHANGE in request.POST


def ask(request: HttpRequest, question: Confirmation) -> HttpResponse:
    """The page that asks; it sends along what came in by a form, and works without a script."""
    ours = {"csrfmiddlewaretoken", SURE, CHANGE, TYPED, WHY}
    given = [
        (name, value)
        for name, values in request.POST.lists()
        if name not in ours
        for value in values
    ]
    is_mistyped = bool(question.phrase) and is_sure(request)
    context = {
        "question": question,
        "given": given,
        "sure": SURE,
        "change": CHANGE,
        "typed": request.POST.get(TYPED, ""),
        "why": request.POST.get(WHY, ""),
        "is_mistyped": is_mistyped,
    }
    return render(request, "ask.html", context, status=422 if is_mistyped else 200)
