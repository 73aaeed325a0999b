"""Scenarios: what contestants are asked to change, and the sets that come with the project."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django.contrib.auth.models import User
from django.db.models import Q
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import AdminsOnly, StaffOnly
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from arena.queries.scenarios import OWN
from augment.models import Scenario
from augment.services.endpoints.contestants import ensure_builtin
from augment.services.scenarios.catalogue import load_own_catalogue

SETS = (*Scenario.SETS, OWN)


class ScenarioQuery(PageQuery):
    """Which scenarios."""

    set = serializers.ChoiceField(
        choices=SETS, required=False, help_text="`own` are those in no set of the catalogue."
    )
    type = serializers.CharField(max_length=40, required=False)
    slug = serializers.CharField(max_length=80, required=False)


class ScenarioDocument(serializers.Serializer[Any]):
    """One scenario of a list."""

    code = serializers.UUIDField()
    slug = serializers.CharField()
    type = serializers.CharField()
    set = serializers.CharField(source="catalogue_set")
    instruction = serializers.CharField()
    scene = serializers.CharField(source="base_scene.slug")
    has_reference = serializers.BooleanField()


class WholeScenarioDocument(ScenarioDocument):
    """One scenario with its documents; their forms are those of the files on its page."""

    reference = serializers.DictField(allow_null=True, help_text="The reference modification.")
    intent = serializers.DictField(allow_null=True, help_text="What the instruction asks for.")


class CatalogueBody(StrictSerializer):
    """Which set to load."""

    set = serializers.ChoiceField(choices=list(Scenario.SETS))


class CatalogueDocument(serializers.Serializer[Any]):
    """What loading changed."""

    scenes_added = serializers.IntegerField()
    scenes_changed = serializers.IntegerField()
    scenes_unchanged = serializers.IntegerField()
    scenarios_added = serializers.IntegerField()
    scenarios_changed = serializers.IntegerField()
    scenarios_unchanged = serializers.IntegerField()


class ScenariosView(ApiView):
    """The scenarios by their slug."""

    permission_classes = (StaffOnly,)

    @describe(
        "Scenarios by slug",
        answers=page_of(ScenarioDocument),
        query=ScenarioQuery,
        name="listScenarios",
    )
    def get(self, request: Request) -> Response:
        """Without their scenes, references and intents."""
        query = read_query(request, ScenarioQuery)
        rows = _scenarios().defer("reference", "intent")
        for name in ("type", "slug"):
            if name in query:
                rows = rows.filter(**{name: query[name]})
        if "set" in query:
            rows = rows.filter(catalogue_set="" if query["set"] == OWN else query["set"])
        return answer_page(request, rows, query, ScenarioDocument, order="slug")


class ScenarioView(ApiView):
    """One scenario."""

    permission_classes = (StaffOnly,)

    @describe("A scenario", answers=WholeScenarioDocument, name="getScenario")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """With its reference and its intent."""
        return Response(WholeScenarioDocument(get_object_or_404(_scenarios(), code=code)).data)


class CatalogueView(ApiView):
    """What comes with the project."""

    permission_classes = (AdminsOnly,)

    @describe(
        "Load a set of scenarios that comes with the project",
        takes=CatalogueBody,
        answers=CatalogueDocument,
        name="loadCatalogue",
    )
    def post(self, request: Request) -> Response:
        """All of it or nothing; twice changes nothing. Also makes those who ask nobody."""
        body = CatalogueBody(data=request.data)
        body.is_valid(raise_exception=True)
        actor = cast(User, request.user)
        report = load_own_catalogue(sets=[body.validated_data["set"]], actor=actor)
        ensure_builtin()
        return Response(CatalogueDocument(report).data)


def _scenarios() -> Any:
    rows = Scenario.objects.select_related("base_scene")
    lean = rows.defer("base_scene__document", "base_scene__recording")
    return lean.annotate(has_reference=Q(reference__isnull=False))
