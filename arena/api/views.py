"""The base of every resource: roles, parsing, errors, caching, and work left to a worker."""

import inspect
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial, wraps
from typing import Any, cast
from urllib.parse import urlencode

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import QuerySet
from django.http.response import HttpResponseBase
from django.urls import include, path
from django.views.decorators.cache import never_cache
from django.views.decorators.http import conditional_page
from drf_spectacular.extensions import OpenApiAuthenticationExtension
from drf_spectacular.generators import SchemaGenerator
from drf_spectacular.openapi import AutoSchema
from drf_spectacular.types import OpenApiTypes
from drf_spectacular.utils import OpenApiParameter, extend_schema, inline_serializer
from rest_framework import serializers
from rest_framework.exceptions import ValidationError
from rest_framework.parsers import BaseParser
from rest_framework.permissions import SAFE_METHODS
from rest_framework.renderers import JSONRenderer
from rest_framework.request import Request
from rest_framework.response import Response
from rest_framework.views import APIView

from arena.api.access import STAFF, RoleAllowed
from arena.api.fields import SoundJSONParser, StrictSerializer
from arena.exports.formats import Export
from arena.shell.receipts import StoredAnswer, answer_once, digest_body
from arena.shell.sending import Row, send_on_commit

Params = dict[str, Any]
"""The validated body or query of a request."""


class ApiView(APIView):
    """A resource. Answers to a GET have an ETag; the same one sent back brings 304.

    Attributes:
        readers: Roles that may GET.
        writers: Roles that may POST.
        is_never_cached: Whether answers have no ETag and may not be stored.
    """

    permission_classes: Any = (RoleAllowed,)
    parser_classes: tuple[type[BaseParser], ...] = (SoundJSONParser,)
    readers: tuple[str, ...] = ()
    writers: tuple[str, ...] = ()
    is_never_cached = False

    @classmethod
    def as_view(cls, **initkwargs: Any) -> Any:
        """Return the view, with conditional GETs."""
        view = super().as_view(**initkwargs)
        return never_cache(view) if cls.is_never_cached else conditional_page(view)

    @property
    def user(self) -> User:
        """The account that asks."""
        return cast(User, self.request.user)

    def finalize_response(self, request: Request, response: Any, *args: Any, **kwargs: Any) -> Any:
        """Keep shared caches from storing the response."""
        response.headers.setdefault("Cache-Control", "private, no-cache")
        return super().finalize_response(request, response, *args, **kwargs)

    def answer_page(
        self,
        rows: QuerySet[Row],
        query: Params,
        line: type[serializers.Serializer[Any]],
        *,
        order: str = "-pk",
        lines: Callable[[Sequence[Row]], Sequence[Any]] = list,
    ) -> Response:
        """Return a page of the rows, with the address of the next one.

        No row is lost or repeated while others are added, and no primary key is shown.

        Args:
            rows: All rows of the list, unless `query` names values of their columns.
            query: The validated `PageQuery`; other names in it are columns to filter by.
            line: Serializer of a row.
            order: A unique column; a minus before it for descending order.
            lines: Makes what `line` serializes of all rows of the page at once.

        Raises:
            ValidationError: No row has the code `after`.
        """
        limit, after = query.pop("limit"), query.pop("after", None)
        column, sign = order.removeprefix("-"), "lt" if order.startswith("-") else "gt"
        rows = rows.filter(**query).order_by(order)
        if after is not None:
            last = rows.filter(code=after).values_list(column, flat=True).first()
            if last is None:
                raise ValidationError({"after": ["No row of this list has that code."]})
            rows = rows.filter(**{f"{column}__{sign}": last})
        candidates = list(rows[: limit + 1])
        shown = candidates[:limit]
        body: dict[str, Any] = {"results": line(lines(shown), many=True).data, "next": None}
        if len(candidates) > limit:
            next_query = self.request.query_params.dict() | {"after": str(shown[-1].code)}  # type: ignore[attr-defined]
            body["next"] = f"{self.request.path}?{urlencode(next_query)}"
        return Response(body)


class FileView(ApiView):
    """Answers with a file, whatever the request accepts; errors stay JSON."""

    def perform_content_negotiation(self, request: Request, force: bool = False) -> Any:
        """Never answer 406."""
        return super().perform_content_negotiation(request, force=True)


class RowDocument(serializers.ModelSerializer[Row]):
    """A row of the database, to be read."""

    def get_extra_kwargs(self) -> dict[str, Any]:
        """Mark every column as read-only."""
        return {name: {"read_only": True} for name in self.Meta.fields}


class WarnedDocument(serializers.Serializer[Any]):
    """The result of a change that workers act on."""

    warnings = serializers.SerializerMethodField(
        help_text="What did not work: without a broker it waits until there is one."
    )

    def get_warnings(self, row: Any) -> list[str]:
        """Return the warnings that the request collected."""
        warnings: list[str] = self.context.get("warnings", [])
        return warnings


def keep_and_send(
    keep: Callable[[], Row], send: Callable[[], object] | None = None
) -> tuple[Row, list[str]]:
    """Write a row and, once that is committed, queue its work.

    Args:
        keep: Writes the row.
        send: Queues its work, by default by its kind; a missing broker becomes a warning.

    Returns:
        The row, and the warnings.
    """
    warnings: list[str] = []
    with transaction.atomic():
        row = keep()
        send_on_commit(row, warnings.append, send)
    return row, warnings


# --- Private -----------------------------------------------------------------------------------


JSON = "application/json"
KEY = OpenApiParameter(
    "Idempotency-Key",
    location=OpenApiParameter.HEADER,
    description="Sent again with it within a day, the same body has the same answer.",
)
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
    """Token scheme as the OpenAPI document describes it."""

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
    """Error of a request."""

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
        bodies: dict[str, Any] = super()._get_response_bodies(direction)
        reads = self.method in SAFE_METHODS
        for status, meaning in (ERRORS if reads else ERRORS_OF_CHANGES).items():
            answer: dict[str, Any] = self._get_response_for_code(  # type: ignore[no-untyped-call]
                ErrorBody, str(status), [JSON]
            )
            bodies[str(status)] = answer | {"description": meaning}
        if reads and not getattr(self.view, "is_never_cached", False):
            bodies["304"] = {"description": "Unchanged since the ETag that came with the request."}
        return dict(sorted(bodies.items()))


def operation(
    answers: Any,
    *,
    name: str,
    takes: type[serializers.Serializer[Any]] | None = None,
    query: type[serializers.Serializer[Any]] | None = None,
    status: int = 200,
) -> Callable[[Callable[..., Any]], Callable[..., HttpResponseBase]]:
    """Describe an operation by its docstring, validate its input, and serialize its result.

    The method gets the validated body or query as `params`. It returns what `answers` serializes,
    beside a list of warnings where workers are involved, or a finished response.

    Args:
        answers: Serializer of the answer, `many` where it is a list.
        name: Operation id.
        takes: Serializer of the body.
        query: Serializer of the address's parameters.
        status: Of a successful answer.
    """

    def decorate(method: Callable[..., Any]) -> Callable[..., HttpResponseBase]:
        @wraps(method)
        def call(view: Any, request: Request, **path: Any) -> HttpResponseBase:
            return _answer_once(request, partial(act, view, request, **path))

        def act(view: Any, request: Request, **path: Any) -> HttpResponseBase:
            if takes is not None:
                path["params"] = validate(takes, request.data)
            elif query is not None:
                path["params"] = validate(query, request.query_params.dict())
            result = method(view, **path)
            if isinstance(result, HttpResponseBase):
                return result
            row, warnings = result if isinstance(result, tuple) else (result, [])
            return Response(answers(row, context={"warnings": warnings}).data, status=status)

        described: Callable[..., HttpResponseBase] = extend_schema(
            **_texts(method),
            request=takes,
            responses={status: answers},
            parameters=[KEY] if query is None else [query],
            operation_id=name,
        )(call)
        return described

    return decorate


def _answer_once(request: Request, act: Callable[[], HttpResponseBase]) -> HttpResponseBase:
    """Answer a POST with a key once, and then the same."""
    key = request.headers.get(KEY.name, "")
    if not key or request.method in SAFE_METHODS:
        return act()

    def pack(answer: HttpResponseBase) -> tuple[int, bytes] | None:
        if not isinstance(answer, Response) or answer.status_code >= 300:
            return None
        return answer.status_code, JSONRenderer().render(answer.data)

    body = digest_body([request.path, digest_body(request.data)])
    answer = answer_once(f"api {request.user.pk} {key}", body, act, pack)
    if isinstance(answer, StoredAnswer):
        return Response(json.loads(answer.content), status=answer.status)
    return answer


def _texts(method: Callable[..., Any]) -> dict[str, Any]:
    """Return the first line and the rest of a docstring as summary and description."""
    summary, _, description = (inspect.getdoc(method) or "").partition("\n\n")
    return {"summary": summary.rstrip("."), "description": description}


def validate(serializer: type[serializers.Serializer[Any]], data: Any) -> dict[str, Any]:
    """Return the validated input.

    Raises:
        ValidationError: A field is unknown, missing or invalid.
    """
    checked = serializer(data=data)
    checked.is_valid(raise_exception=True)
    return dict(checked.validated_data)


def file_operation(
    *, name: str, types: Iterable[str] = (), exports: Mapping[str, Export] | None = None
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Describe an operation that answers with a file, by its docstring.

    Args:
        name: Operation id.
        types: Content types that it can have.
        exports: What the `name` and the `form` in its path choose from.
    """
    exports = exports or {}
    formats = {name: form for export in exports.values() for name, form in export.formats.items()}
    parts = [
        OpenApiParameter(part, OpenApiTypes.STR, OpenApiParameter.PATH, enum=sorted(allowed))
        for part, allowed in (("name", exports), ("form", formats))
        if exports
    ]
    types = (*types, *(form.content_type for form in formats.values()))
    kinds = sorted({kind.partition(";")[0] for kind in types})
    responses = {(200, kind): OpenApiTypes.BINARY for kind in kinds}

    def decorate(method: Callable[..., Any]) -> Callable[..., Any]:
        described: Callable[..., Any] = extend_schema(
            **_texts(method), operation_id=name, parameters=parts, responses=responses
        )(method)
        return described

    return decorate


USUAL, MOST = 100, 500


class PageQuery(StrictSerializer):
    """Page of a list."""

    limit = serializers.IntegerField(
        min_value=1, max_value=MOST, default=USUAL, help_text="Rows of a page."
    )
    after = serializers.UUIDField(
        required=False, help_text="The code of the last row of the page before."
    )


@cache
def page_serializer(line: type[serializers.Serializer[Any]]) -> serializers.Serializer[Any]:
    """Return the serializer of a page, for the document."""
    return inline_serializer(
        name=line.__name__.removesuffix("Document") + "Page",
        fields={
            "results": line(many=True),
            "next": serializers.CharField(
                allow_null=True, help_text="The address of the next page, null on the last one."
            ),
        },
    )


# --- The document ------------------------------------------------------------------------------


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
