"""The OpenAPI document, as JSON for programs and as a page for staff."""

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

from arena.api.access import STAFF
from arena.api.views import ApiView
from arena.people.queries import role_of


@cache
def make_document() -> dict[str, Any]:
    """Return the OpenAPI document; it is the same for everybody."""
    patterns = [path("api/v1/", include("arena.api.urls"))]
    generator = SchemaGenerator(patterns=patterns)  # type: ignore[no-untyped-call]
    found: dict[str, Any] = generator.get_schema(request=None, public=True)  # type: ignore[no-untyped-call]
    return found


class DocumentView(ApiView):
    """The document; it names variants, which experts must not know."""

    readers = STAFF

    @extend_schema(exclude=True)
    def get(self, request: Request) -> Response:
        """The whole document."""
        return Response(make_document())


@require_safe
def reference_page(request: HttpRequest) -> HttpResponse:
    """Show every operation, then the fields of what it takes and answers."""
    if role_of(request.user) not in STAFF:
        raise PermissionDenied
    document = make_document()
    operations = [
        _operation(address, method, operation)
        for address, methods in document["paths"].items()
        for method, operation in methods.items()
    ]
    schemas = {
        name: [
            (
                field,
                _type(given),
                given.get("description", ""),
                field in schema.get("required", ()),
            )
            for field, given in schema["properties"].items()
        ]
        for name, schema in document["components"]["schemas"].items()
        if "properties" in schema
    }
    return render(request, "api/reference.html", {"operations": operations, "schemas": schemas})


# --- Private -----------------------------------------------------------------------------------


def _operation(address: str, method: str, given: dict[str, Any]) -> dict[str, Any]:
    answers = {status: one for status, one in given["responses"].items() if status < "300"}
    (answer,) = answers.values()
    return {
        "id": given["operationId"],
        "method": method.upper(),
        "path": address,
        "summary": given["summary"],
        "words": given["description"],
        "parameters": [
            (one["name"], _type(one["schema"]), one.get("description", ""), one.get("required"))
            for one in given.get("parameters", ())
        ],
        "takes": _content(given.get("requestBody", {})),
        "answers": _content(answer),
        "errors": [
            (status, one["description"])
            for status, one in given["responses"].items()
            if status >= "300"
        ],
    }


def _content(body: dict[str, Any]) -> str:
    """Return the name of the schema, or the content types of a file."""
    content = body.get("content", {})
    schemas = {_type(one["schema"]) for one in content.values()}
    return ", ".join(content if schemas == {"string (binary)"} else schemas)


def _type(schema: dict[str, Any]) -> str:
    """Return the type in a few words; objects by the name of their schema."""
    if "$ref" in schema:
        return str(schema["$ref"].rpartition("/")[2])
    parts = [*schema.get("allOf", ()), *schema.get("oneOf", ()), *schema.get("anyOf", ())]
    if parts:
        return " | ".join(_type(part) for part in parts)
    if "enum" in schema:
        return " | ".join("null" if one is None else str(one) for one in schema["enum"])
    kinds = schema.get("type", "object")
    name = " | ".join(kinds) if isinstance(kinds, list) else str(kinds)
    if name == "array":
        return f"array of {_type(schema.get('items', {}))}"
    return f"{name} ({schema['format']})" if "format" in schema else name
