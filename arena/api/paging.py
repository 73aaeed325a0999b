"""Lists in pages: `?after=CODE` of the last row before, and `next` with that in it.

No row is lost or repeated while others are added, and no primary key is shown.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
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


def answer_page(
    request: Request,
    rows: QuerySet[Row],
    query: dict[str, Any],
    line: type[serializers.Serializer[Any]],
    *,
    order: str = "-pk",
    lines: Callable[[Sequence[Row]], Sequence[Any]] = list,
) -> Response:
    """Return a page of the rows.

    Args:
        request: Its address is that of the next page.
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
    found = list(rows[: limit + 1])
    shown = found[:limit]
    body: dict[str, Any] = {"results": line(lines(shown), many=True).data, "next": None}
    if len(found) > limit:
        kept = request.query_params.dict() | {"after": str(shown[-1].code)}  # type: ignore[attr-defined]
        body["next"] = f"{request.path}?{urlencode(kept)}"
    return Response(body)
