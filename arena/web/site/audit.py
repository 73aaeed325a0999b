"""Every administrative act: who did what to which, and when."""

from __future__ import annotations

import json
from typing import Any

from django import forms
from django.http import Http404, HttpRequest, HttpResponse, StreamingHttpResponse
from django.shortcuts import render
from django.views.decorators.http import require_safe

from arena.exports.audit import AUDIT_FORMATS
from arena.exports.formats import format_named
from arena.queries.audit import MACHINE, AuditFilters, actors, acts, object_kinds, verbs
from arena.web.access import ADMIN, allow_only
from arena.web.listing import choice_asked, read_page
from augment.errors import UnknownName
from augment.models import Event

ON_A_PAGE = 50


class DaysForm(forms.Form):
    """From when to when; what is no day filters nothing and is said."""

    since = forms.DateField(required=False)
    until = forms.DateField(required=False)


@allow_only(ADMIN)
@require_safe
def audit_page(request: HttpRequest) -> HttpResponse:
    """A page of acts, the newest first."""
    people, filters, days = _asked(request)
    page = read_page(request, acts(filters), size=ON_A_PAGE)
    context: dict[str, Any] = {
        "page": page,
        "lines": [(event, _details(event)) for event in page],
        "filters": filters,
        "days": days,
        "actors": people,
        "machine": MACHINE,
        "verbs": verbs(),
        "kinds": object_kinds(),
        "query": request.GET.urlencode(),
    }
    return render(request, "audit.html", context, status=422 if days.errors else 200)


@allow_only(ADMIN)
@require_safe
def audit_file(request: HttpRequest, form: str) -> StreamingHttpResponse:
    """All acts that the page's filters name, as a file that is sent while it is read."""
    try:
        chosen = format_named(AUDIT_FORMATS, form)
    except UnknownName as error:
        raise Http404 from error
    _, filters, days = _asked(request)
    if days.errors:
        raise Http404
    return StreamingHttpResponse(
        chosen.parts(acts(filters).iterator()),
        content_type=chosen.content_type,
        headers={"Content-Disposition": f'attachment; filename="audit.{chosen.suffix}"'},
    )


def _details(event: Event) -> str:
    """What changed: before, an arrow, after; empty where the log keeps nothing of it."""
    kept = [one for one in (event.before, event.after) if one]
    return " → ".join(json.dumps(one, ensure_ascii=False) for one in kept)


def _asked(request: HttpRequest) -> tuple[list[Any], AuditFilters, DaysForm]:
    people = actors()
    days = DaysForm(request.GET)
    days.is_valid()
    codes = [MACHINE, *(str(one.person.code) for one in people)]
    filters = AuditFilters(
        actor=choice_asked(request, "actor", codes),
        verb=choice_asked(request, "verb", verbs()),
        object_kind=choice_asked(request, "kind", object_kinds()),
        object_code=request.GET.get("object", "").replace("\0", "").strip()[:120],
        since=days.cleaned_data.get("since"),
        until=days.cleaned_data.get("until"),
    )
    return people, filters, days
