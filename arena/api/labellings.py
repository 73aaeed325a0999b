"""Fault labelling: rounds that admins open over a job, and what experts label in them."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django.contrib.auth.models import User
from django.shortcuts import get_object_or_404
from django.urls import reverse
from rest_framework import serializers
from rest_framework.permissions import BasePermission
from rest_framework.request import Request
from rest_framework.response import Response
from rest_framework.views import APIView

from arena.api.access import AdminsOnly, ExpertsOnly
from arena.api.errors import ApiView
from arena.api.fields import CodeField, StrictSerializer, TextField, WholeNumberField
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from arena.models import LabellingRound
from arena.queries import faults
from arena.queries.people import role_of
from arena.queries.showings import original_beside
from arena.services.faults import NOTE_LENGTH, close_labelling, open_labelling, save_label
from augment.models import GenerationJob
from augment.services.judging.fault_guess import FaultClass

STAFF = ("admin", "analyst")
MOST_EXPERTS = 5_000
HIGHEST_SEED = 2**63 - 1
CLASSES = [fault.value for fault in FaultClass]


class LabellingReaders(BasePermission):
    """Experts see their own rounds; staff see all, and admins open new ones."""

    def has_permission(self, request: Request, view: APIView) -> bool:
        """Whether the account may do what it asks for."""
        allowed = ("admin",) if request.method == "POST" else (*STAFF, "expert")
        return role_of(request.user) in allowed


class LabellingDocument(serializers.Serializer[Any]):
    """A round and how far it is; to an expert, their own part of it."""

    code = serializers.UUIDField(source="labelling.code")
    name = serializers.CharField(source="labelling.name")
    planned = serializers.IntegerField()
    labelled = serializers.IntegerField()
    left = serializers.IntegerField()
    opened_at = serializers.DateTimeField(source="labelling.opened_at")
    closed_at = serializers.DateTimeField(source="labelling.closed_at", allow_null=True)


class LabellingBody(StrictSerializer):
    """A new round over the augmentations of a job."""

    job = CodeField()
    name = TextField(max_length=120, help_text="Experts see it.")
    experts = serializers.ListField(
        child=TextField(max_length=150), max_length=MOST_EXPERTS, min_length=1
    )
    seed = WholeNumberField(required=False, default=1, min_value=0, max_value=HIGHEST_SEED)


class LabelTaskDocument(serializers.Serializer[Any]):
    """What an expert looks at next; nothing tells who made it."""

    task = serializers.UUIDField()
    position = serializers.IntegerField()
    instruction = serializers.CharField()
    picture = serializers.CharField(help_text="Its last part is a token for `/pictures`.")
    original = serializers.CharField(allow_null=True, help_text="The scene before any change.")


class NextTaskDocument(serializers.Serializer[Any]):
    """The next picture to label."""

    next = LabelTaskDocument(allow_null=True, help_text="Null once nothing is left.")


class LabelBody(StrictSerializer):
    """Which faults one picture has."""

    task = CodeField()
    faults = serializers.MultipleChoiceField(choices=CLASSES, help_text="None is no fault.")
    note = TextField(max_length=NOTE_LENGTH, required=False, default="", allow_blank=True)


class SavedLabelDocument(serializers.Serializer[Any]):
    """A label that was kept."""

    saved = serializers.BooleanField()
    guessed = serializers.ListField(
        child=serializers.CharField(),
        allow_null=True,
        help_text="What the checks had guessed, told only now; null where they could not look.",
    )


class LabellingsView(ApiView):
    """The rounds, the youngest first."""

    permission_classes = (LabellingReaders,)

    @describe(
        "Labelling rounds, the youngest first",
        answers=page_of(LabellingDocument),
        query=PageQuery,
        name="listLabellings",
    )
    def get(self, request: Request) -> Response:
        """An expert's own with their own progress, staff's all."""
        user = cast(User, request.user)
        expert = None if role_of(user) in STAFF else user
        return answer_page(
            request,
            faults.rounds_seen_by(expert),
            read_query(request, PageQuery),
            LabellingDocument,
            lines=lambda page: faults.of_rounds(page, expert=expert),
        )

    @describe(
        "Open a labelling round",
        takes=LabellingBody,
        answers=LabellingDocument,
        status=201,
        name="openLabelling",
    )
    def post(self, request: Request) -> Response:
        """Its experts see it at once."""
        body = LabellingBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = dict(body.validated_data)
        job = get_object_or_404(GenerationJob, code=given.pop("job"))
        made = open_labelling(job=job, **given, actor=cast(User, request.user))
        return Response(_line(made), status=201)


class CloseLabellingView(ApiView):
    """The end of a round."""

    permission_classes = (AdminsOnly,)

    @describe("Close a labelling round", answers=LabellingDocument, name="closeLabelling")
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Its labels stay; there is no way back."""
        row = get_object_or_404(LabellingRound, code=code)
        return Response(_line(close_labelling(labelling=row, actor=cast(User, request.user))))


class NextTaskView(ApiView):
    """What an expert labels next."""

    permission_classes = (ExpertsOnly,)
    is_never_cached = True

    @describe("The next picture to label", answers=NextTaskDocument, name="getNextTask")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """Of a round that the expert takes part in."""
        expert = cast(User, request.user)
        labelling = faults.labelling_of(expert=expert, code=code).labelling
        task = faults.next_task(labelling=labelling, expert=expert)
        if task is None:
            return Response({"next": None})
        has_original = bool(original_beside(task.augmentation))
        found = {
            "task": task.code,
            "position": task.position,
            "instruction": task.augmentation.scenario.instruction,
            "picture": reverse("matchup-image", args=[task.token]),
            "original": reverse("matchup-image", args=[task.original_token])
            if has_original
            else None,
        }
        return Response(NextTaskDocument({"next": found}).data)


class LabelsView(ApiView):
    """Labels are kept here."""

    permission_classes = (ExpertsOnly,)
    is_never_cached = True

    @describe(
        "Label the faults of a picture",
        takes=LabelBody,
        answers=SavedLabelDocument,
        name="labelFaults",
    )
    def post(self, request: Request) -> Response:
        """The same again is the same label; another one is refused with 409."""
        body = LabelBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = body.validated_data
        label = save_label(
            expert=cast(User, request.user),
            task_code=given["task"],
            faults=frozenset(map(FaultClass, given["faults"])),
            note=given["note"],
        )
        guessed = None
        if label.guessed_position is not None:
            guessed = [name for name in CLASSES if getattr(label, f"guessed_{name}")]
        return Response({"saved": True, "guessed": guessed})


def _line(row: LabellingRound) -> dict[str, Any]:
    (found,) = faults.of_rounds([row])
    return dict(LabellingDocument(found).data)
