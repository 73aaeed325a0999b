"""Endpoints: where language models are asked. Keys are never told, nor taken."""

from __future__ import annotations

from typing import Any, cast

from django.contrib.auth.models import User
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import ReadersAndAdmins
from arena.api.errors import ApiView
from arena.api.fields import FlagField, StrictSerializer, TextField
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from augment.errors import Conflict
from augment.models import Endpoint
from augment.sentences import sentence
from augment.services.endpoints.known_endpoints import ensure_endpoint


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


class EndpointBody(StrictSerializer):
    """A new endpoint."""

    label = TextField(max_length=80)  # type: ignore[assignment]
    base_url = TextField(max_length=200)
    key_variable = TextField(max_length=80, required=False, default="", allow_blank=True)
    is_simulated = FlagField(required=False, default=False)


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
        given = body.validated_data
        if Endpoint.objects.filter(label=given["label"]).exists():
            raise Conflict(
                sentence("There is an endpoint “%(label)s” already.", label=given["label"])
            )
        made = ensure_endpoint(**given, actor=cast(User, request.user))
        return Response(EndpointDocument(made).data, status=201)
