"""Models at endpoints: what is known of each, what it costs, and what a probe of it saw."""

from __future__ import annotations

import uuid
from functools import partial
from typing import Any, cast

from django.contrib.auth.models import User
from django.http import Http404
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import ReadersAndAdmins
from arena.api.errors import ApiView
from arena.api.fields import FlagField, StrictSerializer, TextField, WholeNumberField
from arena.api.schema import describe
from arena.api.sending import WarnedDocument, keep_and_send
from arena.queries.probes import probe_lines
from augment.models import EndpointModel, Probe
from augment.services.endpoints import editing
from augment.services.endpoints.editing import ModelFacts
from augment.services.endpoints.entering import REASONING_EFFORTS
from augment.services.endpoints.probing import plan_probe
from augment.tasks import enqueue_probe

HIGHEST_TOKENS = 2**31 - 1


class EndpointModelDocument(serializers.Serializer[Any]):
    """One model of an endpoint; what is null or empty is unknown."""

    code = serializers.UUIDField()
    endpoint = serializers.CharField(source="endpoint.label")
    model = serializers.CharField()
    model_class = serializers.CharField()
    vision = serializers.BooleanField(allow_null=True)
    native_tools = serializers.BooleanField(allow_null=True)
    json_schema = serializers.BooleanField(allow_null=True)
    temperature = serializers.BooleanField(allow_null=True)
    reasoning_effort = serializers.CharField()
    context_tokens = serializers.IntegerField(allow_null=True)
    max_output_tokens = serializers.IntegerField(allow_null=True)
    price_in_usd = serializers.DecimalField(
        None, 6, allow_null=True, help_text="For a million tokens."
    )
    price_out_usd = serializers.DecimalField(None, 6, allow_null=True)
    price_as_of = serializers.DateField(allow_null=True)
    price_source = serializers.CharField()


class ModelBody(StrictSerializer):
    """What somebody knows of a model; what is missing is unknown from then on."""

    model_class = serializers.ChoiceField(
        choices=EndpointModel.ModelClass.values, required=False, default=""
    )
    vision = FlagField(required=False, allow_null=True, default=None)
    native_tools = FlagField(required=False, allow_null=True, default=None)
    json_schema = FlagField(required=False, allow_null=True, default=None)
    temperature = FlagField(
        required=False, allow_null=True, default=None, help_text="Whether it may be chosen."
    )
    reasoning_effort = serializers.ChoiceField(
        choices=list(REASONING_EFFORTS), required=False, default=""
    )
    context_tokens = WholeNumberField(
        required=False, allow_null=True, default=None, min_value=1, max_value=HIGHEST_TOKENS
    )
    max_output_tokens = WholeNumberField(
        required=False, allow_null=True, default=None, min_value=1, max_value=HIGHEST_TOKENS
    )
    price_in_usd = serializers.DecimalField(12, 6, required=False, allow_null=True, default=None)
    price_out_usd = serializers.DecimalField(12, 6, required=False, allow_null=True, default=None)
    price_as_of = serializers.DateField(required=False, allow_null=True, default=None)
    price_source = TextField(max_length=200, required=False, default="", allow_blank=True)


class NewModelBody(StrictSerializer):
    """A model that an endpoint has."""

    model = TextField(max_length=120, help_text="Its id there.")


class ProbeLineDocument(serializers.Serializer[Any]):
    """What one question showed so far."""

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


class ProbeDocument(WarnedDocument):
    """A probe with its six lines."""

    code = serializers.UUIDField()
    state = serializers.CharField(help_text="queued, running, done or failed.")
    reason = serializers.CharField(help_text="Why nothing could be asked.")
    lines = ProbeLineDocument(many=True)
    created_at = serializers.DateTimeField()
    finished_at = serializers.DateTimeField(allow_null=True)


class ModelView(ApiView):
    """One model."""

    permission_classes = (ReadersAndAdmins,)

    @describe("A model of an endpoint", answers=EndpointModelDocument, name="getModel")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """What is known of it."""
        return Response(EndpointModelDocument(_model(code)).data)

    @describe(
        "Say what is known of a model",
        takes=ModelBody,
        answers=EndpointModelDocument,
        name="changeModel",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """It counts for contestants that have not run yet."""
        row = _model(code)
        body = ModelBody(data=request.data)
        body.is_valid(raise_exception=True)
        facts = ModelFacts(**body.validated_data)
        changed = editing.change_model(row, facts=facts, actor=cast(User, request.user))
        return Response(EndpointModelDocument(changed).data)


class ProbeView(ApiView):
    """What a model can do, asked by a worker."""

    permission_classes = (ReadersAndAdmins,)

    @describe("The last probe of a model", answers=ProbeDocument, name="getProbe")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """Line by line while it is made; 404 before the first."""
        row = _model(code)
        found = row.probes.first()
        if found is None:
            raise Http404
        return Response(_probe(row, found))

    @describe("Have a model probed", answers=ProbeDocument, status=202, name="probeModel")
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Ask for it until its state is done or failed."""
        row = _model(code)
        plan = partial(plan_probe, row, actor=cast(User, request.user))
        made, warnings = keep_and_send(plan, enqueue_probe)
        return Response(_probe(row, made) | {"warnings": warnings}, status=202)


# --- Private -----------------------------------------------------------------------------------


def _model(code: uuid.UUID) -> EndpointModel:
    return get_object_or_404(EndpointModel.objects.select_related("endpoint"), code=code)


def _probe(row: EndpointModel, probe: Probe) -> dict[str, Any]:
    found = {name: getattr(probe, name) for name in ("code", "state", "reason")}
    found |= {"created_at": probe.created_at, "finished_at": probe.finished_at}
    return dict(ProbeDocument(found | {"lines": probe_lines(row, probe)}).data)
