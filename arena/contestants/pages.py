"""Pages of contestants, and of the endpoints and models that they ask."""

import uuid
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any, cast

from django import forms
from django.contrib import messages
from django.core.exceptions import PermissionDenied
from django.db import transaction
from django.db.models import Count, Q
from django.forms import model_to_dict
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.utils.text import capfirst
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.contestants.queries import asking_of, probe_lines
from arena.people.queries import role_of
from arena.scenarios.queries import by_type
from arena.site.access import ADMIN, STAFF, allow_only, user_of
from arena.site.acts import refusals_in, refusals_told, send_later
from arena.site.forms import RequestForm, offer
from arena.site.listing import read_listing, read_page
from augment.errors import AugmentError, InvalidDocument
from augment.models import Augmentation, Contestant, Endpoint, EndpointModel, GenerationJob, Probe
from augment.services.endpoints import known_endpoints
from augment.services.endpoints.contestants import OPTION_INPUTS, ContestantRequest, add_contestant
from augment.services.endpoints.known_endpoints import (
    MODEL_FACTS,
    EndpointFacts,
    EndpointRequest,
    is_key_here,
    list_key_variables,
)
from augment.services.endpoints.probing import plan_probe
from augment.services.endpoints.treatments import respondents_of
from augment.services.events import retire, take_back
from augment.services.inputs import inputs_of, read_request, read_values
from augment.services.running.workers import workforce
from augment.tasks import enqueue_probe

PAGE = ["GET", "HEAD", "POST"]
CONTESTANTS_AT_ONCE = 50


class OptionsForm(RequestForm):
    """How a contestant asks its model; what is empty stays open."""

    inputs = OPTION_INPUTS

    @property
    def option_fields(self) -> list[forms.BoundField]:
        """For the template."""
        return [self[one.name] for one in OPTION_INPUTS]

    @property
    def has_options(self) -> bool:
        """For the template: whether any is filled in, so that one sees which."""
        return any(field.value() not in (None, "") for field in self.option_fields)


class ContestantForm(OptionsForm):
    """A model, a variant, and how it asks."""

    inputs = inputs_of(ContestantRequest) + OPTION_INPUTS
    endpoint = forms.ChoiceField(label="Endpoint")

    def __init__(self, data: Any = None, *, initial: dict[str, str] | None = None) -> None:
        super().__init__(data, initial=initial)
        offer(
            self,
            "endpoint",
            [(label, label) for label in Endpoint.objects.values_list("label", flat=True)],
        )

    @property
    def own_fields(self) -> list[forms.BoundField]:
        """For the template: all but the options."""
        return [self[one.name] for one in inputs_of(ContestantRequest)]


class EndpointForm(RequestForm):
    """A new endpoint."""

    inputs = inputs_of(EndpointRequest)


class EndpointFactsForm(RequestForm):
    """What of an endpoint can be changed."""

    inputs = inputs_of(EndpointFacts)

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.fields["move_key"] = forms.BooleanField(
            required=False, label="Its key may go to another server than so far"
        )


def _ability(label: str) -> forms.TypedChoiceField:
    return forms.TypedChoiceField(
        required=False,
        label=label,
        choices=[("", "unknown"), ("yes", "yes"), ("no", "no")],
        coerce=lambda word: word == "yes",
        empty_value=None,
    )


class ModelForm(forms.ModelForm):  # type: ignore[type-arg]
    """What somebody knows of a model; what is left empty is unknown."""

    vision = _ability("Sees pictures")
    native_tools = _ability("Calls functions natively")
    json_schema = _ability("Keeps to a JSON schema")
    temperature = _ability("Temperature may be chosen")

    class Meta:
        model = EndpointModel
        fields = MODEL_FACTS

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        words = {True: "yes", False: "no"}
        for name, value in self.initial.items():
            if isinstance(value, bool):
                self.initial[name] = words[value]


@contextmanager
def _placed(form: forms.BaseForm) -> Iterator[None]:
    try:
        yield
    except InvalidDocument as error:
        for path, text in error.problems:
            form.add_error(path if path in form.fields else None, capfirst(text))


def _problems_in(form: forms.BaseForm) -> AbstractContextManager[None, bool]:
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
        given = form.cleaned_data
        with refusals_in(form):
            asked_for = read_request(
                ContestantRequest, given, options=read_values(OPTION_INPUTS, given)
            )
            row = add_contestant(asked_for, user_of(request))
            messages.success(request, f"“{row.name}” is added.")
            return redirect("contestant", code=row.code)
    return render(request, "contestants/new.html", {"form": form})


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
            asked_for = read_request(EndpointRequest, form.cleaned_data)
            row = known_endpoints.add_endpoint(asked_for, user_of(request))
            messages.success(request, f"“{row.label}” is added. Name its models now.")
            return redirect("endpoint", code=row.code)
    context = {"form": form, "variables": list_key_variables()}
    return render(request, "endpoints/new.html", context, status=422 if form.errors else 200)


@allow_only(*STAFF)
@require_http_methods(PAGE)
def endpoint_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show one endpoint with its models; admins change it here."""
    row = get_object_or_404(Endpoint, code=code)
    form = EndpointFactsForm(_posted_by_admin(request), initial=model_to_dict(row))
    if form.is_bound and form.is_valid():
        with refusals_in(form), _problems_in(form):
            known_endpoints.change_endpoint(
                row,
                facts=read_request(EndpointFacts, form.cleaned_data),
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
    form = ModelForm(_posted_by_admin(request), instance=row)
    if form.is_bound and form.is_valid():
        with refusals_in(form), _problems_in(form):
            known_endpoints.change_model(row, facts=form.cleaned_data, actor=user_of(request))
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
