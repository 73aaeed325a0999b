"""Forms and fields that several subjects share."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, cast

from django import forms
from django.forms.renderers import TemplatesSetting

from augment.errors import Conflict
from augment.models import Contestant, Scenario
from augment.services import Input, InputKind, to_inputs
from augment.services.running import Caps

LONGEST_LINES = 60_000


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeGroup:
    """All scenarios of one type."""

    type: str
    label: str
    scenarios: list[Scenario]


@dataclass(frozen=True, slots=True, kw_only=True)
class Offer:
    """A contestant to choose, or why it can't be."""

    row: Contestant
    obstacle: str = ""


class InputField(forms.BoundField):
    """A field in the look of the pages; what is typed there is no prose to correct."""

    def build_widget_attrs(self, attrs: Any, widget: forms.Widget | None = None) -> Any:
        """Add what all fields have that hold a text, a number or a choice of one."""
        built = super().build_widget_attrs(attrs, widget)
        typed = (forms.TextInput, forms.NumberInput, forms.PasswordInput, forms.Textarea)
        if isinstance(widget or self.field.widget, (*typed, forms.Select)):
            built |= {"class": "input"}
        if self.widget_type == "text":
            built |= {"autocapitalize": "none", "spellcheck": "false"}
        return built


class PageRenderer(TemplatesSetting):
    """Forms by our templates."""

    field_template_name = "parts/field.html"
    bound_field_class = InputField


def offer(form: forms.BaseForm, field: str, choices: Iterable[tuple[str, Any]]) -> None:
    """Set what there is to choose in a field of a form."""
    cast(forms.ChoiceField, form.fields[field]).choices = list(choices)


class ChoiceForm(forms.Form):
    """Contestants x scenarios, under a name.

    A whole type can be chosen without a script: `types` stands for all of its scenarios.
    """

    NO_SCENARIO = "Choose at least one scenario."

    name = forms.CharField(max_length=120, strip=True)
    contestants = forms.MultipleChoiceField(
        error_messages={"required": "Choose at least one contestant."}
    )
    types = forms.MultipleChoiceField(required=False)
    scenarios = forms.MultipleChoiceField(required=False)

    def __init__(
        self, *args: Any, contestants: list[Contestant], groups: list[TypeGroup], **kwargs: Any
    ) -> None:
        super().__init__(*args, **kwargs)
        self.offered = contestants
        self.groups = groups
        offer(self, "contestants", [(row.slug, row.name) for row in contestants])
        offer(self, "types", [(group.type, group.label) for group in groups])
        rows = [row for group in groups for row in group.scenarios]
        offer(self, "scenarios", [(row.slug, row.slug) for row in rows])

    @property
    def offers(self) -> list[Offer]:
        """Return whom there is to choose, for the template."""
        return [Offer(row=row) for row in self.offered]

    def clean(self) -> dict[str, Any]:
        """Turn whole types into their scenarios."""
        cleaned = super().clean() or {}
        types = set(cleaned.get("types", ()))
        chosen = set(cleaned.get("scenarios", ()))
        cleaned["scenarios"] = [
            row.slug
            for group in self.groups
            for row in group.scenarios
            if group.type in types or row.slug in chosen
        ]
        if not cleaned["scenarios"]:
            self.add_error("scenarios", self.NO_SCENARIO)
        return cleaned

    @property
    def chosen_counts(self) -> dict[str, int]:
        """Return how many scenarios of each type are ticked singly, for the template."""
        chosen = set(self["scenarios"].value() or ())
        return {
            group.type: sum(row.slug in chosen for row in group.scenarios) for group in self.groups
        }


class LinesField(forms.CharField):
    """A text whose lines are the values."""

    widget = forms.Textarea(attrs={"rows": 3})

    def clean(self, value: Any) -> list[str]:
        """Return the lines."""
        return str(super().clean(value)).splitlines()


def form_field(declared: Input) -> forms.Field:
    """Return the field of a form; an empty number is 0 where one need not be given.

    The choices of a field of names are the caller's.
    """
    options: dict[str, Any] = {"label": declared.title, "help_text": declared.help}
    options["required"] = declared.is_required
    if not declared.is_required:
        options["initial"] = declared.default
    bounds = {"min_value": declared.least, "max_value": declared.most}
    choices = [("", "–")] * (declared.default is None) + list(declared.choices.items())
    kinds: dict[InputKind, tuple[type[forms.Field], dict[str, Any]]] = {
        InputKind.TEXT: (forms.CharField, {"max_length": declared.most}),
        InputKind.WHOLE: (forms.IntegerField, bounds | {"required": declared.default is not None}),
        InputKind.NUMBER: (forms.FloatField, bounds),
        InputKind.DECIMAL: (
            forms.DecimalField,
            bounds | {"max_digits": 16, "decimal_places": 9, "required": declared.is_required},
        ),
        InputKind.SWITCH: (forms.BooleanField, {"required": False}),
        InputKind.CHOICE: (forms.ChoiceField, {"choices": choices}),
        InputKind.LINES: (LinesField, {"initial": "", "max_length": LONGEST_LINES}),
        InputKind.NAMES: (forms.MultipleChoiceField, {}),
    }
    field, more = kinds[declared.kind]
    return field(**options | more)


class RequestForm(forms.Form):
    """A form of a request's inputs, beside the fields of the class.

    Attributes:
        inputs: What is asked for.
    """

    inputs: tuple[Input, ...] = ()

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        missing = [field for field in self.inputs if field.name not in self.fields]
        self.fields |= {field.name: form_field(field) for field in missing}


class CapsForm(RequestForm):
    """Caps of a job; an empty field is no cap, or an unchanged one."""

    inputs = to_inputs(Caps)


def read_json(text: str | bytes, *, otherwise: str) -> Any:
    """Read JSON that somebody typed or sent.

    Args:
        text: All of it.
        otherwise: What somebody is told whose text is no JSON.

    Raises:
        Conflict: It is no JSON, or nested too deeply.
    """
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        raise Conflict(otherwise) from None
