"""Acts of pages: asking before them, telling what came of them, sending them to a worker."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from typing import Any

from django.contrib import messages
from django.core.exceptions import NON_FIELD_ERRORS
from django.forms import BaseForm
from django.http import HttpRequest, HttpResponse
from django.shortcuts import render
from django.utils.text import capfirst, slugify

from arena.shell.sending import Row, send_on_commit
from augment.errors import AugmentError, InvalidDocument
from augment.services.running import workforce

SURE = "sure"
"""What the page's own button sends; without it nothing is done."""

CHANGE = "change"
"""What the other button sends, where there is a form to go back to."""

TYPED, WHY = "typed", "why"
"""What the question's own fields send: a name as it was typed, and a reason."""


class _Refusals(AbstractContextManager[None, bool]):
    def __init__(self, tell: Callable[[AugmentError], object]) -> None:
        self._tell = tell

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> bool:
        if isinstance(error, AugmentError):
            self._tell(error)
        return isinstance(error, AugmentError)


def refusals_told(request: HttpRequest) -> AbstractContextManager[None, bool]:
    """Show what a service refuses as a message on the next page."""
    return _Refusals(lambda error: messages.error(request, str(error)))


def refusals_in(form: BaseForm, field: str | None = None) -> AbstractContextManager[None, bool]:
    """Show what a service refuses as errors of the form, at the fields that they are about."""

    def tell(error: AugmentError) -> None:
        problems = error.problems if isinstance(error, InvalidDocument) else []
        if not any(name in form.fields for name, _text in problems):
            form.add_error(field, str(error))
            return
        for name, text in problems:
            form.add_error(name if name in form.fields else field, capfirst(text))

    return _Refusals(tell)


def tell_errors(request: HttpRequest, form: BaseForm) -> None:
    """Show the errors of a form that is on another page as messages, each with its field."""
    for name, problems in form.errors.items():
        label = "" if name == NON_FIELD_ERRORS else f"{form[name].label}: "
        messages.error(request, label + " ".join(map(str, problems)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Confirmation:
    """A question before an act.

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
    crumbs: tuple[tuple[str, str], ...] = ()


def is_sure(request: HttpRequest) -> bool:
    """Return whether the question was answered with yes."""
    return request.method == "POST" and SURE in request.POST


def is_typed(request: HttpRequest, name: str) -> bool:
    """Return whether the answer is yes and the name was typed, as it stands or as a slug."""
    typed = " ".join(request.POST.get(TYPED, "").split()).casefold()
    return is_sure(request) and typed in {" ".join(name.split()).casefold(), slugify(name)} - {""}


def wants_to_change(request: HttpRequest) -> bool:
    """Return whether somebody went back to the form, which is shown as it was filled in."""
    return CHANGE in request.POST


def ask(request: HttpRequest, question: Confirmation) -> HttpResponse:
    """Return the page that asks; it sends along what came in by a form."""
    ours = {"csrfmiddlewaretoken", SURE, CHANGE, TYPED, WHY}
    sent = request.POST.lists()
    is_mistyped = bool(question.phrase) and is_sure(request)
    context = {
        "question": question,
        "given": [(name, value) for name, values in sent if name not in ours for value in values],
        "sure": SURE,
        "change": CHANGE,
        "typed": request.POST.get(TYPED, ""),
        "why": request.POST.get(WHY, ""),
        "is_mistyped": is_mistyped,
    }
    return render(request, "ask.html", context, status=422 if is_mistyped else 200)


def send_later(request: HttpRequest, row: Row, send: Callable[[], object] | None = None) -> None:
    """Send workers what a row needs on commit; a fault of the queue becomes a message."""
    send_on_commit(row, partial(messages.warning, request), send)


def wait_for_workers(*, waits: bool) -> dict[str, Any]:
    """Return the context of a page that shows itself anew for as long as it waits."""
    return {"is_live": waits, "workforce": workforce() if waits else None}


def looks_again(request: HttpRequest) -> bool:
    """Return whether it is a page that waits, not a person, who asks (`static/js/live.js`)."""
    return "X-Looks-Again" in request.headers
