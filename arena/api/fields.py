"""Reading a request: known fields only, each of its own type."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from math import isfinite
from typing import Any

from rest_framework import serializers


class StrictSerializer(serializers.Serializer[Any]):
    """A body whose unknown fields are refused, so that a misspelt one is never ignored."""

    def run_validation(self, data: Any = serializers.empty) -> Any:
        """The typed values.

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
    """An integer of JSON: neither a text nor a fraction nor true."""

    def to_internal_value(self, data: Any) -> int:
        """The number itself."""
        if isinstance(data, bool) or not isinstance(data, int):
            self.fail("invalid")
        return super().to_internal_value(data)


class NumberField(serializers.FloatField):
    """A finite number of JSON: neither a text nor true."""

    def to_internal_value(self, data: Any) -> float:
        """The number itself."""
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
    """A number of JSON from 0 to 1."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(min_value=0, max_value=1, **kwargs)


class CodeField(serializers.UUIDField):
    """A UUID as a text of JSON: no number stands for one."""

    def to_internal_value(self, data: Any) -> uuid.UUID:
        """The UUID itself."""
        if not isinstance(data, str):
            self.fail("invalid", value=data)
        return super().to_internal_value(data)


class FlagField(serializers.BooleanField):
    """True or false of JSON: neither a text nor a number stands for one."""

    def to_internal_value(self, data: Any) -> bool:
        """The flag itself."""
        if not isinstance(data, bool):
            self.fail("invalid", input=data)
        return data


class TextField(serializers.CharField):
    """A text of JSON as it is: no number stands for one, and what is said in it is kept."""

    def to_internal_value(self, data: Any) -> str:
        """The text itself."""
        if not isinstance(data, str):
            self.fail("invalid")
        return super().to_internal_value(data)
