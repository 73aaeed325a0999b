"""Parsing a request body: known fields only, each of its own type."""

from collections.abc import Mapping
from math import isfinite
from typing import IO, Any

from rest_framework import serializers
from rest_framework.exceptions import ParseError
from rest_framework.parsers import JSONParser

from augment.services import Input, InputKind, to_inputs


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


class _OfType:
    """Refuse JSON values of other types, which DRF would convert: "5", true and 5.0 for 5."""

    json_types: tuple[type, ...] = ()

    def to_internal_value(self, data: Any) -> Any:
        if type(data) not in self.json_types:
            self.fail("invalid", input=data, value=data)  # type: ignore[attr-defined]
        return super().to_internal_value(data)  # type: ignore[misc]


class WholeNumberField(_OfType, serializers.IntegerField):
    """A JSON integer."""

    json_types = (int,)


class FlagField(_OfType, serializers.BooleanField):
    """A JSON boolean."""

    json_types = (bool,)


class TextField(_OfType, serializers.CharField):
    """A JSON string."""

    json_types = (str,)


class CodeField(_OfType, serializers.UUIDField):
    """A UUID as a JSON string."""

    json_types = (str,)


class NumberField(_OfType, serializers.FloatField):
    """A finite JSON number."""

    json_types = (int, float)

    def to_internal_value(self, data: Any) -> float:
        """Return the number."""
        try:
            number = float(super().to_internal_value(data))
        except OverflowError:  # a whole number with hundreds of digits
            self.fail("invalid")
        if not isfinite(number):
            self.fail("invalid")
        return number


LONGEST_NAME = 150
MOST_NAMES = 5_000
LONGEST_LINE = 500
MOST_LINES = 2_000

Field = serializers.Field[Any, Any, Any, Any]


class RequestBody(StrictSerializer):
    """A body whose fields are the inputs of a request, beside those of the class.

    Attributes:
        request: The dataclass.
    """

    request: type

    def get_fields(self) -> dict[str, Field]:
        """Return a field for each input."""
        return {
            item.name: body_field(item) for item in to_inputs(self.request)
        } | super().get_fields()


def body_field(declared: Input) -> Field:
    """Return the field of a body."""
    options: dict[str, Any] = {"help_text": declared.explanation, "required": declared.is_required}
    if not declared.is_required:
        options["default"] = declared.default
        options["allow_null"] = declared.default is None
    bounds: dict[str, Any] = {"min_value": declared.least, "max_value": declared.most}
    match declared.kind:
        case InputKind.TEXT:
            options["allow_blank"] = declared.default == ""
            return TextField(**options | {"max_length": declared.most})
        case InputKind.WHOLE:
            return WholeNumberField(**options, **bounds)
        case InputKind.NUMBER:
            return NumberField(**options, **bounds)
        case InputKind.DECIMAL:
            return serializers.DecimalField(16, 9, **options, **bounds)
        case InputKind.SWITCH:
            return FlagField(**options)
        case InputKind.CHOICE:
            return serializers.ChoiceField(**options, choices=list(declared.choices))
        case InputKind.LINES:
            line = TextField(max_length=LONGEST_LINE, allow_blank=True)
            return serializers.ListField(**options, child=line, max_length=MOST_LINES)
        case InputKind.NAMES:
            name = TextField(max_length=LONGEST_NAME)
            return serializers.ListField(**options, child=name, max_length=MOST_NAMES)
