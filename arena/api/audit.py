"""The log of administrative acts: a list, and files of all that a filter names."""

from __future__ import annotations

from typing import Any
from urllib.parse import urlencode
from uuid import UUID

from django.http import Http404, StreamingHttpResponse
from django.http.response import HttpResponseBase
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import AdminsOnly
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer
from arena.api.files import FileView, describe_file
from arena.api.paging import MOST, USUAL
from arena.api.schema import describe
from arena.exports.audit import AUDIT_FORMATS
from arena.exports.formats import format_named
from arena.queries.audit import MACHINE, AuditFilters, acts
from augment.errors import UnknownName

HIGHEST_OFFSET = 10**9


class ActQuery(StrictSerializer):
    """Which acts; what is left out filters nothing."""

    actor = serializers.CharField(
        max_length=40, required=False, default="", help_text=f"The code of a person, or {MACHINE}."
    )
    verb = serializers.CharField(max_length=60, required=False, default="")
    kind = serializers.CharField(max_length=60, required=False, default="")
    object = serializers.CharField(
        max_length=120, required=False, default="", help_text="Its code, or a study's name."
    )
    since = serializers.DateField(required=False, default=None, help_text="A day.")
    until = serializers.DateField(required=False, default=None, help_text="A day, included.")

    def validate_actor(self, value: str) -> str:
        """Refuse what can be nobody's code."""
        try:
            return value if value in ("", MACHINE) else str(UUID(value))
        except ValueError:
            raise serializers.ValidationError(f"A code, or {MACHINE}.") from None

    def filters(self) -> AuditFilters:
        """As the log is asked, once the query is valid."""
        given = self.validated_data
        return AuditFilters(
            actor=given["actor"],
            verb=given["verb"],
            object_kind=given["kind"],
            object_code=given["object"],
            since=given["since"],
            until=given["until"],
        )


class ActPageQuery(ActQuery):
    """Which page of them."""

    limit = serializers.IntegerField(min_value=1, max_value=MOST, default=USUAL)
    offset = serializers.IntegerField(
        min_value=0, max_value=HIGHEST_OFFSET, default=0, help_text="Passed over, of the newest."
    )
    as_of = serializers.DateTimeField(
        required=False, default=None, help_text="What was done later is left out."
    )


class ActDocument(serializers.Serializer[Any]):
    """One act."""

    at = serializers.DateTimeField()
    actor = serializers.CharField(
        source="actor.person.pseudonym", default=None, allow_null=True, help_text="Null: machine."
    )
    verb = serializers.CharField()
    object_kind = serializers.CharField()
    object_code = serializers.CharField()
    before = serializers.DictField(allow_null=True)
    after = serializers.DictField(allow_null=True)


class ActPage(serializers.Serializer[Any]):
    """Some acts, the newest first."""

    results = ActDocument(many=True)
    next = serializers.CharField(
        allow_null=True, help_text="The address of the next page, null on the last one."
    )


class AuditView(ApiView):
    """The log."""

    permission_classes = (AdminsOnly,)

    @describe(
        "Administrative acts, the newest first",
        answers=ActPage,
        query=ActPageQuery,
        name="listActs",
    )
    def get(self, request: Request) -> Response:
        """Who did what to which, and when; no page has what was done after the first one."""
        query = ActPageQuery(data=request.query_params.dict())
        query.is_valid(raise_exception=True)
        given = query.validated_data
        start, limit, as_of = given["offset"], given["limit"], given["as_of"]
        rows = acts(query.filters())
        if as_of is not None:
            rows = rows.filter(at__lte=as_of)
        found = list(rows[start : start + limit + 1])
        following = None
        if len(found) > limit:
            moment = as_of or found[0].at
            kept = request.query_params.dict() | {
                "offset": str(start + limit),
                "as_of": moment.isoformat(),
            }
            following = f"{request.path}?{urlencode(kept)}"
        shown = ActDocument(found[:limit], many=True).data
        return Response({"results": shown, "next": following})


class AuditFileView(FileView):
    """The log as a file."""

    permission_classes = (AdminsOnly,)
    is_never_cached = True

    @describe_file(
        "Administrative acts as a file",
        types=[one.content_type for one in AUDIT_FORMATS.values()],
        name="exportActs",
        parameters=[ActQuery],
        words={"form": AUDIT_FORMATS},
    )
    def get(self, request: Request, form: str) -> HttpResponseBase:
        """All that the filters name, sent while it is read."""
        query = ActQuery(data=request.query_params.dict())
        query.is_valid(raise_exception=True)
        try:
            chosen = format_named(AUDIT_FORMATS, form)
        except UnknownName as error:
            raise Http404 from error
        return StreamingHttpResponse(
            chosen.parts(acts(query.filters()).iterator()),
            content_type=chosen.content_type,
            headers={"Content-Disposition": f'attachment; filename="audit.{chosen.suffix}"'},
        )
