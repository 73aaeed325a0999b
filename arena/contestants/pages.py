"""Pages of contestants, and of the endpoints and models that they ask."""

import uuid
from collections.abc import Iterator
from typing import Any

from django import forms
from django.contrib import messages
from django.core.exceptions import PermissionDenied
from django.db import transaction
from django.db.models import Count
from django.forms import model_to_dict
from django.http import HttpRequest, HttpResponse, JsonResponse
from django.shortcuts import get_object_or_404, redirect, render

from arena.contestants.queries import probe_lines, probe_state, show_options
from arena.shell.access import ADMIN, STAFF, act_for, form_for, get_user, page_for
from arena.shell.accounts import top_role
from arena.shell.acts import refusals_in, send_later, wait_for_workers
from arena.shell.forms import RequestForm, offer
from arena.shell.listing import read_listing, read_page
from augment.errors import AugmentError
from augment.models import Contestant, Endpoint, EndpointModel, GenerationJob, Probe
from augment.services import free_slug, make_slug, read_request, read_values, retire, to_inputs
from augment.services.endpoints import (
    MODEL_FACTS,
    OPTION_INPUTS,
    ContestantRequest,
    EndpointFacts,
    EndpointRequest,
    add_contestant,
    add_model,
    known_endpoints,
    list_models,
    paper_variants,
    plan_probe,
    read_respondents,
)
from augment.services.running import workforce
from augment.services.running.matrix import SEPARATOR

CONTESTANTS_AT_ONCE = 50


class OptionsForm(RequestForm):
    """Options with which a contestant asks its model; an empty field stays open."""

    inputs = OPTION_INPUTS

    @property
    def option_fields(self) -> list[forms.BoundField]:
        """For the template."""
        return [self[field.name] for field in OPTION_INPUTS]

    @property
    def has_options(self) -> bool:
        """For the template: whether any is filled in, so that one sees which."""
        return any(field.value() not in (None, "") for field in self.option_fields)


REQUEST = {field.name: field for field in to_inputs(ContestantRequest)}


class ContestantForm(OptionsForm):
    """A model, its variants, and how it asks."""

    inputs = (REQUEST["name"], *OPTION_INPUTS)
    model = forms.ChoiceField(label="Model")
    variant = forms.MultipleChoiceField(
        label="Variants",
        choices=[*REQUEST["variant"].choices.items()],
        widget=forms.CheckboxSelectMultiple,
        help_text=f"Each is a contestant. {REQUEST['variant'].help}",
    )

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        models = EndpointModel.objects.order_by("endpoint__label", "model")
        pairs = models.values_list("endpoint__label", "model")
        choices = [(f"{at}{SEPARATOR}{model}", f"{model} at {at}") for at, model in pairs]
        offer(self, "model", choices)

    def clean(self) -> dict[str, Any]:
        """Refuse one name for several contestants."""
        values: dict[str, Any] = super().clean() or self.cleaned_data
        if values.get("name") and len(values.get("variant", ())) > 1:
            self.add_error("name", "Two contestants can’t have one name: tick one variant.")
        return values

    def to_requests(self) -> Iterator[ContestantRequest]:
        """Yield a request for each variant; its slug is made of model and variant."""
        values = self.cleaned_data
        options = read_values(OPTION_INPUTS, values)
        endpoint, model = values["model"].split(SEPARATOR, 1)
        whole = values | {"endpoint": endpoint, "model": model, "slug": ""}
        for variant in values["variant"]:
            yield read_request(ContestantRequest, whole | {"variant": variant}, options=options)


class EndpointForm(RequestForm):
    """A new endpoint."""

    inputs = to_inputs(EndpointRequest)

    def clean_label(self) -> str:
        """Return the name as a slug."""
        name: str = self.cleaned_data["label"]
        if name == make_slug(name):
            return name
        return free_slug(Endpoint.objects, name, otherwise="endpoint", column="label")


class EndpointFactsForm(RequestForm):
    """Facts about an endpoint that can be changed."""

    inputs = to_inputs(EndpointFacts)


ABILITIES = {
    "vision": "Sees pictures",
    "native_tools": "Calls functions natively",
    "temperature": "Temperature may be chosen",
}


class ModelForm(forms.ModelForm):  # type: ignore[type-arg]
    """Facts that somebody knows about a model; an empty field is unknown."""

    class Meta:
        model = EndpointModel
        fields = MODEL_FACTS
        labels = ABILITIES
        widgets = dict.fromkeys(ABILITIES, forms.NullBooleanSelect)


# --- Contestants -------------------------------------------------------------------------------


@page_for(*STAFF)
def contestants_page(request: HttpRequest) -> HttpResponse:
    """List contestants page by page."""
    kinds = [kind for kind in Contestant.Kind.choices if kind[0] != Contestant.Kind.CHECK]
    offered = [("active", "offered"), ("retired", "retired")]
    listing = read_listing(request, {"kind": ("Kind", kinds), "offered": ("In forms", offered)})
    rows = Contestant.objects.exclude(kind=Contestant.Kind.CHECK).select_related("endpoint")
    rows = listing.narrow(rows, "name", "slug", "variant", "model", "endpoint__label", by=["kind"])
    if chosen := listing.find_choice("offered"):
        rows = rows.filter(retired_at__isnull=chosen == "active")
    rows = rows.annotate(made=Count("augmentations")).order_by("name", "pk")
    page = read_page(request, rows, size=CONTESTANTS_AT_ONCE)
    return render(request, "contestants/list.html", {"page": page, "listing": listing})


@page_for(*STAFF)
def contestant_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show one contestant in full."""
    row = get_object_or_404(Contestant.objects.select_related("endpoint"), code=code)
    context: dict[str, object] = {
        "contestant": row,
        "jobs": GenerationJob.objects.filter(contestants=row),
        "studies": row.studies.all(),
    }
    try:
        context |= {"asking": show_options(row), "respondents": read_respondents(row)}
    except AugmentError as error:  # a role's endpoint is gone, or the variant
        messages.warning(request, str(error))
    return render(request, "contestants/contestant.html", context)


@form_for(ADMIN)
def new_contestant_page(request: HttpRequest) -> HttpResponse:
    """Add contestants that ask a model, by default in the paper's variants."""
    models = EndpointModel.objects.order_by("-pk")
    label, _, name = request.GET.get("model", "").partition(SEPARATOR)
    initial: dict[str, Any] = {}
    if model := models.filter(endpoint__label=label, model=name).first() or models.first():
        initial = {"model": f"{model.endpoint.label}{SEPARATOR}{model.model}"}
        initial["variant"] = paper_variants(model)
    form = ContestantForm(request.POST or None, initial=initial)
    if form.is_valid():
        with refusals_in(form), transaction.atomic():
            rows = [add_contestant(wanted, get_user(request)) for wanted in form.to_requests()]
            messages.success(request, f"Added: {', '.join(row.name for row in rows)}.")
            if len(rows) > 1:
                return redirect("contestants")
            return redirect("contestant", code=rows[0].code)
    return render(request, "contestants/new.html", {"form": form})


@act_for(ADMIN, back="contestant")
def set_retired(request: HttpRequest, code: uuid.UUID) -> None:
    """Retire a contestant, or take that back."""
    row = get_object_or_404(Contestant, code=code)
    retire(row, actor=get_user(request), is_retired=request.POST.get("retired") != "no")


# --- Endpoints and models ----------------------------------------------------------------------


@page_for(*STAFF)
def endpoints_page(request: HttpRequest) -> HttpResponse:
    """List every endpoint, and whether its key is found in the workers."""
    rows = Endpoint.objects.annotate(known=Count("models")).order_by("label")
    return render(request, "endpoints/list.html", {"rows": rows, "workforce": workforce()})


@form_for(ADMIN)
def new_endpoint_page(request: HttpRequest) -> HttpResponse:
    """Add an endpoint."""
    form = EndpointForm(request.POST or None)
    if form.is_valid():
        with refusals_in(form):
            wanted = read_request(EndpointRequest, form.cleaned_data)
            row = known_endpoints.add_endpoint(wanted, get_user(request))
            messages.success(request, f"“{row.label}” is added. Name its models now.")
            return redirect("endpoint", code=row.code)
    context = {"form": form, "variables": sorted(workforce().keys)}
    return render(request, "endpoints/new.html", context, status=422 if form.errors else 200)


@form_for(*STAFF)
def endpoint_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show one endpoint with its models; admins change it here."""
    row = get_object_or_404(Endpoint, code=code)
    form = EndpointFactsForm(_sent_by_admin(request), initial=model_to_dict(row))
    if form.is_valid():
        with refusals_in(form):
            facts = read_request(EndpointFacts, form.cleaned_data)
            known_endpoints.change_endpoint(row, facts=facts, actor=get_user(request))
            messages.success(request, "Kept. It counts for the next call.")
            return redirect("endpoint", code=row.code)
    models = [(model, probe_state(model, model.probes.first())) for model in row.models.all()]
    staff = workforce()
    context = {
        "row": row,
        "form": form,
        "models": models,
        "is_live": any(state == "asked" for _, state in models),
        "is_priced": any(model.price_in_usd is not None for model, _ in models),
        "contestants": row.contestants.filter(retired_at=None).order_by("name"),
        "workforce": staff,
        "variables": sorted(staff.keys),
    }
    return render(request, "endpoints/endpoint.html", context, status=422 if form.errors else 200)


def _sent_by_admin(request: HttpRequest) -> Any:
    """Return the posted data, if any; researchers may look and not change."""
    if request.method == "POST" and top_role(request.user) != ADMIN:
        raise PermissionDenied
    return request.POST or None


@page_for(ADMIN)
def listed_models(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Return the models that an endpoint lists and nobody named yet, or why there are none."""
    row = get_object_or_404(Endpoint, code=code)
    try:
        named = set(row.models.values_list("model", flat=True))
        names = [name for name in list_models(row) if name not in named]
    except AugmentError as error:
        return JsonResponse({"models": [], "problem": str(error)})
    return JsonResponse({"models": names, "problem": ""})


@act_for(ADMIN, back="endpoint")
def new_model(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Note a model of an endpoint with its listed price, and have a worker probe it."""
    endpoint = get_object_or_404(Endpoint, code=code)
    probe = add_model(endpoint, model=request.POST.get("model", ""), actor=get_user(request))
    send_later(request, probe)
    return redirect("endpoint-model", code=probe.model.code)


@form_for(*STAFF)
def model_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show what is known of a model, and its last probe, line by line while it is made."""
    row = get_object_or_404(EndpointModel.objects.select_related("endpoint"), code=code)
    form = ModelForm(_sent_by_admin(request), instance=row)
    if form.is_valid():
        with refusals_in(form):
            known_endpoints.change_model(row, facts=form.cleaned_data, actor=get_user(request))
            messages.success(request, "Kept. It counts for contestants that have not run yet.")
            return redirect("endpoint-model", code=code)
    probe = row.probes.first()
    is_live = probe is not None and probe.state in Probe.UNDER_WAY
    context = {
        "row": row,
        "form": form,
        "probe": probe,
        **wait_for_workers(waits=is_live),
        "state": probe_state(row, probe),
        "lines": probe_lines(row, probe),
    }
    return render(request, "endpoints/model.html", context, status=422 if form.errors else 200)


@act_for(ADMIN, back="endpoint-model")
def probe_model(request: HttpRequest, code: uuid.UUID) -> None:
    """Have a worker ask the model what it can do."""
    row = get_object_or_404(EndpointModel.objects.select_related("endpoint"), code=code)
    send_later(request, plan_probe(row, actor=get_user(request)))
