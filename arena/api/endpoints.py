"""Endpoints: where language models are asked. Keys are never told, nor taken."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django.contrib.auth.models import User
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import AdminsOnly, ReadersAndAdmins
from arena.api.endpoint_models import EndpointModelDocument, NewModelBody
from arena.api.errors import ApiView
from arena.api.fields import FlagField, StrictSerializer, TextField, WholeNumberField
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from augment.models import Endpoint
from augment.services.endpoints import editing
from augment.services.endpoints.editing import EndpointFacts


class EndpointDocument(serializers.Serializer[Any]):
    """One endpoint."""

    code = serializers.UUIDField()
    label = serializers.CharField()  # type: ignore[assignment]
    base_url = serializers.CharField()
    key_variable = serializers.CharField(
        help_text="The environment variable of the workers that holds the key; may be empty."
    )
    is_simulated = serializers.BooleanField()
    max_concurrency = serializers.IntegerField()
    requests_per_minute = serializers.IntegerField(allow_null=True)


class WholeEndpointDocument(EndpointDocument):
    """One endpoint with its models."""

    models = EndpointModelDocument(many=True)


class FactsBody(StrictSerializer):
    """What of an endpoint can be changed."""

    base_url = TextField(max_length=200)
    key_variable = TextField(max_length=80, required=False, default="", allow_blank=True)
    max_concurrency = WholeNumberField(
        required=False, default=4, min_value=1, max_value=editing.HIGHEST_CONCURRENCY
    )
    requests_per_minute = WholeNumberField(
        required=False,
        default=None,
        allow_null=True,
        min_value=1,
        max_value=editing.HIGHEST_PER_MINUTE,
    )


class EndpointBody(FactsBody):
    """A new endpoint; its label and whether it is simulated stay."""

    label = TextField(max_length=80)  # type: ignore[assignment]
    is_simulated = FlagField(required=False, default=False)


class EndpointChangeBody(FactsBody):
    """Another address, key variable or limits."""

    move_key = FlagField(
        required=False, default=False, help_text="Its key may go to another server than so far."
    )


class EndpointsView(ApiView):
    """The endpoints by their label."""

    permission_classes = (ReadersAndAdmins,)

    @describe(
        "Endpoints by label",
        answers=page_of(EndpointDocument),
        query=PageQuery,
        name="listEndpoints",
    )
    def get(self, request: Request) -> Response:
        """Where their models are and how often they may be asked."""
        query = read_query(request, PageQuery)
        rows = Endpoint.objects.all()
        return answer_page(request, rows, query, EndpointDocument, order="label")

    @describe(
        "Add an endpoint",
        takes=EndpointBody,
        answers=EndpointDocument,
        status=201,
        name="createEndpoint",
    )
    def post(self, request: Request) -> Response:
        """One that is there is never moved: others ask it at the address it has."""
        body = EndpointBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = dict(body.validated_data)
        made = editing.add_endpoint(
            label=given.pop("label"),
            is_simulated=given.pop("is_simulated"),
            facts=EndpointFacts(**given),
            actor=cast(User, request.user),
        )
        return Response(EndpointDocument(made).data, status=201)


class EndpointView(ApiView):
    """One endpoint."""

    permission_classes = (ReadersAndAdmins,)

    @describe("An endpoint with its models", answers=WholeEndpointDocument, name="getEndpoint")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """What is known of each, and what it costs."""
        return Response(_whole(code))

    @describe(
        "Change an endpoint",
        takes=EndpointChangeBody,
        answers=WholeEndpointDocument,
        name="changeEndpoint",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """It counts for the next call; what is missing is as for a new one."""
        row = get_object_or_404(Endpoint, code=code)
        body = EndpointChangeBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = dict(body.validated_data)
        may_move_key = given.pop("move_key")
        editing.change_endpoint(
            row,
            facts=EndpointFacts(**given),
            may_move_key=may_move_key,
            actor=cast(User, request.user),
        )
        return Response(_whole(code))


class ModelsView(ApiView):
    """The models of an endpoint."""

    permission_classes = (AdminsOnly,)

    @describe(
        "Note a model of an endpoint",
        takes=NewModelBody,
        answers=EndpointModelDocument,
        status=201,
        name="addModel",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Its listed price comes with it; all else is unknown."""
        row = get_object_or_404(Endpoint, code=code)
        body = NewModelBody(data=request.data)
        body.is_valid(raise_exception=True)
        model = body.validated_data["model"]
        made = editing.add_model(row, model=model, actor=cast(User, request.user))
        return Response(EndpointModelDocument(made).data, status=201)


def _whole(code: uuid.UUID) -> dict[str, Any]:
    rows = Endpoint.objects.prefetch_related("models__endpoint")
    row = get_object_or_404(rows, code=code)
    found = dict(EndpointDocument(row).data)
    return found | {"models": EndpointModelDocument(row.models.all(), many=True).data}
