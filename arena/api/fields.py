"""Parsing a request body: known fields only, each of its own type."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from math import isfinite
from typing import IO, Any

from rest_framework import serializers
from rest_framework.exceptions import ParseError
from rest_framework.parsers import JSONParser

from augment.services.inputs import Input, InputKind


class SoundJSONParser(JSONParser):
    """JSON whose nesting can't exhaust the stack."""

    def parse(
        self,
        stream: IO[Any],
        media_type: str | None = None,
        parser_context: Mapping[str, Any] | None = None,
    ) -> Any:
        """Return the value.

        Raises:
            ParseError: It is no JSON, or nested too deeply.
        """
        try:
            return super().parse(stream, media_type, parser_context)
        except RecursionError as error:
            raise ParseError("JSON parse error - nested too deeply") from error


class StrictSerializer(serializers.Serializer[Any]):
    """A body that refuses unknown fields, so that a misspelt one is never ignored."""

    def run_validation(self, data: Any = serializers.empty) -> Any:
        """Return the typed values.

        Raises:
            serializers.ValidationError: A field is unknown, missing or of the wrong type.
        """
        if data is serializers.empty:  # one inside another that is not there
            return super().run_validation(data)
        if not isinstance(data, Mapping):
            raise serializers.ValidationError({"body": ["Must be a JSON object."]})
        unknown = sorted(set(data) - set(self.fields))
        if unknown:
            allowed = ", ".join(self.fields)
            raise serializers.ValidationError(
                {name: [f"Unknown field. Known: {allowed}."] for name in unknown}
            )
        return super().run_validation(data)


class WholeNumberField(serializers.IntegerField):
    """A JSON integer; strings, fractions and booleans are refused."""

    def to_internal_value(self, data: Any) -> int:
        """Return the number."""
        if isinstance(data, bool) or not isinstance(data, int):
            self.fail("invalid")
        return super().to_internal_value(data)


class NumberField(serializers.FloatField):
    """A finite JSON number; strings and booleans are refused."""

    def to_internal_value(self, data: Any) -> float:
        """Return the number."""
        if isinstance(data, bool) or not isinstance(data, int | float):
            self.fail("invalid")
        try:
            number = float(data)
        except OverflowError:  # a whole number with hundreds of digits
            self.fail("invalid")
        if not isfinite(number):
            self.fail("invalid")
        return number


class ShareField(NumberField):
    """A JSON number from 0 to 1."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(min_value=0, max_value=1, **kwargs)


class CodeField(serializers.UUIDField):
    """A UUID as a JSON string; numbers are refused."""

    def to_internal_value(self, data: Any) -> uuid.UUID:
        """Return the UUID."""
        if not isinstance(data, str):
            self.fail("invalid", value=data)
        return super().to_internal_value(data)


class FlagField(serializers.BooleanField):
    """A JSON boolean; strings and numbers are refused."""

    def to_internal_value(self, data: Any) -> bool:
        """Return the flag."""
        if not isinstance(data, bool):
            self.fail("invalid", input=data)
        return data


class TextField(serializers.CharField):
    """A JSON string; numbers are refused."""

    def to_internal_value(self, data: Any) -> str:
        """Return the text."""
        if not isinstance(data, str):
            self.fail("invalid")
        return super().to_internal_value(data)


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
