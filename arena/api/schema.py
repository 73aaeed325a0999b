"""Operations and how the OpenAPI document describes them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from typing import Any

from django.http.response import HttpResponseBase
from drf_spectacular.extensions import OpenApiAuthenticationExtension
from drf_spectacular.openapi import AutoSchema
from drf_spectacular.types import OpenApiTypes
from drf_spectacular.utils import OpenApiParameter, extend_schema
from rest_framework import serializers
from rest_framework.permissions import SAFE_METHODS
from rest_framework.request import Request
from rest_framework.response import Response

JSON = "application/json"
ERRORS = {
    401: "Not signed in, or the token is not valid.",
    403: "Not for this role, or the CSRF token is missing.",
    404: "Nothing at this address, or nothing that this account may know of.",
    406: "Answers are JSON.",
    409: "In conflict with what there is.",
    410: "Over: the study takes no votes, or the link has expired.",
    422: "The address or the body is invalid; `fields` says where.",
    429: "Too many requests; `Retry-After` says when the next one is accepted.",
    503: "The database is busy or its disk is full; `Retry-After` says when to try again.",
}
ERRORS_OF_CHANGES = ERRORS | {
    400: "Refused; the message says why and what is allowed.",
    413: "The body is larger than 2.5 MB, or a file in it than the installation takes.",
    415: "The body is not JSON, or not multipart where files are sent.",
}


class BearerScheme(OpenApiAuthenticationExtension):  # type: ignore[no-untyped-call]
    """How the document describes tokens."""

    target_class = "arena.api.access.BearerToken"
    name = "token"

    def get_security_definition(self, auto_schema: AutoSchema) -> dict[str, Any]:
        """Return an HTTP scheme."""
        return {
            "type": "http",
            "scheme": "bearer",
            "description": "A token of the page “API tokens”.",
        }


class ErrorDetail(serializers.Serializer[Any]):
    """What went wrong."""

    code = serializers.CharField(help_text="For programs.")
    message = serializers.CharField(help_text="A sentence for people.")
    fields = serializers.DictField(  # type: ignore[assignment]
        required=False, help_text="By field, what is wrong with it; with 422."
    )
    outcome = serializers.CharField(required=False, help_text="The stored one; with 409.")


class ErrorBody(serializers.Serializer[Any]):
    """The form of every error."""

    error = ErrorDetail()


class ArenaSchema(AutoSchema):
    """Adds the errors that every operation can have."""

    def _get_response_bodies(self, direction: Any = "response") -> dict[str, Any]:
        found: dict[str, Any] = super()._get_response_bodies(direction)
        reads = self.method in SAFE_METHODS
        for status, meaning in (ERRORS if reads else ERRORS_OF_CHANGES).items():
            answer: dict[str, Any] = self._get_response_for_code(  # type: ignore[no-untyped-call]
                ErrorBody, str(status), [JSON]
            )
            found[str(status)] = answer | {"description": meaning}
        if reads and not getattr(self.view, "is_never_cached", False):
            found["304"] = {"description": "Unchanged since the ETag that came with the request."}
        return dict(sorted(found.items()))


def operation(
    summary: str,
    *,
    name: str,
    answers: Any,
    takes: type[serializers.Serializer[Any]] | None = None,
    query: type[serializers.Serializer[Any]] | None = None,
    status: int = 200,
) -> Callable[[Callable[..., Any]], Callable[..., HttpResponseBase]]:
    """Describe an operation, validate its input, and serialize its result.

    The method gets the validated body or query as `given`. It returns what `answers` serializes,
    beside a list of warnings where workers are involved, or a finished response.

    Args:
        summary: One line for people.
        name: Operation id.
        answers: Serializer of the answer, `many` where it is a list.
        takes: Serializer of the body.
        query: Serializer of the address's parameters.
        status: Of a successful answer.
    """

    def decorate(method: Callable[..., Any]) -> Callable[..., HttpResponseBase]:
        @wraps(method)
        def call(view: Any, request: Request, **path: Any) -> HttpResponseBase:
            if takes is not None:
                path["given"] = validate(takes, request.data)
            elif query is not None:
                path["given"] = validate(query, request.query_params.dict())
            found = method(view, request, **path)
            if isinstance(found, HttpResponseBase):
                return found
            row, warnings = found if isinstance(found, tuple) else (found, [])
            return Response(answers(row, context={"warnings": warnings}).data, status=status)

        described: Callable[..., HttpResponseBase] = extend_schema(
            summary=summary,
            request=takes,
            responses={status: answers},
            parameters=[] if query is None else [query],
            operation_id=name,
        )(call)
        return described

    return decorate


def validate(serializer: type[serializers.Serializer[Any]], data: Any) -> dict[str, Any]:
    """Return the validated input.

    Raises:
        ValidationError: A field is unknown, missing or invalid.
    """
    given = serializer(data=data)
    given.is_valid(raise_exception=True)
    return dict(given.validated_data)


def file_operation(
    summary: str,
    *,
    name: str,
    types: Iterable[str],
    words: Mapping[str, Iterable[str]] | None = None,
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Describe an operation that answers with a file.

    Args:
        summary: One line for people.
        name: Operation id.
        types: Content types that it can have.
        words: By part of the path, its allowed values.
    """
    parts = [
        OpenApiParameter(one, OpenApiTypes.STR, OpenApiParameter.PATH, enum=sorted(set(allowed)))
        for one, allowed in (words or {}).items()
    ]
    kinds = {kind.partition(";")[0] for kind in types}
    described: Callable[[Callable[..., Any]], Callable[..., Any]] = extend_schema(
        summary=summary,
        operation_id=name,
        parameters=parts,
        responses={(200, kind): OpenApiTypes.BINARY for kind in sorted(kinds)},
    )
    return described
