"""Fields of a body for what a request asks for."""

from __future__ import annotations

from typing import Any

from rest_framework import serializers

from arena.api.fields import FlagField, NumberField, TextField, WholeNumberField
from augment.services.inputs import Input, InputKind

LONGEST_NAME = 150
MOST_NAMES = 5_000
LONGEST_LINE = 500
MOST_LINES = 2_000

Field = serializers.Field[Any, Any, Any, Any]


def body_field(asked: Input) -> Field:
    """Return the field of a body."""
    given: dict[str, Any] = {"help_text": asked.explanation}
    given |= {"required": True} if asked.is_required else {"default": asked.default}
    bounds: dict[str, Any] = {"min_value": asked.least, "max_value": asked.most}
    match asked.kind:
        case InputKind.TEXT:
            return TextField(**given | {"max_length": asked.most})
        case InputKind.WHOLE:
            return WholeNumberField(**given, **bounds)
        case InputKind.NUMBER:
            return NumberField(**given, **bounds)
        case InputKind.SWITCH:
            return FlagField(**given)
        case InputKind.CHOICE:
            return serializers.ChoiceField(**given, choices=list(asked.choices))
        case InputKind.LINES:
            line = TextField(max_length=LONGEST_LINE, allow_blank=True)
            return serializers.ListField(**given, child=line, max_length=MOST_LINES)
        case InputKind.NAMES:
            name = TextField(max_length=LONGEST_NAME)
            return serializers.ListField(**given, child=name, max_length=MOST_NAMES)
