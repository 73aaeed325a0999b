"""Scenarios after they were made, and many at once: references, intents, readings, checks."""

from __future__ import annotations

import uuid
from functools import partial
from typing import Any, cast

from django.contrib.auth.models import User
from django.http import Http404
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import ReadersAndAdmins, StaffOnly
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer, TextField
from arena.api.scenarios import (
    NewScenarioDocument,
    WholeScenarioDocument,
    changed_scenario,
    find_scenario,
)
from arena.api.schema import describe
from arena.api.sending import FormView, WarnedDocument, keep_and_send, refuse_cut_files
from arena.services.references import drop_reference, set_reference
from augment.models import IntentReading
from augment.scene_tasks import enqueue_scenario
from augment.services.judging.edits import check_edit
from augment.services.judging.findings import FindingLine
from augment.services.running.intent_readings import plan_reading
from augment.services.scenarios.bulk_files import MOST_FILES, add_from_files
from augment.services.scenarios.intents import accept_reading, enter_intent, last_reading
from augment.services.wording import translate
from augment.tasks import enqueue_reading


class BulkBody(StrictSerializer):
    """A list of scenarios, and the documents that it names."""

    file = serializers.FileField(help_text="CSV or YAML.")
    documents = serializers.ListField(
        child=serializers.FileField(),
        required=False,
        default=list,
        max_length=MOST_FILES,
        help_text="JSON files of references and intents.",
    )
    only_try = serializers.BooleanField(
        required=False, default=False, help_text="Nothing is added then."
    )


class BulkRowDocument(serializers.Serializer[Any]):
    """What became of one row."""

    number = serializers.IntegerField(help_text="From 1.")
    slug = serializers.CharField(help_text="Of its scenario; empty where there is none.")
    problems = serializers.ListField(
        child=serializers.ListField(child=serializers.CharField(allow_blank=True)),
        help_text="Which column is wrong, empty for the whole row, and why.",
    )


class BulkDocument(serializers.Serializer[Any]):
    """What became of a list: all of its rows were added, or none."""

    is_kept = serializers.BooleanField()
    rows = BulkRowDocument(many=True)


class ReferenceBody(StrictSerializer):
    """The reference that a scenario is to have."""

    reference = serializers.DictField(allow_null=True, help_text="Null to drop it.")


class IntentBody(StrictSerializer):
    """The intent that a scenario is to have."""

    intent = serializers.DictField()


class ReaderBody(StrictSerializer):
    """Which model is to read the instruction."""

    endpoint = TextField(max_length=80, help_text="The label of one that is there.")
    model = TextField(max_length=120)


class ReadingDocument(WarnedDocument):
    """What a model read in an instruction; it counts for nothing until it is accepted."""

    code = serializers.UUIDField()
    state = serializers.CharField(help_text="running, read, accepted or failed.")
    endpoint = serializers.CharField(source="endpoint.label")
    model = serializers.CharField()
    document = serializers.DictField(allow_null=True, help_text="The intent.")
    reason = serializers.CharField(help_text="Why nothing was read.")
    created_at = serializers.DateTimeField()


class EditBody(StrictSerializer):
    """A change that is being made."""

    modification = serializers.DictField()
    snap = TextField(
        max_length=80,
        required=False,
        default="",
        allow_blank=True,
        help_text="The id of an agent to be put on the nearest centreline first.",
    )


class FindingDocument(serializers.Serializer[Any]):
    """One thing that the checks found."""

    severity = serializers.CharField(help_text="wrong, doubtful or fact.")
    kind = serializers.CharField()
    sentence = serializers.SerializerMethodField()

    def get_sentence(self, line: FindingLine) -> str:
        """In the language of the request."""
        return line.finding.sentence(say=translate)


class CheckedDocument(serializers.Serializer[Any]):
    """A change as it would be kept, and what the checks find."""

    modification = serializers.DictField(allow_null=True)
    problem = serializers.CharField(help_text="Why it can't be kept.")
    is_against_intent = serializers.BooleanField()
    lines = FindingDocument(many=True)


class BulkView(FormView):
    """Many scenarios at once."""

    permission_classes = (StaffOnly,)

    @describe(
        "Add the scenarios of a CSV or YAML file, all or none",
        takes=BulkBody,
        answers=BulkDocument,
        name="addScenarios",
    )
    def post(self, request: Request) -> Response:
        """Every row that can't be added is named with its reasons; then none is."""
        body = BulkBody(data=request.data)
        refuse_cut_files(request)
        body.is_valid(raise_exception=True)
        given = body.validated_data
        report = add_from_files(
            given["file"],
            given["documents"],
            keeps=not given["only_try"],
            actor=cast(User, request.user),
        )
        rows = [
            {
                "number": row.number,
                "slug": row.slug if report.is_kept else "",
                "problems": [[name, translate(text)] for name, text in row.problems],
            }
            for row in report.rows
        ]
        return Response(BulkDocument({"is_kept": report.is_kept, "rows": rows}).data)


class ReferenceView(ApiView):
    """The reference of a scenario."""

    permission_classes = (StaffOnly,)

    @describe(
        "Set or drop the reference of a scenario",
        takes=ReferenceBody,
        answers=NewScenarioDocument,
        name="setReference",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Refused while an open study or labelling shows the scenario."""
        row = find_scenario(code)
        body = ReferenceBody(data=request.data)
        body.is_valid(raise_exception=True)
        wanted, actor = body.validated_data["reference"], cast(User, request.user)
        change = (
            partial(drop_reference, row, actor=actor)
            if wanted is None
            else partial(set_reference, row, wanted, actor=actor)
        )
        return Response(changed_scenario(*keep_and_send(change, enqueue_scenario)))


class IntentView(ApiView):
    """What the instruction of a scenario asks for."""

    permission_classes = (StaffOnly,)

    @describe(
        "Set the intent of a scenario",
        takes=IntentBody,
        answers=WholeScenarioDocument,
        name="setIntent",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """In the place of the one that it had."""
        row = find_scenario(code)
        body = IntentBody(data=request.data)
        body.is_valid(raise_exception=True)
        wanted, actor = body.validated_data["intent"], cast(User, request.user)
        enter_intent(scenario=row.slug, document=wanted, actor=actor)
        return Response(WholeScenarioDocument(find_scenario(code)).data)


class ReadingView(ApiView):
    """A model that reads an instruction."""

    permission_classes = (ReadersAndAdmins,)

    @describe("The last reading of a scenario", answers=ReadingDocument, name="getReading")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """Whatever became of it; 404 before the first."""
        found = last_reading(find_scenario(code))
        if found is None:
            raise Http404
        return Response(ReadingDocument(found).data)

    @describe(
        "Have a model read the instruction of a scenario",
        takes=ReaderBody,
        answers=ReadingDocument,
        status=202,
        name="readInstruction",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Ask for it until it is no longer running."""
        row = find_scenario(code)
        body = ReaderBody(data=request.data)
        body.is_valid(raise_exception=True)
        actor = cast(User, request.user)
        plan = partial(plan_reading, scenario=row.slug, **body.validated_data, actor=actor)
        made, warnings = keep_and_send(cast(Any, plan), enqueue_reading)
        reading = IntentReading.objects.select_related("endpoint").get(pk=made.pk)
        found = dict(ReadingDocument(reading).data) | {"warnings": warnings}
        return Response(found, status=202)


class AcceptedReadingView(ApiView):
    """A reading that counts from now on."""

    permission_classes = (StaffOnly,)

    @describe("Accept the last reading", answers=WholeScenarioDocument, name="acceptReading")
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """It becomes the intent of the scenario."""
        row = find_scenario(code)
        accept_reading(scenario=row.slug, actor=cast(User, request.user))
        return Response(WholeScenarioDocument(find_scenario(code)).data)


class EditCheckView(ApiView):
    """A change before it is kept."""

    permission_classes = (StaffOnly,)

    @describe(
        "What the checks find in a change; nothing is kept",
        takes=EditBody,
        answers=CheckedDocument,
        name="checkEdit",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """As it would be kept, with the worst finding first."""
        row = find_scenario(code)
        body = EditBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = body.validated_data
        found = check_edit(row, given["modification"], snapped=given["snap"])
        answer = {
            "modification": found.modification,
            "problem": translate(found.problem),
            "is_against_intent": found.is_against_intent,
            "lines": found.lines,
        }
        return Response(CheckedDocument(answer).data)
