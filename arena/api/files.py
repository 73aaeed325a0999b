"""Answers that are files: pictures, tables, charts, zips."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from django.http import HttpResponse
from django.utils.text import slugify
from drf_spectacular.types import OpenApiTypes
from drf_spectacular.utils import OpenApiParameter, extend_schema
from rest_framework.request import Request

from arena.api.errors import ApiView
from arena.api.schema import View
from augment.models import GenerationJob

PNG = "image/png"


class FileView(ApiView):
    """Answers with a file whatever the request says it accepts; errors stay JSON."""

    def perform_content_negotiation(self, request: Request, force: bool = False) -> Any:
        """Never 406."""
        return super().perform_content_negotiation(request, force=True)


def describe_file(
    summary: str,
    *,
    types: Iterable[str],
    name: str,
    parameters: Iterable[Any] = (),
    words: dict[str, Iterable[str]] | None = None,
) -> Callable[[View], View]:
    """Describe an operation that answers with a file.

    Args:
        summary: A line for people.
        types: Content types that it can have.
        name: Of the operation.
        parameters: Of the address's query.
        words: By part of the path, what it may be.
    """
    parts = [
        OpenApiParameter(one, OpenApiTypes.STR, OpenApiParameter.PATH, enum=sorted(set(allowed)))
        for one, allowed in (words or {}).items()
    ]
    kinds = {kind.partition(";")[0] for kind in types}
    described: Callable[[View], View] = extend_schema(
        summary=summary,
        operation_id=name,
        parameters=[*parts, *parameters],
        responses={(200, kind): OpenApiTypes.BINARY for kind in sorted(kinds)},
    )
    return described


def as_file(content: bytes, content_type: str, name: str) -> HttpResponse:
    """The file, to be saved under that name."""
    return HttpResponse(
        content,
        content_type=content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


def job_name(job: GenerationJob) -> str:
    """What files of a job begin with."""
    return slugify(job.name) or "job"
