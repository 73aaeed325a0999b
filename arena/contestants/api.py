"""Contestants and how they ask."""

import uuid
from functools import partial
from typing import Any

from django.http import Http404
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.response import Response

from arena.api import views
from arena.api.access import ADMINS, STAFF
from arena.api.fields import RequestBody, StrictSerializer, TextField
from arena.contestants.queries import probe_lines
from augment.models import Contestant, Endpoint, EndpointModel, Probe
from augment.services import endpoints

KINDS = [kind.value for kind in Contestant.Kind if kind is not Contestant.Kind.CHECK]


class ContestantQuery(views.PageQuery):
    """Filter of a list of contestants."""

    kind = serializers.ChoiceField(choices=KINDS, required=False)
    variant = serializers.ChoiceField(choices=list(endpoints.VARIANTS), required=False)
    slug = serializers.CharField(max_length=80, required=False)


class ContestantDocument(views.RowDocument[Contestant]):
    """A contestant; `frozen_options` are all of its options, from its first run on."""

    endpoint = serializers.CharField(source="endpoint.label", default=None, allow_null=True)
    frozen_options = serializers.DictField(allow_null=True, read_only=True)
    sends = serializers.DictField(allow_null=True, read_only=True)

    class Meta:
        model = Contestant
        fields = (
            *("code", "slug", "name", "kind", "variant", "endpoint", "model", "roles"),
            *("options", "frozen_options", "retired_at", "sends"),
        )


class ContestantBody(RequestBody):
    """A new contestant that asks a language model."""

    request = endpoints.ContestantRequest
    options = serializers.DictField(required=False, default=dict, help_text="By name.")


class ContestantsView(views.ApiView):
    """Contestants; attention checks are not among them."""

    readers, writers = STAFF, ADMINS

    @views.operation(
        views.page_serializer(ContestantDocument), query=ContestantQuery, name="listContestants"
    )
    def get(self, params: views.Params) -> Response:
        """Contestants by slug.

        Retired ones have a date in `retired_at`.
        """
        rows = Contestant.objects.exclude(kind=Contestant.Kind.CHECK).select_related("endpoint")
        return self.answer_page(rows, params, ContestantDocument, order="slug")

    @views.operation(ContestantDocument, takes=ContestantBody, status=201, name="createContestant")
    def post(self, params: views.Params) -> Contestant:
        """Add a contestant that asks a language model.

        The same one twice is one.
        """
        return endpoints.add_contestant(endpoints.ContestantRequest(**params), self.user)


class EndpointDocument(views.RowDocument[Endpoint]):
    """An endpoint; `key_variable` names an environment variable of the workers."""

    class Meta:
        model = Endpoint
        fields = (
            *("code", "label", "base_url", "key_variable", "is_simulated"),
            *("max_concurrency", "requests_per_minute"),
        )


class EndpointBody(RequestBody):
    """A new endpoint."""

    request = endpoints.EndpointRequest


class EndpointModelDocument(views.RowDocument[EndpointModel]):
    """A model of an endpoint; null or empty is unknown. Prices are for a million tokens."""

    endpoint = serializers.CharField(source="endpoint.label")
    model_class = serializers.CharField(allow_blank=True)

    class Meta:
        model = EndpointModel
        fields = (
            *("code", "endpoint", "model", "model_class", "vision", "native_tools"),
            *("temperature", "reasoning_effort", "context_tokens", "max_output_tokens"),
            *("price_in_usd", "price_out_usd", "price_as_of", "price_source", "price_cached_usd"),
        )


class NewModelBody(StrictSerializer):
    """A model that an endpoint has."""

    model = TextField(max_length=120, help_text="Its id there.")


class ProbeDocument(views.RowDocument[Probe], views.WarnedDocument):
    """A probe with a line for each ability, those to come included."""

    lines = serializers.SerializerMethodField()

    class Meta:
        model = Probe
        fields = ("code", "state", "reason", "lines", "created_at", "finished_at", "warnings")

    def get_lines(self, probe: Probe) -> list[dict[str, Any]]:
        """Return whether the model has each ability, and what it said."""
        return probe_lines(probe.model, probe)


class EndpointsView(views.ApiView):
    """Endpoints."""

    writers = ADMINS

    @views.operation(EndpointDocument, takes=EndpointBody, status=201, name="createEndpoint")
    def post(self, params: views.Params) -> Endpoint:
        """Add an endpoint.

        409 where the label is taken.
        """
        return endpoints.add_endpoint(endpoints.EndpointRequest(**params), self.user)


class ModelsView(views.ApiView):
    """The models of an endpoint."""

    writers = ADMINS

    @views.operation(EndpointModelDocument, takes=NewModelBody, status=201, name="addModel")
    def post(self, code: uuid.UUID, params: views.Params) -> EndpointModel:
        """Add a model to an endpoint and have it probed.

        Comes with its listed price; all else is unknown before the probe's end.
        """
        row = get_object_or_404(Endpoint, code=code)
        plan = partial(endpoints.add_model, row, model=params["model"], actor=self.user)
        return views.keep_and_send(plan)[0].model


class ProbeView(views.ApiView):
    """Probe of a model's abilities, carried out by a worker."""

    readers, writers = STAFF, ADMINS

    @views.operation(ProbeDocument, name="getProbe")
    def get(self, code: uuid.UUID) -> Probe:
        """The last probe of a model.

        Line by line while it runs; 404 before the first.
        """
        probe = _model(code).probes.first()
        if probe is None:
            raise Http404
        return probe

    @views.operation(ProbeDocument, status=202, name="probeModel")
    def post(self, code: uuid.UUID) -> tuple[Probe, list[str]]:
        """Have a model probed.

        Poll it until its state is done or failed.
        """
        return views.keep_and_send(partial(endpoints.plan_probe, _model(code), actor=self.user))


def _model(code: uuid.UUID) -> EndpointModel:
    return get_object_or_404(EndpointModel.objects.select_related("endpoint"), code=code)
