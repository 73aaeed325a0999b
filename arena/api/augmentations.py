"""Augmentations: what contestants made, with pictures and transcripts, for staff alone."""

from __future__ import annotations

import uuid
from functools import partial
from typing import Any, cast

from django.contrib.auth.models import User
from django.shortcuts import get_object_or_404
from drf_spectacular.types import OpenApiTypes
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import StaffOnly
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer, TextField
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from arena.api.sending import WarnedDocument, keep_and_send
from augment.models import Augmentation
from augment.services.running import by_hand
from augment.services.running.transcript_export import transcript_of
from augment.services.texts import LONGEST_NOTES
from augment.tasks import enqueue_job


class AugmentationQuery(PageQuery):
    """Which augmentations."""

    job = serializers.UUIDField(required=False, help_text="The code of a job.")
    scenario = serializers.CharField(max_length=80, required=False, help_text="A slug.")
    contestant = serializers.CharField(max_length=80, required=False, help_text="A slug.")
    state = serializers.ChoiceField(choices=Augmentation.State.values, required=False)


class AugmentationDocument(serializers.Serializer[Any]):
    """One augmentation of a list."""

    code = serializers.UUIDField()
    job = serializers.UUIDField(source="job.code")
    scenario = serializers.CharField(source="scenario.slug")
    contestant = serializers.CharField(source="contestant.slug")
    sample = serializers.IntegerField()
    state = serializers.CharField()
    reason = serializers.CharField(help_text="Why there is no modification.")
    has_picture = serializers.SerializerMethodField()
    created_at = serializers.DateTimeField()
    finished_at = serializers.DateTimeField(allow_null=True)

    def get_has_picture(self, row: Augmentation) -> bool:
        """Whether it was drawn."""
        return bool(row.image)


class WholeAugmentationDocument(AugmentationDocument):
    """One augmentation with what was changed."""

    instruction = serializers.CharField(source="scenario.instruction")
    modification = serializers.DictField(allow_null=True)
    options = serializers.DictField(
        allow_null=True, help_text="With which its contestant asked; null where it asked nobody."
    )
    notes = serializers.CharField(help_text="What the contestant said of its own work.")


class CorrectedDocument(WholeAugmentationDocument, WarnedDocument):
    """A correction just kept."""


class CorrectionBody(StrictSerializer):
    """An augmentation as it should have been."""

    modification = serializers.DictField()
    contestant = TextField(
        max_length=80,
        required=False,
        default=by_hand.BY_HAND,
        help_text="The slug of a person; made where there is none.",
    )
    name = TextField(
        max_length=120, required=False, default="", allow_blank=True, help_text="Of a new one."
    )
    notes = TextField(
        max_length=LONGEST_NOTES, required=False, default="", allow_blank=True, help_text="Why."
    )


class AugmentationsView(ApiView):
    """The augmentations, the youngest first."""

    permission_classes = (StaffOnly,)

    @describe(
        "Augmentations, the youngest first",
        answers=page_of(AugmentationDocument),
        query=AugmentationQuery,
        name="listAugmentations",
    )
    def get(self, request: Request) -> Response:
        """Without what was changed."""
        query = read_query(request, AugmentationQuery)
        rows = _augmentations().defer("modification", "notes", "options", "injected")
        paths = {
            "job": "job__code",
            "scenario": "scenario__slug",
            "contestant": "contestant__slug",
            "state": "state",
        }
        chosen = {path: query[name] for name, path in paths.items() if name in query}
        return answer_page(request, rows.filter(**chosen), query, AugmentationDocument)


class AugmentationView(ApiView):
    """One augmentation."""

    permission_classes = (StaffOnly,)

    @describe("An augmentation", answers=WholeAugmentationDocument, name="getAugmentation")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """With what was changed."""
        row = get_object_or_404(_augmentations(), code=code)
        return Response(WholeAugmentationDocument(row).data)


class CorrectionsView(ApiView):
    """What a person makes of an augmentation."""

    permission_classes = (StaffOnly,)

    @describe(
        "Keep a correction by hand",
        takes=CorrectionBody,
        answers=CorrectedDocument,
        status=201,
        name="correctAugmentation",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """An augmentation of its own, of a contestant of kind human; a worker draws it."""
        rows = Augmentation.objects.select_related("contestant", "job", "scenario__base_scene")
        original = get_object_or_404(rows.defer("scenario__base_scene__recording"), code=code)
        body = CorrectionBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = dict(body.validated_data)
        keep = partial(
            by_hand.keep_correction,
            original,
            given.pop("modification"),
            slug=given.pop("contestant"),
            **given,
            actor=cast(User, request.user),
        )
        job_of: dict[int, int] = {}

        def keep_it() -> Augmentation:
            made = keep()
            job_of[made.pk] = made.job_id
            return made

        made, warnings = keep_and_send(keep_it, lambda pk: enqueue_job(job_of[pk]))
        found = dict(WholeAugmentationDocument(_augmentations().get(pk=made.pk)).data)
        return Response(found | {"warnings": warnings}, status=201)


class TranscriptView(ApiView):
    """Everything that led to an augmentation."""

    permission_classes = (StaffOnly,)
    is_never_cached = True

    @describe(
        "The transcript of an augmentation",
        answers=OpenApiTypes.OBJECT,
        name="getTranscript",
    )
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """The document that the page of the augmentation offers."""
        rows = Augmentation.objects.select_related(
            "job", "scenario__base_scene", "contestant__endpoint"
        ).defer("scenario__base_scene__recording")
        return Response(transcript_of(get_object_or_404(rows, code=code)))


def _augmentations() -> Any:
    return Augmentation.objects.select_related("job", "scenario", "contestant").only(
        *("code", "sample", "state", "reason", "image", "created_at", "finished_at"),
        *("modification", "notes", "options", "job__code"),
        *("scenario__slug", "scenario__instruction", "contestant__slug"),
    )
