"""The results of a snapshot as the JSON document that is stored, and back; of any version."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import Field, fields, is_dataclass
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from arena.results.tree import VERSION, Results
from augment.errors import InvalidDocument


def read_results(document: Mapping[str, Any]) -> Results:
    """The results of a stored document; an empty one is of version 0.

    Raises:
        InvalidDocument: It is of a later version, or not what its version says.
    """
    version = document.get("version", 0)
    if version not in range(VERSION + 1):
        allowed = f"a version from 0 to {VERSION}, not {version!r}"
        raise InvalidDocument("rating", [("version", allowed)])
    try:
        return _adapter().validate_python(document)
    except ValidationError as error:
        faults = [(".".join(map(str, one["loc"])), one["msg"]) for one in error.errors()]
        raise InvalidDocument("rating", faults) from error


def results_document(results: Results) -> dict[str, Any]:
    """The document of results, with the keys that their version has."""
    if not results.version:
        return {}
    document: dict[str, Any] = _document(results, results.version)
    return document


@cache
def _adapter() -> TypeAdapter[Results]:
    return TypeAdapter(Results)


def _document(value: Any, version: int) -> Any:
    if is_dataclass(value):
        return {
            field.name: _document(found, version)
            for field in fields(value)
            if _is_known(field, found := getattr(value, field.name), version)
        }
    if isinstance(value, dict):
        return {str(key): _document(found, version) for key, found in value.items()}
    return [_document(one, version) for one in value] if isinstance(value, tuple) else value


def _is_known(known: Field[Any], value: Any, version: int) -> bool:
    """Whether a version has the field; what is set stays whatever it says."""
    return bool(version >= known.metadata.get("since", 0) or value != known.default)
