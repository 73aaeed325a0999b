"""Drives: a planner in a scene before or after its change."""

from __future__ import annotations

import uuid
from functools import partial
from typing import Any

from django.db import transaction
from django.http import Http404
from django.http.response import HttpResponseBase
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import ReadersAndAdmins, StaffOnly
from arena.api.errors import ApiView
from arena.api.fields import CodeField, FlagField, StrictSerializer
from arena.api.files import FileView, as_file, describe_file
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from arena.queries.driving import before_of
from augment.errors import QueueFault
from augment.models import GenerationJob, Simulation
from augment.services.judging import simulations
from augment.services.judging.drive_files import FILES, drive_file
from augment.services.judging.simulations import Options
from augment.services.wording import translate
from augment.tasks import enqueue_simulations

PLANNERS = ("pdm-closed", "idm")
OFFSETS = ("paper", "original")


class SimulationQuery(PageQuery):
    """Which drives."""

    job = serializers.UUIDField(required=False, help_text="Those of a job's augmentations.")
    scenario = serializers.CharField(max_length=80, required=False, help_text="A slug.")
    state = serializers.ChoiceField(choices=Simulation.State.values, required=False)
    planner = serializers.ChoiceField(choices=PLANNERS, required=False)


class SimulationDocument(serializers.Serializer[Any]):
    """One drive."""

    code = serializers.UUIDField()
    scenario = serializers.CharField(source="scenario.slug")
    subject = serializers.CharField(help_text="unmodified, reference or augmentation.")
    augmentation = serializers.UUIDField(source="augmentation.code", allow_null=True, default=None)
    planner = serializers.CharField()
    offsets = serializers.CharField()
    is_reactive = serializers.BooleanField()
    state = serializers.CharField()
    reason = serializers.CharField()
    nuplan_score = serializers.FloatField(allow_null=True)
    interplan_score = serializers.FloatField(allow_null=True)
    finished_at = serializers.DateTimeField(allow_null=True)


class WholeSimulationDocument(SimulationDocument):
    """One drive with the parts of its scores."""

    document = serializers.DictField(allow_null=True)


class SimulationBody(StrictSerializer):
    """What is to be driven, and how."""

    job = CodeField()
    planner = serializers.ChoiceField(choices=PLANNERS, required=False, default=PLANNERS[0])
    offsets = serializers.ChoiceField(choices=OFFSETS, required=False, default=OFFSETS[0])
    is_reactive = FlagField(required=False, default=False)


class QueuedDocument(serializers.Serializer[Any]):
    """What waits now."""

    queued = serializers.IntegerField()
    warnings = serializers.ListField(child=serializers.CharField())


class SimulationsView(ApiView):
    """The drives, the youngest first."""

    permission_classes = (ReadersAndAdmins,)

    @describe(
        "Drives, the youngest first",
        answers=page_of(SimulationDocument),
        query=SimulationQuery,
        name="listSimulations",
    )
    def get(self, request: Request) -> Response:
        """Without the parts of their scores."""
        query = read_query(request, SimulationQuery)
        paths = {
            "job": "augmentation__job__code",
            "scenario": "scenario__slug",
            "state": "state",
            "planner": "planner",
        }
        chosen = {path: query[name] for name, path in paths.items() if name in query}
        rows = _simulations().defer("document", "trace").filter(**chosen)
        return answer_page(request, rows, query, SimulationDocument)

    @describe(
        "Have a job's results driven",
        takes=SimulationBody,
        answers=QueuedDocument,
        status=202,
        name="simulateJob",
    )
    def post(self, request: Request) -> Response:
        """What was driven so already stays; what failed waits again."""
        body = SimulationBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = dict(body.validated_data)
        job = get_object_or_404(GenerationJob, code=given.pop("job"))
        if given["planner"] != PLANNERS[0]:
            given["offsets"] = OFFSETS[0]  # they are those of PDM-Closed
        options = Options(**given)
        warnings: list[str] = []
        with transaction.atomic():
            waiting = simulations.plan_job(job=job, options=options)
            transaction.on_commit(partial(_send, warnings, waiting))
        return Response({"queued": len(waiting), "warnings": warnings}, status=202)


class SimulationView(ApiView):
    """One drive."""

    permission_classes = (StaffOnly,)

    @describe("A drive", answers=WholeSimulationDocument, name="getSimulation")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """With the parts of its scores."""
        row = get_object_or_404(_simulations().defer("trace"), code=code)
        return Response(WholeSimulationDocument(row).data)


class SimulationFileView(FileView):
    """A drive to look at."""

    permission_classes = (StaffOnly,)

    @describe_file(
        "A drive as data, moving picture or strip",
        types=FILES.values(),
        name="getSimulationFile",
        words={"form": FILES},
    )
    def get(self, request: Request, code: uuid.UUID, form: str) -> HttpResponseBase:
        """Once it is done."""
        row = get_object_or_404(_simulations(), code=code)
        if row.state != Simulation.State.DONE or form not in FILES:
            raise Http404
        content = drive_file(row, form, before=None if form == "json" else before_of(row))
        return as_file(content, FILES[form], f"{row.scenario.slug}.{form}")


def _simulations() -> Any:
    return Simulation.objects.select_related("scenario", "augmentation").defer(
        "scenario__reference", "augmentation__modification"
    )


def _send(warnings: list[str], waiting: list[int]) -> None:
    try:
        enqueue_simulations(waiting)
    except QueueFault as error:
        warnings.append(translate(error))
