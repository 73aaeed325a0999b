"""The OpenAPI document, for programs as JSON and for staff as a page."""

from __future__ import annotations

from functools import cache
from typing import Any

from django.core.exceptions import PermissionDenied
from django.http import HttpRequest, HttpResponse
from django.shortcuts import render
from django.urls import include, path
from django.views.decorators.http import require_safe
from drf_spectacular.generators import SchemaGenerator
from drf_spectacular.utils import extend_schema
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import StaffOnly
from arena.api.errors import ApiView
from arena.queries.people import role_of


@cache
def make_document() -> dict[str, Any]:
    """The OpenAPI document of every resource; the same for everybody, so it is made once."""
    patterns = [path("api/v1/", include("arena.api.urls"))]
    generator = SchemaGenerator(patterns=patterns)  # type: ignore[no-untyped-call]
    found: dict[str, Any] = generator.get_schema(request=None, public=True)  # type: ignore[no-untyped-call]
    return found


class DocumentView(ApiView):
    """GET answers with the document, to staff: it names variants that an expert must not know."""

    permission_classes = (StaffOnly,)

    @extend_schema(exclude=True)
    def get(self, request: Request) -> Response:
        """It names no row."""
        return Response(make_document())


@require_safe
def reference_page(request: HttpRequest) -> HttpResponse:
    """Every operation with what it takes and answers, read from the document."""
    if role_of(request.user) not in ("admin", "analyst"):
        raise PermissionDenied
    document = make_document()
    return render(request, "api/reference.html", {"groups": _groups(document)})


# --- Private -----------------------------------------------------------------------------------


def _groups(document: dict[str, Any]) -> list[tuple[str, list[dict[str, Any]]]]:
    """The operations by the first word of their address."""
    groups: dict[str, list[dict[str, Any]]] = {}
    for address, methods in document["paths"].items():
        for method, operation in methods.items():
            if isinstance(operation, dict) and "responses" in operation:
                line = _operation(address, method, operation, document)
                groups.setdefault(operation["tags"][0], []).append(line)
    return sorted(groups.items())


def _operation(
    address: str, method: str, operation: dict[str, Any], document: dict[str, Any]
) -> dict[str, Any]:
    body = operation.get("requestBody", {}).get("content", {})
    return {
        "id": operation["operationId"],
        "method": method.upper(),
        "path": address,
        "summary": operation.get("summary", ""),
        "words": operation.get("description", ""),
        "query": [_parameter(one) for one in operation.get("parameters", ())],
        "takes": _fields(_first_schema(body), document),
        "answers": [
            {
                "heading": f"Answer {status}",
                "fields": _fields(_first_schema(answer.get("content", {})), document),
                "types": list(answer.get("content", {})),
            }
            for status, answer in operation["responses"].items()
            if status < "300"
        ],
        "others": [
            (status, answer["description"])
            for status, answer in operation["responses"].items()
            if status >= "300"
        ],
    }


def _first_schema(content: dict[str, Any]) -> dict[str, Any]:
    return next((one.get("schema", {}) for one in content.values()), {})


def _parameter(given: dict[str, Any]) -> dict[str, Any]:
    return {
        "name": given["name"],
        "where": given["in"],
        "is_needed": given.get("required", False),
        "type": _type_name(given.get("schema", {})),
        "words": given.get("description", ""),
    }


def _fields(schema: dict[str, Any], document: dict[str, Any], depth: int = 0) -> list[Any]:
    """The fields of an object, those of objects inside it after it and with their path."""
    found = _resolved(schema, document)
    if found.get("type") == "array":
        return _fields(found.get("items", {}), document, depth)
    lines = []
    for name, field in found.get("properties", {}).items():
        inner = _resolved(field, document)
        lines.append(
            {
                "name": name,
                "type": _type_name(inner),
                "words": field.get("description", "") or inner.get("description", ""),
                "is_needed": name in found.get("required", ()),
            }
        )
        if depth < 2:
            for line in _fields(inner, document, depth + 1):
                lines.append(line | {"name": f"{name}.{line['name']}"})
    return lines


def _resolved(schema: dict[str, Any], document: dict[str, Any]) -> dict[str, Any]:
    """What a reference leads to; of a choice the part that is an object."""
    for part in (*schema.get("allOf", ()), *schema.get("oneOf", ()), *schema.get("anyOf", ())):
        if "$ref" in part:
            return _resolved(part, document)
    if "$ref" not in schema:
        return schema
    name = schema["$ref"].rpartition("/")[2]
    target: dict[str, Any] = document["components"]["schemas"][name]
    return target


def _type_name(schema: dict[str, Any]) -> str:
    """In a few words: the type, its form, and what is allowed where that is a short list."""
    if "enum" in schema:
        return " | ".join("null" if one is None else str(one) for one in schema["enum"])
    found = schema.get("type", "")
    name = " | ".join(found) if isinstance(found, list) else str(found)
    if schema.get("type") == "array":
        return f"array of {_type_name(schema.get('items', {})) or 'objects'}"
    return f"{name} ({schema['format']})" if "format" in schema else name
