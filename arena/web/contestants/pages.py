"""Pages of contestants: who they are, how they ask, and who is retired."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.db.models import Count
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.views.decorators.http import require_POST, require_safe

from arena.contestants.queries import asking_of
from arena.scenarios.queries import by_type
from arena.site.access import ADMIN, STAFF, allow_only
from arena.site.listing import read_listing, read_page, said_choices
from arena.site.queries import Narrowing, find_contestants
from augment.errors import AugmentError
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.endpoints.treatments import respondents_of
from augment.services.events import retire, take_back

CONTESTANTS_AT_ONCE = 50


@allow_only(*STAFF)
@require_safe
def contestants_page(request: HttpRequest) -> HttpResponse:
    """Contestants page by page, those who are retired at the end."""
    kinds = [one for one in Contestant.Kind.choices if one[0] != Contestant.Kind.CHECK]
    choices = {
        "kind": ("Kind", said_choices(kinds)),
        "offered": ("In forms", [("active", "offered"), ("retired", "retired")]),
    }
    listing = read_listing(request, choices)
    wanted = Narrowing(
        search=listing.search, kind=listing.chosen("kind"), part=listing.chosen("offered")
    )
    page = read_page(request, find_contestants(wanted), size=CONTESTANTS_AT_ONCE)
    made = Augmentation.objects.filter(contestant__in=list(page.object_list)).order_by()
    numbers = dict(made.values_list("contestant").annotate(number=Count("pk")))
    rows = [{"row": row, "made": numbers.get(row.pk, 0)} for row in page.object_list]
    context = {
        "active": [line for line in rows if line["row"].retired_at is None],
        "retired": [line for line in rows if line["row"].retired_at is not None],
        "page": page,
        "listing": listing,
    }
    return render(request, "contestants/list.html", context)


@allow_only(*STAFF)
@require_safe
def contestant_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """One contestant in full."""
    row = get_object_or_404(Contestant.objects.select_related("endpoint"), code=code)
    context: dict[str, object] = {
        "contestant": row,
        "jobs": GenerationJob.objects.filter(contestants=row),
        "studies": row.studies.all(),
        "groups": by_type() if row.endpoint else [],
    }
    try:
        context |= {"asking": asking_of(row), "respondents": respondents_of(row)}
    except AugmentError as error:  # a role's endpoint is gone, or the variant
        messages.warning(request, str(error))
    return render(request, "contestants/contestant.html", context)


@allow_only(ADMIN)
@require_POST
def set_retired(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Retire it, or take that back."""
    row = get_object_or_404(Contestant, code=code)
    actor = cast(User, request.user)
    if request.POST.get("retired") == "no":
        take_back(row, actor=actor)
        messages.success(request, f"“{row.name}” is offered again.")
    else:
        retire(row, actor=actor)
        messages.success(request, f"“{row.name}” is retired. What it made stays.")
    return redirect("contestant", code=code)
