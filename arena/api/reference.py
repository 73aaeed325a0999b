"""The OpenAPI document, for staff."""

from functools import cache
from typing import Any

from django.urls import include, path
from drf_spectacular.generators import SchemaGenerator
from drf_spectacular.utils import extend_schema
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import STAFF
from arena.api.views import ApiView


@cache
def make_document() -> dict[str, Any]:
    """Return the OpenAPI document; it is the same for everybody."""
    patterns = [path("api/v1/", include("arena.site.api_urls"))]
    generator = SchemaGenerator(patterns=patterns)  # type: ignore[no-untyped-call]
    document: dict[str, Any] = generator.get_schema(request=None, public=True)  # type: ignore[no-untyped-call]
    return document


class DocumentView(ApiView):
    """The document; it names variants, which experts must not know."""

    readers = STAFF

    @extend_schema(exclude=True)
    def get(self, request: Request) -> Response:
        """The whole document."""
        return Response(make_document())
