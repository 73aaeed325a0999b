"""Lists in pages: `?after=CODE` of the last row of the page before, and `next` with that in it.

No row is lost or shown twice where rows are added meanwhile, and no key of the database is told.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, TypeVar
from urllib.parse import urlencode

from django.db.models import Model, QuerySet
from drf_spectacular.utils import inline_serializer
from rest_framework import serializers
from rest_framework.exceptions import ValidationError
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.fields import StrictSerializer

Row = TypeVar("Row", bound=Model)

USUAL, MOST = 100, 500


class PageQuery(StrictSerializer):
    """Which page of a list."""

    limit = serializers.IntegerField(
        min_value=1, max_value=MOST, default=USUAL, help_text="Rows of a page."
    )
    after = serializers.UUIDField(
        required=False, help_text="The code of the last row of the page before."
    )


@cache
def page_of(line: type[serializers.Serializer[Any]]) -> serializers.Serializer[Any]:
    """The body of a page, for the document."""
    return inline_serializer(
        name=line.__name__.removesuffix("Document") + "Page",
        fields={
            "results": line(many=True),
            "next": serializers.CharField(
                allow_null=True, help_text="The address of the next page, null on the last one."
            ),
        },
    )


def read_query(request: Request, query: type[StrictSerializer]) -> dict[str, Any]:
    """The parameters of the address.

    Raises:
        ValidationError: One is unknown or wrong.
    """
    given = query(data=request.query_params.dict())
    given.is_valid(raise_exception=True)
    found: dict[str, Any] = given.validated_data
    return found


def answer_page(
    request: Request,
    rows: QuerySet[Row],
    query: dict[str, Any],
    line: type[serializers.Serializer[Any]],
    *,
    order: str = "-pk",
    lines: Callable[[Sequence[Row]], Sequence[Any]] | None = None,
    context: Mapping[str, Any] | None = None,
) -> Response:
    """A page of the rows.

    Args:
        request: Whose address the next page's has.
        rows: All that are asked for.
        query: As `PageQuery` or a part of it has them.
        line: What is told of each.
        order: A unique column, a minus before it where the greatest comes first.
        lines: What `line` is told of, made of all rows of the page at once.
        context: What `line` is told besides.

    Raises:
        ValidationError: No row has the code that the page is to begin after.
    """
    column, sign = order.removeprefix("-"), "lt" if order.startswith("-") else "gt"
    limit = query["limit"]
    rows = rows.order_by(order)
    if "after" in query:
        last = rows.filter(code=query["after"]).values_list(column, flat=True).first()
        if last is None:
            raise ValidationError({"after": ["No row of this list has that code."]})
        rows = rows.filter(**{f"{column}__{sign}": last})
    found = list(rows[: limit + 1])
    shown = found[:limit]
    body: dict[str, Any] = {
        "results": line(
            shown if lines is None else lines(shown), many=True, context=dict(context or {})
        ).data,
        "next": None,
    }
    if len(found) > limit:
        kept = request.query_params.dict() | {"after": str(shown[-1].code)}  # type: ignore[attr-defined]
        body["next"] = f"{request.path}?{urlencode(kept)}"
    return Response(body)
