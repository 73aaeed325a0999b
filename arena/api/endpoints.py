"""Endpoints, their models, and probes of what a model can do. Keys are never sent or accepted."""

from __future__ import annotations

import uuid
from functools import partial
from typing import Any

from django.http import Http404
from django.shortcuts import get_object_or_404
from drf_spectacular.utils import extend_schema_field
from rest_framework import serializers
from rest_framework.request import Request

from arena.api.access import ADMINS, STAFF
from arena.api.fields import FlagField, StrictSerializer, TextField, WholeNumberField
from arena.api.views import ApiView, WarnedDocument, keep_and_send, operation
from arena.contestants.queries import probe_lines
from augment.models import Endpoint, EndpointModel, Probe
from augment.services.endpoints import known_endpoints
from augment.services.endpoints.known_endpoints import EndpointFacts
from augment.services.endpoints.probing import plan_probe
from augment.tasks import enqueue_probe


class EndpointDocument(serializers.ModelSerializer[Endpoint]):
    """An endpoint; `key_variable` names an environment variable of the workers."""

    class Meta:
        model = Endpoint
        fields = (
            *("code", "label", "base_url", "key_variable", "is_simulated"),
            *("max_concurrency", "requests_per_minute"),
        )
        read_only_fields = fields


class EndpointBody(StrictSerializer):
    """A new endpoint."""

    label = TextField(max_length=80)  # type: ignore[assignment]
    is_simulated = FlagField(required=False, default=False)
    base_url = TextField(max_length=200)
    key_variable = TextField(max_length=80, required=False, default="", allow_blank=True)
    max_concurrency = WholeNumberField(
        required=False, default=4, min_value=1, max_value=known_endpoints.HIGHEST_CONCURRENCY
    )
    requests_per_minute = WholeNumberField(
        required=False,
        default=None,
        allow_null=True,
        min_value=1,
        max_value=known_endpoints.HIGHEST_PER_MINUTE,
    )


class EndpointModelDocument(serializers.ModelSerializer[EndpointModel]):
    """A model of an endpoint; null or empty is unknown. Prices are for a million tokens."""

    endpoint = serializers.CharField(source="endpoint.label")
    model_class = serializers.CharField(allow_blank=True)

    class Meta:
        model = EndpointModel
        fields = (
            *("code", "endpoint", "model", "model_class", "vision", "native_tools", "json_schema"),
            *("temperature", "reasoning_effort", "context_tokens", "max_output_tokens"),
            *("price_in_usd", "price_out_usd", "price_as_of", "price_source"),
        )
        read_only_fields = fields


class NewModelBody(StrictSerializer):
    """A model that an endpoint has."""

    model = TextField(max_length=120, help_text="Its id there.")


class ProbeLineDocument(serializers.Serializer[Any]):
    """The result of one question so far."""

    ability = serializers.CharField()
    progress = serializers.CharField(
        help_text="asked, asking, waiting, or left where it was not asked."
    )
    has_it = serializers.BooleanField(
        allow_null=True, help_text="Null where the answer does not tell."
    )
    note = serializers.CharField()
    model_returned = serializers.CharField()
    tokens = serializers.IntegerField(allow_null=True)
    latency_s = serializers.FloatField(allow_null=True)
    cost_usd = serializers.DecimalField(None, 9, allow_null=True)


class ProbeDocument(serializers.ModelSerializer[Probe], WarnedDocument):
    """A probe with a line for each ability."""

    lines = serializers.SerializerMethodField()

    class Meta:
        model = Probe
        fields = ("code", "state", "reason", "lines", "created_at", "finished_at", "warnings")
        read_only_fields = fields

    @extend_schema_field(ProbeLineDocument(many=True))
    def get_lines(self, probe: Probe) -> Any:
        """Return the lines, those to come included."""
        return ProbeLineDocument(probe_lines(probe.model, probe), many=True).data


class EndpointsView(ApiView):
    """Endpoints."""

    writers = ADMINS

    @operation(
        "Add an endpoint",
        takes=EndpointBody,
        answers=EndpointDocument,
        status=201,
        name="createEndpoint",
    )
    def post(self, request: Request, given: dict[str, Any]) -> Endpoint:
        """409 where the label is taken."""
        return known_endpoints.add_endpoint(
            label=given.pop("label"),
            is_simulated=given.pop("is_simulated"),
            facts=EndpointFacts(**given),
            actor=self.user,
        )


class ModelsView(ApiView):
    """The models of an endpoint."""

    writers = ADMINS

    @operation(
        "Add a model to an endpoint",
        takes=NewModelBody,
        answers=EndpointModelDocument,
        status=201,
        name="addModel",
    )
    def post(self, request: Request, code: uuid.UUID, given: dict[str, Any]) -> EndpointModel:
        """Comes with its listed price; all else is unknown before a probe."""
        row = get_object_or_404(Endpoint, code=code)
        return known_endpoints.add_model(row, model=given["model"], actor=self.user)


class ProbeView(ApiView):
    """What a model can do, asked by a worker."""

    readers, writers = STAFF, ADMINS

    @operation("The last probe of a model", answers=ProbeDocument, name="getProbe")
    def get(self, request: Request, code: uuid.UUID) -> Probe:
        """Line by line while it runs; 404 before the first."""
        found = _model(code).probes.first()
        if found is None:
            raise Http404
        return found

    @operation("Have a model probed", answers=ProbeDocument, status=202, name="probeModel")
    def post(self, request: Request, code: uuid.UUID) -> tuple[Probe, list[str]]:
        """Poll it until its state is done or failed."""
        return keep_and_send(partial(plan_probe, _model(code), actor=self.user), enqueue_probe)


def _model(code: uuid.UUID) -> EndpointModel:
    return get_object_or_404(EndpointModel.objects.select_related("endpoint"), code=code)
