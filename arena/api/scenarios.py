"""Scenarios: what contestants are asked to change, and the sets that come with the project."""

from __future__ import annotations

import uuid
from functools import partial
from typing import Any, cast

from django.contrib.auth.models import User
from django.db.models import Q
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import AdminsOnly, StaffOnly
from arena.api.errors import ApiView
from arena.api.fields import FlagField, StrictSerializer, TextField
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from arena.api.sending import WarnedDocument, keep_and_send
from arena.queries.scenarios import OWN
from augment.models import Scenario
from augment.models.scenes import DENSITIES, GOALS
from augment.scene_tasks import enqueue_scenario
from augment.services.endpoints.contestants import ensure_builtin
from augment.services.scenarios.catalogue import load_own_catalogue
from augment.services.scenarios.scenes import (
    INSTRUCTION_LENGTH,
    SLUG_LENGTH,
    add_scenario,
    read_circumstances,
)
from augment.services.scenarios.types import LONGEST_LABEL, LONGEST_TYPE

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
    keep_traffic = serializers.BooleanField()
    density = serializers.CharField(
        source="traffic_density", help_text="none, low, medium or high: of spawned traffic."
    )
    goal = serializers.CharField(help_text="left, right, straight; empty for none.")


class ScenarioBody(StrictSerializer):
    """A new scenario of a scene that is there."""

    scene = TextField(max_length=80, help_text="Its slug.")
    type = TextField(
        max_length=LONGEST_TYPE, help_text="One of the paper's five, or a slug of your own."
    )
    type_label = TextField(
        max_length=LONGEST_LABEL, required=False, help_text="What people read for one of your own."
    )
    instruction = TextField(max_length=INSTRUCTION_LENGTH)
    slug = TextField(max_length=SLUG_LENGTH, required=False, help_text="Made where none is given.")
    reference = serializers.DictField(required=False, help_text="A modification that fits.")
    intent = serializers.DictField(required=False, help_text="What the instruction asks for.")
    keep_traffic = FlagField(required=False, default=False)
    density = serializers.ChoiceField(
        choices=DENSITIES,
        required=False,
        default="none",
        help_text="Of traffic spawned in place of the recorded one.",
    )
    goal = serializers.ChoiceField(
        choices=GOALS, required=False, help_text="Where the ego's way turns."
    )


class NewScenarioDocument(WholeScenarioDocument, WarnedDocument):
    """A scenario after a change."""


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
    kept = serializers.ListField(child=serializers.CharField())


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

    @describe(
        "Add a scenario",
        takes=ScenarioBody,
        answers=NewScenarioDocument,
        status=201,
        name="addScenario",
    )
    def post(self, request: Request) -> Response:
        """A worker draws it."""
        body = ScenarioBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = body.validated_data
        circumstances = read_circumstances(given.pop("density"), given.pop("goal", ""))
        actor = cast(User, request.user)
        add = partial(add_scenario, **given, circumstances=circumstances, actor=actor)
        return Response(changed_scenario(*keep_and_send(add, enqueue_scenario)), status=201)


class ScenarioView(ApiView):
    """One scenario."""

    permission_classes = (StaffOnly,)

    @describe("A scenario", answers=WholeScenarioDocument, name="getScenario")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """With its reference and its intent."""
        return Response(WholeScenarioDocument(find_scenario(code)).data)


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


def find_scenario(code: uuid.UUID) -> Scenario:
    """The scenario of that code, 404 without one."""
    found: Scenario = get_object_or_404(_scenarios(), code=code)
    return found


def changed_scenario(row: Scenario, warnings: list[str]) -> dict[str, Any]:
    """A scenario as it is now, with what did not work."""
    return dict(WholeScenarioDocument(find_scenario(row.code)).data) | {"warnings": warnings}


# --- Private -----------------------------------------------------------------------------------


def _scenarios() -> Any:
    rows = Scenario.objects.select_related("base_scene")
    lean = rows.defer("base_scene__document", "base_scene__recording")
    return lean.annotate(has_reference=Q(reference__isnull=False))
