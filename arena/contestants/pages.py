"""Pages of contestants, and of the endpoints and models that they ask."""

import uuid
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from datetime import date
from decimal import Decimal
from typing import Any, cast

from django import forms
from django.contrib import messages
from django.core.exceptions import PermissionDenied
from django.db import transaction
from django.db.models import Count, Q
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.utils.text import capfirst
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.contestants.queries import asking_of, probe_lines
from arena.people.queries import role_of
from arena.scenarios.queries import by_type
from arena.site.access import ADMIN, STAFF, allow_only, user_of
from arena.site.acts import refusals_in, refusals_told, send_later
from arena.site.listing import read_listing, read_page
from augment.errors import AugmentError, InvalidDocument
from augment.models import Augmentation, Contestant, Endpoint, EndpointModel, GenerationJob, Probe
from augment.services.endpoints import known_endpoints
from augment.services.endpoints.contestants import (
    PROTOCOLS,
    REASONING_EFFORTS,
    VARIANTS,
    EnteredEndpoint,
    enter_contestant,
)
from augment.services.endpoints.known_endpoints import (
    FACTS,
    EndpointFacts,
    ModelFacts,
    is_key_here,
    list_key_variables,
)
from augment.services.endpoints.probing import plan_probe
from augment.services.endpoints.treatments import respondents_of
from augment.services.events import retire, take_back
from augment.services.running.workers import workforce
from augment.tasks import enqueue_probe

PAGE = ["GET", "HEAD", "POST"]
CONTESTANTS_AT_ONCE = 50
NEW = ""
"""The choice of an endpoint that stands for a new one."""

SLUG_RULE = "Lower-case letters, digits, hyphens."
KEY_LABEL = "Environment variable of the workers that holds its key"
STAND_IN_LABEL = "A stand-in: what it answers counts as simulated"


class OptionsForm(forms.Form):
    """How a contestant asks its model; what is empty stays open."""

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

    @property
    def option_fields(self) -> list[forms.BoundField]:
        """For the template."""
        return [self[name] for name in OptionsForm.base_fields]

    @property
    def has_options(self) -> bool:
        """For the template: whether any is filled in, so that one sees which."""
        return any(field.value() not in (None, "") for field in self.option_fields)

    def options(self) -> dict[str, object]:
        """Return those that are filled in and valid."""
        given = {name: self.cleaned_data.get(name) for name in OptionsForm.base_fields}
        return {name: value for name, value in given.items() if value not in (None, "")}


class ContestantForm(OptionsForm):
    """A model, a variant, and how it asks."""

    slug = forms.SlugField(max_length=80, label="Slug", help_text=SLUG_RULE)
    name = forms.CharField(
        max_length=120, required=False, label="Name (made of model and variant)"
    )
    variant = forms.ChoiceField(choices=[(name, name) for name in VARIANTS], label="Variant")
    model = forms.CharField(max_length=120, label="Model id on the endpoint")
    endpoint = forms.ChoiceField(required=False, label="Endpoint")
    label = forms.SlugField(max_length=80, required=False, label="Label of the new endpoint")
    base_url = forms.CharField(max_length=200, required=False, label="Its address, up to /v1")
    key_variable = forms.CharField(max_length=80, required=False, label=KEY_LABEL)
    is_simulated = forms.BooleanField(required=False, label=STAND_IN_LABEL)

    def __init__(self, data: Any = None, *, initial: dict[str, str] | None = None) -> None:
        super().__init__(data, initial=initial)
        field = cast(forms.ChoiceField, self.fields["endpoint"])
        known = Endpoint.objects.values_list("label", flat=True)
        field.choices = [(NEW, "A new one"), *((label, label) for label in known)]

    def clean(self) -> dict[str, Any]:
        """Require a known endpoint, or a new one with its address."""
        given = super().clean() or {}
        if not given.get("endpoint") and not (given.get("label") and given.get("base_url")):
            raise forms.ValidationError("Choose an endpoint, or give label and address.")
        return given

    def entered_endpoint(self) -> EnteredEndpoint:
        """Return where the model is, once the form is valid."""
        if known := self.cleaned_data["endpoint"]:
            return EnteredEndpoint(label=known)
        names = ("label", "base_url", "key_variable", "is_simulated")
        return EnteredEndpoint(**{name: self.cleaned_data[name] for name in names})


class EndpointForm(forms.Form):
    """An address, the variable with its key, and its limits; of a row, label and kind stay."""

    label = forms.SlugField(max_length=80, label="Label", help_text=SLUG_RULE)
    base_url = forms.CharField(max_length=200, label="Address, up to /v1")
    key_variable = forms.CharField(max_length=80, required=False, label=KEY_LABEL)
    max_concurrency = forms.IntegerField(initial=4, label="Calls at once, over all workers")
    requests_per_minute = forms.IntegerField(
        required=False, label="Calls a minute, at most (empty: no limit)"
    )
    is_simulated = forms.BooleanField(required=False, label=STAND_IN_LABEL)
    move_key = forms.BooleanField(
        required=False, label="Its key may go to another server than so far"
    )

    def __init__(self, data: Any = None, *, row: Endpoint | None = None) -> None:
        names = EndpointFacts.__dataclass_fields__
        initial = {} if row is None else {name: getattr(row, name) for name in names}
        super().__init__(data, initial=initial)
        for name in ("move_key",) if row is None else ("label", "is_simulated"):
            del self.fields[name]

    def facts(self) -> EndpointFacts:
        """Return what was entered, once the form is valid."""
        names = EndpointFacts.__dataclass_fields__
        return EndpointFacts(**{name: self.cleaned_data[name] for name in names})


def _ability(label: str) -> forms.TypedChoiceField:
    return forms.TypedChoiceField(
        required=False,
        label=label,
        choices=[("", "unknown"), ("yes", "yes"), ("no", "no")],
        coerce=lambda word: word == "yes",
        empty_value=None,
    )


class ModelForm(forms.Form):
    """What somebody knows of a model; what is left empty is unknown."""

    model_class = forms.ChoiceField(
        required=False,
        label="Class",
        choices=[
            ("", "–"),
            (EndpointModel.ModelClass.FRONTIER.value, "Frontier"),
            (EndpointModel.ModelClass.UTILITY.value, "Utility"),
            (EndpointModel.ModelClass.OPEN_WEIGHT.value, "Open weight"),
        ],
    )
    price_in_usd = forms.DecimalField(
        required=False, max_digits=12, decimal_places=6, label="USD per million tokens in"
    )
    price_out_usd = forms.DecimalField(
        required=False, max_digits=12, decimal_places=6, label="USD per million tokens out"
    )
    price_as_of = forms.DateField(required=False, label="Price as of (YYYY-MM-DD)")
    price_source = forms.CharField(required=False, max_length=200, label="Source of the price")
    context_tokens = forms.IntegerField(required=False, label="Tokens of context")
    max_output_tokens = forms.IntegerField(required=False, label="Tokens of one answer, at most")
    reasoning_effort = forms.ChoiceField(
        required=False,
        choices=[("", "not sent"), *((word, word) for word in REASONING_EFFORTS)],
        label="Reasoning effort",
    )
    vision = _ability("Sees pictures")
    native_tools = _ability("Calls functions natively")
    json_schema = _ability("Keeps to a JSON schema")
    temperature = _ability("Temperature may be chosen")

    def __init__(self, data: Any = None, *, row: EndpointModel) -> None:
        super().__init__(data, initial={name: _shown(getattr(row, name)) for name in FACTS})

    def facts(self) -> ModelFacts:
        """Return what was entered, once the form is valid."""
        return ModelFacts(**self.cleaned_data)


def _shown(value: Any) -> Any:
    """Return a stored fact as its field shows it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Decimal):
        return f"{value.normalize():f}"
    return value.isoformat() if isinstance(value, date) else value


@contextmanager
def _placed(form: forms.Form) -> Iterator[None]:
    try:
        yield
    except InvalidDocument as error:
        for path, text in error.problems:
            form.add_error(path if path in form.fields else None, capfirst(text))


def _problems_in(form: forms.Form) -> AbstractContextManager[None, bool]:
    """Put each problem of a document at its field; above those that have none."""
    return cast(AbstractContextManager[None, bool], _placed(form))


# --- Contestants -------------------------------------------------------------------------------


@allow_only(*STAFF)
@require_safe
def contestants_page(request: HttpRequest) -> HttpResponse:
    """List contestants page by page, those who are retired at the end."""
    kinds = [one for one in Contestant.Kind.choices if one[0] != Contestant.Kind.CHECK]
    choices = {
        "kind": ("Kind", kinds),
        "offered": ("In forms", [("active", "offered"), ("retired", "retired")]),
    }
    listing = read_listing(request, choices)
    found = Contestant.objects.exclude(kind=Contestant.Kind.CHECK).select_related("endpoint")
    found = listing.narrow(
        found, "name", "slug", "variant", "model", "endpoint__label", by=["kind"]
    )
    if offered := listing.chosen("offered"):
        found = found.filter(retired_at__isnull=offered == "active")
    found = found.alias(is_retired=Q(retired_at__isnull=False))
    found = found.order_by("is_retired", "name", "pk")
    page = read_page(request, found, size=CONTESTANTS_AT_ONCE)
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
    """Show one contestant in full."""
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
@require_http_methods(PAGE)
def new_contestant_page(request: HttpRequest) -> HttpResponse:
    """Show the form, filled in as it was where something can't be taken."""
    asked = {name: request.GET.get(name, "") for name in ("endpoint", "model")}
    form = ContestantForm(request.POST if request.method == "POST" else None, initial=asked)
    if form.is_bound and form.is_valid():
        names = ("slug", "name", "variant", "model")
        with refusals_in(form):
            row = enter_contestant(
                **{name: form.cleaned_data[name] for name in names},
                endpoint=form.entered_endpoint(),
                options=form.options(),
                actor=user_of(request),
            )
            messages.success(request, f"“{row.name}” is added.")
            return redirect("contestant", code=row.code)
    context = {
        "form": form,
        "who": [form[name] for name in ("slug", "name", "variant", "model")],
        "where": [form[name] for name in ("endpoint", "label", "base_url", "key_variable")],
    }
    return render(request, "contestants/new.html", context)


@allow_only(ADMIN)
@require_POST
def set_retired(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Retire a contestant, or take that back."""
    row = get_object_or_404(Contestant, code=code)
    if request.POST.get("retired") == "no":
        take_back(row, actor=user_of(request))
        messages.success(request, f"“{row.name}” is offered again.")
    else:
        retire(row, actor=user_of(request))
        messages.success(request, f"“{row.name}” is retired. What it made stays.")
    return redirect("contestant", code=code)


# --- Endpoints and models ----------------------------------------------------------------------


@allow_only(*STAFF)
@require_safe
def endpoints_page(request: HttpRequest) -> HttpResponse:
    """List every endpoint with its limits, and whether its key is here."""
    rows = Endpoint.objects.annotate(known=Count("models")).order_by("label")
    lines = [{"row": row, "has_key": _has_key(row)} for row in rows]
    return render(request, "endpoints/list.html", {"lines": lines})


def _has_key(row: Endpoint) -> bool:
    return not row.key_variable or is_key_here(row.key_variable)


@allow_only(ADMIN)
@require_http_methods(PAGE)
def new_endpoint_page(request: HttpRequest) -> HttpResponse:
    """Add an endpoint."""
    form = EndpointForm(request.POST if request.method == "POST" else None)
    if form.is_bound and form.is_valid():
        with refusals_in(form), _problems_in(form):
            row = known_endpoints.add_endpoint(
                label=form.cleaned_data["label"],
                facts=form.facts(),
                is_simulated=form.cleaned_data["is_simulated"],
                actor=user_of(request),
            )
            messages.success(request, f"“{row.label}” is added. Name its models now.")
            return redirect("endpoint", code=row.code)
    context = {"form": form, "variables": list_key_variables()}
    return render(request, "endpoints/new.html", context, status=422 if form.errors else 200)


@allow_only(*STAFF)
@require_http_methods(PAGE)
def endpoint_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show one endpoint with its models; admins change it here."""
    row = get_object_or_404(Endpoint, code=code)
    form = EndpointForm(_posted_by_admin(request), row=row)
    if form.is_bound and form.is_valid():
        with refusals_in(form), _problems_in(form):
            known_endpoints.change_endpoint(
                row,
                facts=form.facts(),
                may_move_key=form.cleaned_data["move_key"],
                actor=user_of(request),
            )
            messages.success(request, "Kept. It counts for the next call.")
            return redirect("endpoint", code=row.code)
    context = {
        "row": row,
        "form": form,
        "models": row.models.all(),
        "contestants": row.contestants.filter(retired_at=None).order_by("name"),
        "has_key": _has_key(row),
        "variables": list_key_variables(),
    }
    return render(request, "endpoints/endpoint.html", context, status=422 if form.errors else 200)


def _posted_by_admin(request: HttpRequest) -> Any:
    """Return what was posted, if anything; analysts may look and not change."""
    if request.method != "POST":
        return None
    if role_of(request.user) != ADMIN:
        raise PermissionDenied
    return request.POST


@allow_only(ADMIN)
@require_POST
def add_model(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Note a model of an endpoint; its listed price comes with it."""
    endpoint = get_object_or_404(Endpoint, code=code)
    with refusals_told(request):
        row = known_endpoints.add_model(
            endpoint, model=request.POST.get("model", ""), actor=user_of(request)
        )
        return redirect("endpoint-model", code=row.code)
    return redirect("endpoint", code=code)


@allow_only(*STAFF)
@require_http_methods(PAGE)
def model_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show what is known of a model, and its last probe, line by line while it is made."""
    row = get_object_or_404(EndpointModel.objects.select_related("endpoint"), code=code)
    form = ModelForm(_posted_by_admin(request), row=row)
    if form.is_bound and form.is_valid():
        with refusals_in(form), _problems_in(form):
            known_endpoints.change_model(row, facts=form.facts(), actor=user_of(request))
            messages.success(request, "Kept. It counts for contestants that have not run yet.")
            return redirect("endpoint-model", code=code)
    probe = row.probes.first()
    is_live = probe is not None and probe.state in Probe.UNDER_WAY
    context = {
        "row": row,
        "form": form,
        "probe": probe,
        "is_live": is_live,
        "lines": probe_lines(row, probe),
        "workforce": workforce() if is_live else None,
    }
    return render(request, "endpoints/model.html", context, status=422 if form.errors else 200)


@allow_only(ADMIN)
@require_POST
def probe_model(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Have a worker ask the model what it can do."""
    row = get_object_or_404(EndpointModel.objects.select_related("endpoint"), code=code)
    with refusals_told(request), transaction.atomic():
        probe = plan_probe(row, actor=user_of(request))
        send_later(request, enqueue_probe, probe.pk)
    return redirect("endpoint-model", code=code)
