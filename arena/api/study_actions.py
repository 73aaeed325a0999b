"""What is done with a study around its votes: previewed, handed over, its frozen file read."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django.contrib.auth.models import User
from django.http import Http404
from django.http.response import HttpResponseBase
from django.utils.text import slugify
from drf_spectacular.types import OpenApiTypes
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena import tasks
from arena.api.access import AdminsOnly, StaffOnly
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer, TextField
from arena.api.files import FileView, as_file
from arena.api.schema import JSON, describe
from arena.api.sending import WarnedDocument
from arena.api.studies import get_study
from arena.api.study_body import MOST_CHOSEN, StudyBody
from arena.queries.coverage import coverage
from arena.queries.votes import tallies
from arena.services.handing_over import hand_over
from arena.services.preregistration import preregistration_bytes
from arena.services.previews import preview_study
from augment.errors import QueueFault
from augment.services.wording import translate


class PreviewDocument(serializers.Serializer[Any]):
    """A study before it is opened."""

    experts = serializers.IntegerField()
    contestants = serializers.IntegerField()
    scenarios = serializers.IntegerField()
    votes = serializers.IntegerField(help_text="Of all experts.")
    later = serializers.IntegerField(help_text="Votes planned later, by those before.")
    repeats = serializers.IntegerField(help_text="Hidden repeats, on top of the votes.")
    checks = serializers.IntegerField(help_text="Attention checks, on top of the votes.")
    judged = serializers.IntegerField(help_text="Pairs of a scenario that somebody judges.")
    shared = serializers.IntegerField(help_text="So many of them two experts or more.")
    settled = serializers.IntegerField(help_text="Pairs settled as ties, shown to nobody.")
    alike = serializers.IntegerField(help_text="So many of them because they are alike.")
    seconds = serializers.FloatField(help_text="For one pair.")
    minutes = serializers.IntegerField(help_text="For each expert.")


class HandOverBody(StrictSerializer):
    """Whose unjudged pairs go to whom."""

    giver = TextField(max_length=150, help_text="A username.")
    takers = serializers.ListField(
        child=TextField(max_length=150), max_length=MOST_CHOSEN, help_text="Usernames."
    )


class HandedOverDocument(serializers.Serializer[Any]):
    """Who took how many votes."""

    taken = serializers.DictField(child=serializers.IntegerField(), help_text="By username.")


class CoveredDocument(serializers.Serializer[Any]):
    """Something planned, and how much of it has a vote."""

    name = serializers.CharField()
    planned = serializers.IntegerField()
    decided = serializers.IntegerField()


class ExpertProgressDocument(serializers.Serializer[Any]):
    """How far one expert is."""

    expert = serializers.CharField(source="expert.username")
    planned = serializers.IntegerField(source="total")
    voted = serializers.IntegerField()
    skips = serializers.IntegerField()
    left = serializers.IntegerField()


class StudyProgressDocument(serializers.Serializer[Any]):
    """How far a study is; nothing of who leads."""

    experts = ExpertProgressDocument(many=True)
    contestants = CoveredDocument(many=True)
    pairs = CoveredDocument(many=True, help_text="The least judged first.")
    kinds = CoveredDocument(many=True)


class PreviewView(ApiView):
    """A study that nobody has opened."""

    permission_classes = (AdminsOnly,)

    @describe(
        "What a study would be, in numbers; nothing is kept",
        takes=StudyBody,
        answers=PreviewDocument,
        name="previewStudy",
    )
    def post(self, request: Request) -> Response:
        """Refused where opening it would be."""
        body = StudyBody(data=request.data)
        body.is_valid(raise_exception=True)
        return Response(PreviewDocument(preview_study(body.rules())).data)


class HandOverView(ApiView):
    """Pairs that somebody else judges."""

    permission_classes = (AdminsOnly,)

    @describe(
        "Let others judge what an expert has not judged",
        takes=HandOverBody,
        answers=HandedOverDocument,
        name="handOver",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Planned anew for who takes them; there is no way back."""
        study = get_study(code)
        body = HandOverBody(data=request.data)
        body.is_valid(raise_exception=True)
        taken = hand_over(
            study=study,
            username=body.validated_data["giver"],
            to=body.validated_data["takers"],
            actor=cast(User, request.user),
        )
        return Response({"taken": taken})


class StudyProgressView(ApiView):
    """How far a study is."""

    permission_classes = (StaffOnly,)

    @describe(
        "How far each expert, contestant and pair is",
        answers=StudyProgressDocument,
        name="getStudyProgress",
    )
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """Never who leads."""
        study = get_study(code)
        covered = coverage(study)
        found = {
            "experts": tallies(study),
            "contestants": covered.contestants,
            "pairs": covered.pairs,
            "kinds": covered.kinds,
        }
        return Response(StudyProgressDocument(found).data)


class PreregistrationView(FileView):
    """What was frozen at the opening."""

    permission_classes = (StaffOnly,)

    @describe(
        "What was frozen at the opening, byte for byte",
        answers=OpenApiTypes.OBJECT,
        name="getPreregistration",
    )
    def get(self, request: Request, code: uuid.UUID) -> HttpResponseBase:
        """404 for studies whose votes came from a file."""
        study = get_study(code)
        content = preregistration_bytes(study)
        if not content:
            raise Http404
        return as_file(content, JSON, f"{slugify(study.name) or 'study'}-preregistration.json")


class ChecksView(ApiView):
    """Attention checks."""

    permission_classes = (AdminsOnly,)

    @describe(
        "Have the attention checks drawn that are missing",
        answers=WarnedDocument,
        status=202,
        name="drawChecks",
    )
    def post(self, request: Request) -> Response:
        """Twice does no harm."""
        warnings: list[str] = []
        try:
            tasks.send_checks(cast(User, request.user).pk)
        except QueueFault as error:
            warnings.append(translate(error))
        return Response({"warnings": warnings}, status=202)
