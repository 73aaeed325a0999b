"""How the OpenAPI document is made: what every operation has in common is said here once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from drf_spectacular.extensions import OpenApiAuthenticationExtension
from drf_spectacular.openapi import AutoSchema
from drf_spectacular.utils import OpenApiParameter, extend_schema
from rest_framework import serializers

View = TypeVar("View", bound=Callable[..., Any])

JSON = "application/json"
READS = ("GET", "HEAD")
OF_ALL = {
    401: "Not signed in, or the token opens nothing.",
    403: "Not for this role, or the CSRF token is missing.",
    406: "Answers are JSON.",
    422: "The address or the body is wrong; `fields` says where.",
    429: "Too many requests; `Retry-After` says when the next one is taken.",
    503: "The database is busy or its disk is full; `Retry-After` says when to try again.",
}
OF_CHANGES = {
    400: "Refused; the message says why and what is allowed.",
    404: "Nothing at this address, or nothing that this account may know of.",
    409: "It does not fit what is there.",
    410: "Over: the study takes no votes, the labelling no labels, or the link no visitors.",
    413: "The body is larger than 2.5 MB, or a file in it than the installation takes.",
    415: "The body has another form than is said here: JSON, or with files that of browsers.",
}


class BearerScheme(OpenApiAuthenticationExtension):  # type: ignore[no-untyped-call]
    """How the document describes tokens."""

    target_class = "arena.api.authentication.BearerToken"
    name = "token"

    def get_security_definition(self, auto_schema: AutoSchema) -> dict[str, Any]:
        """An HTTP scheme."""
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
    """The one shape of every error."""

    error = ErrorDetail()


class ArenaSchema(AutoSchema):
    """Adds the errors that an operation of its kind can have."""

    def _get_response_bodies(self, direction: Any = "response") -> dict[str, Any]:
        found: dict[str, Any] = super()._get_response_bodies(direction)
        for status, meaning in self._errors().items():
            if str(status) not in found:
                answer: dict[str, Any] = self._get_response_for_code(  # type: ignore[no-untyped-call]
                    ErrorBody, str(status), [JSON]
                )
                found[str(status)] = answer | {"description": meaning}
        if self.method in READS and not getattr(self.view, "is_never_cached", False):
            found["304"] = {"description": "As it was at the ETag that came with the request."}
        return dict(sorted(found.items()))

    def _errors(self) -> dict[int, str]:
        view: Any = self.view
        changes = dict(OF_CHANGES) if self.method not in READS else {}
        if self.method in READS and ("{" in self.path or view.may_miss):
            changes |= {404: OF_CHANGES[404]}
        if self.method in READS:
            changes |= {code: OF_CHANGES[code] for code in view.read_errors}
        shared = dict(OF_ALL)
        if view.is_public:
            del shared[401], shared[403]
        return shared | changes


def describe(
    summary: str,
    *,
    answers: Any,
    takes: Any = None,
    query: type[serializers.Serializer[Any]] | None = None,
    status: int = 200,
    parameters: Iterable[OpenApiParameter] = (),
    name: str | None = None,
) -> Callable[[View], View]:
    """Describe an operation.

    Args:
        summary: A line for people.
        answers: The serializer of the answer's body, `many` where it is a list.
        takes: The serializer of the request's body.
        query: The serializer of the address's parameters.
        status: Of an answer that is no error.
        parameters: Others, of the path for example.
        name: Of the operation, where its address gives no good one.
    """
    asked: list[Any] = [*([query] if query is not None else []), *parameters]
    described: Callable[[View], View] = extend_schema(
        summary=summary,
        request=takes,
        responses={status: answers},
        parameters=asked,
        operation_id=name,
    )
    return described
