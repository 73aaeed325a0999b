"""Endpoints and models as they come in by a form."""

from __future__ import annotations

from typing import Any

from django import forms
from django.utils.text import capfirst

from augment.errors import InvalidDocument
from augment.models import Endpoint, EndpointModel
from augment.services.endpoints.contestants import REASONING_EFFORTS
from augment.services.endpoints.known_endpoints import FACTS, EndpointFacts, ModelFacts

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
