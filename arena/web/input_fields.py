"""Form fields of what a request asks for."""

from __future__ import annotations

from typing import Any

from django import forms

from augment.services.inputs import Input, InputKind

LONGEST_LINES = 60_000


class LinesField(forms.CharField):
    """A text whose lines are the values."""

    widget = forms.Textarea(attrs={"class": "input", "rows": 3})

    def clean(self, value: Any) -> list[str]:
        """Return the lines."""
        return str(super().clean(value)).splitlines()


def form_field(asked: Input) -> forms.Field:
    """Return the field of a form; an empty number is 0 where one need not be given.

    The choices of a field of names are the caller's.
    """
    given: dict[str, Any] = {"label": asked.title, "help_text": asked.help}
    given |= {"required": asked.is_required}
    given |= {} if asked.is_required else {"initial": asked.default}
    bounds: dict[str, Any] = {"min_value": asked.least, "max_value": asked.most}
    look = {"class": "input"}
    match asked.kind:
        case InputKind.TEXT:
            words: dict[str, Any] = given | {"max_length": asked.most}
            return forms.CharField(**words, widget=forms.TextInput(attrs=look))
        case InputKind.WHOLE:
            widget = forms.NumberInput(attrs=look)
            return forms.IntegerField(
                **given | bounds | {"required": asked.default is not None}, widget=widget
            )
        case InputKind.NUMBER:
            widget = forms.NumberInput(attrs={**look, "step": "any"})
            return forms.FloatField(**given | bounds, widget=widget)
        case InputKind.SWITCH:
            return forms.BooleanField(**given | {"required": False})
        case InputKind.CHOICE:
            choices = list(asked.choices.items())
            return forms.ChoiceField(**given, choices=choices, widget=forms.Select(attrs=look))
        case InputKind.LINES:
            return LinesField(**given | {"initial": ""}, max_length=LONGEST_LINES)
        case InputKind.NAMES:
            return forms.MultipleChoiceField(**given)
