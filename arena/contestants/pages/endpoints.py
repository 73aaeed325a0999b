"""Endpoints and models as they come in by a form."""

from __future__ import annotations

import uuid
from functools import partial
from typing import Any, cast

from django import forms
from django.contrib import messages
from django.contrib.auth.models import User
from django.core.exceptions import PermissionDenied
from django.db import transaction
from django.db.models import Count
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.utils.text import capfirst
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.contestants.queries import probe_lines
from arena.queries.people import role_of
from arena.web.access import ADMIN, STAFF, allow_only
from augment.errors import AugmentError, InvalidDocument, QueueFault
from augment.models import Endpoint, EndpointModel, Probe
from augment.services.endpoints import known_endpoints
from augment.services.endpoints.contestants import REASONING_EFFORTS
from augment.services.endpoints.known_endpoints import (
    FACTS,
    EndpointFacts,
    ModelFacts,
    is_key_here,
    list_key_variables,
)
from augment.services.endpoints.probing import plan_probe
from augment.services.running.workers import workforce
from augment.tasks import enqueue_probe

_UNKNOWN = [("", "unknown"), ("yes", "yes"), ("no", "no")]


SLUG_RULE = "Lower-case letters, digits, hyphens."


class EndpointPageForm(forms.Form):
    """An address, the variable with its key, and its limits; the label and what it is stay."""

    label = forms.SlugField(max_length=80, label="Label", help_text=SLUG_RULE)
    base_url = forms.CharField(max_length=200, label="Address, up to /v1")
    key_variable = forms.CharField(
        max_length=80,
        required=False,
        label="Environment variable of the workers that holds its key",
    )
    max_concurrency = forms.IntegerField(initial=4, label="Calls at once, over all workers")
    requests_per_minute = forms.IntegerField(
        required=False, label="Calls a minute, at most (empty: no limit)"
    )
    is_simulated = forms.BooleanField(
        required=False, label="A stand-in: what it answers counts as simulated"
    )
    move_key = forms.BooleanField(
        required=False, label="Its key may go to another server than so far"
    )

    def __init__(self, data: Any = None, *, row: Endpoint | None = None) -> None:
        names = ("base_url", "key_variable", "max_concurrency", "requests_per_minute")
        initial = {} if row is None else {name: getattr(row, name) for name in names}
        super().__init__(data, initial=initial)
        if row is not None:
            del self.fields["label"], self.fields["is_simulated"]
        else:
            del self.fields["move_key"]

    def facts(self) -> EndpointFacts:
        """What was entered, once the form is valid."""
        given = self.cleaned_data
        return EndpointFacts(
            base_url=given["base_url"],
            key_variable=given["key_variable"],
            max_concurrency=given["max_concurrency"],
            requests_per_minute=given["requests_per_minute"],
        )


class ModelPageForm(forms.Form):
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
    vision = forms.ChoiceField(required=False, choices=_UNKNOWN, label="Sees pictures")
    native_tools = forms.ChoiceField(
        required=False, choices=_UNKNOWN, label="Calls functions natively"
    )
    json_schema = forms.ChoiceField(
        required=False, choices=_UNKNOWN, label="Keeps to a JSON schema"
    )
    temperature = forms.ChoiceField(
        required=False, choices=_UNKNOWN, label="Temperature may be chosen"
    )

    def __init__(self, data: Any = None, *, row: EndpointModel) -> None:
        initial: dict[str, Any] = {name: getattr(row, name) for name in FACTS}
        for name in _ABILITIES:
            initial[name] = {True: "yes", False: "no", None: ""}[initial[name]]
        if row.price_as_of is not None:
            initial["price_as_of"] = row.price_as_of.isoformat()
        for name in ("price_in_usd", "price_out_usd"):
            if initial[name] is not None:
                initial[name] = f"{initial[name].normalize():f}"
        super().__init__(data, initial=initial)

    def facts(self) -> ModelFacts:
        """What was entered, once the form is valid."""
        given = dict(self.cleaned_data)
        for name in _ABILITIES:
            given[name] = {"yes": True, "no": False, "": None}[given[name]]
        return ModelFacts(**given)


_ABILITIES = ("vision", "native_tools", "json_schema", "temperature")


def place_problems(form: forms.Form, error: InvalidDocument) -> None:
    """Put each fault at its field; at the top where the form has no such field."""
    for path, text in error.problems:
        form.add_error(path if path in form.fields else None, capfirst(text))


@allow_only(*STAFF)
@require_safe
def endpoints_page(request: HttpRequest) -> HttpResponse:
    """Every endpoint with its limits, and whether its key is here."""
    rows = Endpoint.objects.annotate(known=Count("models")).order_by("label")
    lines = [
        {"row": row, "has_key": not row.key_variable or is_key_here(row.key_variable)}
        for row in rows
    ]
    return render(request, "endpoints/list.html", {"lines": lines})


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def new_endpoint_page(request: HttpRequest) -> HttpResponse:
    """A new endpoint."""
    form = EndpointPageForm(request.POST if request.method == "POST" else None)
    if request.method == "POST" and form.is_valid():
        try:
            row = known_endpoints.add_endpoint(
                label=form.cleaned_data["label"],
                facts=form.facts(),
                is_simulated=form.cleaned_data["is_simulated"],
                actor=cast(User, request.user),
            )
        except AugmentError as error:
            _tell(form, error)
        else:
            messages.success(request, f"“{row.label}” is added. Name its models now.")
            return redirect("endpoint", code=row.code)
    context = {"form": form, "variables": list_key_variables()}
    return render(request, "endpoints/new.html", context, status=422 if form.errors else 200)


@allow_only(*STAFF)
@require_http_methods(["GET", "HEAD", "POST"])
def endpoint_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """One endpoint with its models; admins change it here."""
    row = get_object_or_404(Endpoint, code=code)
    if request.method == "POST":
        return _change(request, row)
    return _shown(request, row, EndpointPageForm(row=row))


@allow_only(ADMIN)
@require_POST
def add_model(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Note a model of an endpoint; its listed price comes with it."""
    endpoint = get_object_or_404(Endpoint, code=code)
    try:
        row = known_endpoints.add_model(
            endpoint, model=request.POST.get("model", ""), actor=cast(User, request.user)
        )
    except AugmentError as error:
        messages.error(request, str(error))
        return redirect("endpoint", code=code)
    return redirect("endpoint-model", code=row.code)


@allow_only(*STAFF)
@require_http_methods(["GET", "HEAD", "POST"])
def model_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """What is known of a model, and its last probe, line by line while it is made."""
    row = get_object_or_404(EndpointModel.objects.select_related("endpoint"), code=code)
    form = ModelPageForm(row=row)
    if request.method == "POST":
        _insist_on_admin(request)
        form = ModelPageForm(request.POST, row=row)
        if form.is_valid():
            try:
                known_endpoints.change_model(
                    row, facts=form.facts(), actor=cast(User, request.user)
                )
            except AugmentError as error:
                _tell(form, error)
            else:
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
    try:
        with transaction.atomic():
            probe = plan_probe(row, actor=cast(User, request.user))
            transaction.on_commit(partial(_send, request, probe.pk))
    except AugmentError as error:
        messages.error(request, str(error))
    return redirect("endpoint-model", code=code)


# --- Private -----------------------------------------------------------------------------------


def _change(request: HttpRequest, row: Endpoint) -> HttpResponse:
    _insist_on_admin(request)
    form = EndpointPageForm(request.POST, row=row)
    if form.is_valid():
        try:
            known_endpoints.change_endpoint(
                row,
                facts=form.facts(),
                may_move_key=form.cleaned_data["move_key"],
                actor=cast(User, request.user),
            )
        except AugmentError as error:
            _tell(form, error)
        else:
            messages.success(request, "Kept. It counts for the next call.")
            return redirect("endpoint", code=row.code)
    return _shown(request, row, form)


def _shown(request: HttpRequest, row: Endpoint, form: EndpointPageForm) -> HttpResponse:
    context = {
        "row": row,
        "form": form,
        "models": row.models.all(),
        "contestants": row.contestants.filter(retired_at=None).order_by("name"),
        "has_key": not row.key_variable or is_key_here(row.key_variable),
        "variables": list_key_variables(),
    }
    return render(request, "endpoints/endpoint.html", context, status=422 if form.errors else 200)


def _insist_on_admin(request: HttpRequest) -> None:
    """Raise PermissionDenied where somebody may look and not change."""
    if role_of(request.user) != ADMIN:
        raise PermissionDenied


def _tell(form: EndpointPageForm | ModelPageForm, error: AugmentError) -> None:
    if isinstance(error, InvalidDocument):
        place_problems(form, error)
    else:
        form.add_error(None, str(error))


def _send(request: HttpRequest, probe_pk: int) -> None:
    try:
        enqueue_probe(probe_pk)
    except QueueFault as error:
        messages.warning(request, str(error))
