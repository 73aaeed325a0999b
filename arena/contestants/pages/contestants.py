"""Pages of contestants: who they are, how they ask, and who is retired."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django import forms
from django.contrib import messages
from django.contrib.auth.models import User
from django.db.models import Count
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.contestants.pages.endpoints import SLUG_RULE
from arena.contestants.queries import asking_of
from arena.queries.listings import Narrowing, find_contestants
from arena.scenarios.queries import by_type
from arena.web.access import ADMIN, STAFF, allow_only
from arena.web.listing import read_listing, read_page, said_choices
from augment.errors import AugmentError
from augment.models import Augmentation, Contestant, Endpoint, GenerationJob
from augment.services.endpoints.contestants import (
    OPTION_NAMES,
    PROTOCOLS,
    REASONING_EFFORTS,
    VARIANTS,
    EnteredEndpoint,
    enter_contestant,
)
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


NEW = ""
"""What the choice of an endpoint says where a new one is entered."""


class ContestantForm(forms.Form):
    """A model, a variant, and how it asks; options that are left empty stay open."""

    slug = forms.SlugField(max_length=80, label="Slug", help_text=SLUG_RULE)
    name = forms.CharField(
        max_length=120, required=False, label="Name (made of model and variant)"
    )
    variant = forms.ChoiceField(choices=[(name, name) for name in VARIANTS], label="Variant")
    model = forms.CharField(max_length=120, label="Model id on the endpoint")
    endpoint = forms.ChoiceField(required=False, label="Endpoint")
    label = forms.SlugField(max_length=80, required=False, label="Label of the new endpoint")
    base_url = forms.CharField(max_length=200, required=False, label="Its address, up to /v1")
    key_variable = forms.CharField(
        max_length=80,
        required=False,
        label="Environment variable of the workers that holds its key",
    )
    is_simulated = forms.BooleanField(
        required=False, label="A stand-in: what it answers counts as simulated"
    )
    temperature = forms.FloatField(required=False, label="Temperature")
    seed = forms.IntegerField(required=False, label="Seed")
    reasoning_effort = forms.ChoiceField(
        required=False,
        choices=[("", "–"), *((word, word) for word in REASONING_EFFORTS)],
        label="Reasoning effort",
    )
    max_output_tokens = forms.IntegerField(required=False, label="Tokens of one answer, at most")
    protocol = forms.ChoiceField(
        required=False,
        choices=[("", "–"), *((word, word) for word in PROTOCOLS)],
        label="Tool protocol",
    )
    rounds = forms.IntegerField(required=False, label="Rounds, at most")

    def __init__(self, data: Any = None, *, initial: dict[str, str] | None = None) -> None:
        super().__init__(data, initial=initial)
        field = cast(forms.ChoiceField, self.fields["endpoint"])
        known = Endpoint.objects.values_list("label", flat=True)
        field.choices = [(NEW, "A new one"), *((label, label) for label in known)]

    def clean(self) -> dict[str, Any]:
        """A known endpoint, or a new one with its address."""
        found = super().clean() or {}
        if not found.get("endpoint") and not (found.get("label") and found.get("base_url")):
            raise forms.ValidationError("Choose an endpoint, or give label and address.")
        return found

    def entered_endpoint(self) -> EnteredEndpoint:
        """Where the model is, once the form is valid."""
        found = self.cleaned_data
        if found["endpoint"]:
            return EnteredEndpoint(label=found["endpoint"])
        return EnteredEndpoint(
            label=found["label"],
            base_url=found["base_url"],
            key_variable=found["key_variable"],
            is_simulated=found["is_simulated"],
        )

    def options(self) -> dict[str, object]:
        """Those that were filled in."""
        given = {name: self.cleaned_data.get(name) for name in OPTION_NAMES}
        return {name: value for name, value in given.items() if value not in (None, "")}


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def new_contestant_page(request: HttpRequest) -> HttpResponse:
    """The form, filled in as it was where something can't be taken."""
    asked = {name: request.GET.get(name, "") for name in ("endpoint", "model")}
    form = ContestantForm(request.POST if request.method == "POST" else None, initial=asked)
    if request.method == "POST" and form.is_valid():
        chosen = form.cleaned_data
        try:
            row = enter_contestant(
                slug=chosen["slug"],
                name=chosen["name"],
                variant=chosen["variant"],
                model=chosen["model"],
                endpoint=form.entered_endpoint(),
                options=form.options(),
                actor=cast(User, request.user),
            )
        except AugmentError as error:
            form.add_error(None, str(error))
        else:
            messages.success(request, f"“{row.name}” is added.")
            return redirect("contestant", code=row.code)
    of_options = [form[name] for name in OPTION_NAMES if name in form.fields]
    context = {
        "form": form,
        "who": [form[name] for name in ("slug", "name", "variant", "model")],
        "where": [form[name] for name in ("endpoint", "label", "base_url", "key_variable")],
        "of_options": of_options,
    }
    return render(request, "contestants/new.html", context)
