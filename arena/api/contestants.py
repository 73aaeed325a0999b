"""Contestants and how they ask."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import ADMINS, STAFF
from arena.api.fields import StrictSerializer, TextField
from arena.api.views import ApiView, PageQuery, answer_page, operation, page_of
from augment.models import Contestant
from augment.services.endpoints.contestants import VARIANTS, EnteredEndpoint, enter_contestant
from augment.services.running.transcript_records import contestant_documents

KINDS = [kind.value for kind in Contestant.Kind if kind is not Contestant.Kind.CHECK]


class ContestantQuery(PageQuery):
    """Which contestants."""

    kind = serializers.ChoiceField(choices=KINDS, required=False)
    variant = serializers.ChoiceField(choices=list(VARIANTS), required=False)
    slug = serializers.CharField(max_length=80, required=False)


class ContestantEndpointDocument(serializers.Serializer[Any]):
    """Where a contestant's model is."""

    label = serializers.CharField()  # type: ignore[assignment]
    base_url = serializers.CharField()
    is_simulated = serializers.BooleanField()


class WholeContestantDocument(serializers.Serializer[Any]):
    """A contestant, as in transcripts."""

    code = serializers.UUIDField()
    slug = serializers.CharField()
    name = serializers.CharField()
    kind = serializers.CharField()
    variant = serializers.CharField(allow_null=True)
    model = serializers.CharField(allow_null=True)
    roles = serializers.DictField(help_text="The models of other roles.")
    options = serializers.DictField(help_text="Those that were chosen.")
    frozen_options = serializers.DictField(
        allow_null=True, help_text="All options, from its first run on."
    )
    left_out = serializers.DictField(
        help_text="By role, options that its model does not support and that are not sent."
    )
    sends = serializers.DictField(allow_null=True)
    endpoint = ContestantEndpointDocument(allow_null=True)
    retired_at = serializers.DateTimeField(allow_null=True)


class ContestantBody(StrictSerializer):
    """A new contestant that asks a language model."""

    slug = TextField(max_length=80)
    variant = serializers.ChoiceField(choices=list(VARIANTS))
    endpoint = TextField(max_length=80, help_text="The label of an endpoint.")
    model = TextField(max_length=120, help_text="The model id on the endpoint.")
    name = TextField(max_length=120, required=False, default="", allow_blank=True)
    options = serializers.DictField(required=False, default=dict, help_text="By name.")


class ContestantsView(ApiView):
    """Contestants; attention checks are not among them."""

    readers, writers = STAFF, ADMINS

    @operation(
        "Contestants by slug",
        answers=page_of(WholeContestantDocument),
        query=ContestantQuery,
        name="listContestants",
    )
    def get(self, request: Request, given: dict[str, Any]) -> Response:
        """Retired ones have a date in `retired_at`."""
        rows = Contestant.objects.exclude(kind=Contestant.Kind.CHECK).select_related("endpoint")
        return answer_page(
            request, rows, given, WholeContestantDocument, order="slug", lines=_documents
        )

    @operation(
        "Add a contestant that asks a language model",
        takes=ContestantBody,
        answers=WholeContestantDocument,
        status=201,
        name="createContestant",
    )
    def post(self, request: Request, given: dict[str, Any]) -> dict[str, Any]:
        """The same one twice is one."""
        endpoint = EnteredEndpoint(label=given.pop("endpoint"))
        return _documents([enter_contestant(**given, endpoint=endpoint, actor=self.user)])[0]


def _documents(rows: Sequence[Contestant]) -> list[dict[str, Any]]:
    return [
        document | {"code": row.code, "retired_at": row.retired_at}
        for row, document in zip(rows, contestant_documents(rows), strict=True)
    ]
