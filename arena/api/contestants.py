"""Who contestants are and how they ask."""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from typing import Any, cast

from django.contrib.auth.models import User
from django.db.models import QuerySet
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import AdminsOnly, ReadersAndAdmins, StaffOnly
from arena.api.errors import ApiView
from arena.api.fields import FlagField, StrictSerializer, TextField
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from augment.models import Contestant
from augment.services.endpoints.entering import VARIANTS, EnteredEndpoint, enter_contestant
from augment.services.retirement import retire, take_back
from augment.services.running.transcript_export import contestant_documents

KINDS = [kind for kind in Contestant.Kind if kind is not Contestant.Kind.CHECK]


class ContestantQuery(PageQuery):
    """Which contestants."""

    kind = serializers.ChoiceField(choices=[kind.value for kind in KINDS], required=False)
    variant = serializers.ChoiceField(choices=list(VARIANTS), required=False)
    slug = serializers.CharField(max_length=80, required=False)


class ContestantEndpointDocument(serializers.Serializer[Any]):
    """Where a contestant's model is."""

    label = serializers.CharField()  # type: ignore[assignment]
    base_url = serializers.CharField()
    is_simulated = serializers.BooleanField()


class WholeContestantDocument(serializers.Serializer[Any]):
    """A contestant in full, as transcripts have it."""

    code = serializers.UUIDField()
    slug = serializers.CharField()
    name = serializers.CharField()
    kind = serializers.CharField()
    variant = serializers.CharField(allow_null=True)
    model = serializers.CharField(allow_null=True)
    roles = serializers.DictField(help_text="Who else plays a role.")
    options = serializers.DictField(help_text="Those that were chosen.")
    frozen_options = serializers.DictField(
        allow_null=True, help_text="The whole set since its first run."
    )
    left_out = serializers.DictField(
        help_text="By role, what its models do not take and is not sent."
    )
    sends = serializers.DictField(allow_null=True)
    endpoint = ContestantEndpointDocument(allow_null=True)
    retired_at = serializers.DateTimeField(allow_null=True)


class ContestantBody(StrictSerializer):
    """A new contestant that asks a language model."""

    slug = TextField(max_length=80)
    variant = serializers.ChoiceField(choices=list(VARIANTS))
    endpoint = TextField(max_length=80, help_text="The label of one that is there.")
    model = TextField(max_length=120, help_text="The model id on the endpoint.")
    name = TextField(max_length=120, required=False, default="", allow_blank=True)
    options = serializers.DictField(
        required=False, default=dict, help_text="By name; what is missing stays open."
    )


class RetiredBody(StrictSerializer):
    """Whether forms offer it no more."""

    is_retired = FlagField()


class ContestantsView(ApiView):
    """The contestants by their slug; attention checks are none."""

    permission_classes = (ReadersAndAdmins,)

    @describe(
        "Contestants by slug",
        answers=page_of(WholeContestantDocument),
        query=ContestantQuery,
        name="listContestants",
    )
    def get(self, request: Request) -> Response:
        """In full, and whether they are retired."""
        query = read_query(request, ContestantQuery)
        rows = _contestants()
        for name in ("kind", "variant", "slug"):
            if name in query:
                rows = rows.filter(**{name: query[name]})
        return answer_page(
            request,
            rows,
            query,
            WholeContestantDocument,
            order="slug",
            lines=_documents,
        )

    @describe(
        "Add a contestant that asks a language model",
        takes=ContestantBody,
        answers=WholeContestantDocument,
        status=201,
        name="createContestant",
    )
    def post(self, request: Request) -> Response:
        """The same one twice is one."""
        body = ContestantBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = dict(body.validated_data)
        endpoint = EnteredEndpoint(label=given.pop("endpoint"))
        made = enter_contestant(**given, endpoint=endpoint, actor=cast(User, request.user))
        return Response(WholeContestantDocument(_document(made)).data, status=201)


class ContestantView(ApiView):
    """One contestant."""

    permission_classes = (StaffOnly,)

    @describe("A contestant", answers=WholeContestantDocument, name="getContestant")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """In full."""
        row = get_object_or_404(_contestants(), code=code)
        return Response(WholeContestantDocument(_document(row)).data)


class RetirementView(ApiView):
    """Whether forms offer a contestant."""

    permission_classes = (AdminsOnly,)

    @describe(
        "Retire a contestant or take that back",
        takes=RetiredBody,
        answers=WholeContestantDocument,
        name="retireContestant",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """What it made stays."""
        body = RetiredBody(data=request.data)
        body.is_valid(raise_exception=True)
        row = get_object_or_404(_contestants(), code=code)
        change = retire if body.validated_data["is_retired"] else take_back
        change(row, actor=cast(User, request.user))
        changed = _contestants().get(pk=row.pk)
        return Response(WholeContestantDocument(_document(changed)).data)


def _contestants() -> QuerySet[Contestant]:
    rows = Contestant.objects.exclude(kind=Contestant.Kind.CHECK)
    return rows.select_related("endpoint")


def _documents(rows: Sequence[Contestant]) -> list[dict[str, Any]]:
    return [
        document | {"code": row.code, "retired_at": row.retired_at}
        for row, document in zip(rows, contestant_documents(rows), strict=True)
    ]


def _document(row: Contestant) -> dict[str, Any]:
    return _documents([row])[0]
