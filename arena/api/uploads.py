"""Recordings: read by a worker, shown moment by moment, kept as scenes."""

from __future__ import annotations

import uuid
from functools import partial
from typing import Any

from django.core.exceptions import RequestDataTooBig
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.parsers import MultiPartParser
from rest_framework.request import Request

from arena.api.access import STAFF
from arena.api.fields import StrictSerializer, TextField, WholeNumberField
from arena.api.views import ApiView, WarnedDocument, keep_and_send, operation
from arena.services.sent_files import was_too_large
from augment.models import SceneUpload, UploadMoment
from augment.services.scenarios import uploads
from augment.services.scenarios import uploads as upload_moments
from augment.tasks import enqueue_moment, enqueue_upload

HIGHEST_FRAME = 2**31 - 1


class UploadBody(StrictSerializer):
    """A file and what it is."""

    file = serializers.FileField(help_text="A recording, or a zip of one.")
    format = serializers.ChoiceField(
        choices=list(uploads.FORMATS),
        required=False,
        default="",
        help_text="Left out to recognise it.",
    )


class MomentBody(StrictSerializer):
    """Which moment of a recording; those that there are stand in its `tracks`."""

    item = TextField(max_length=200, required=False, default="", allow_blank=True)
    frame = WholeNumberField(min_value=0, max_value=HIGHEST_FRAME)


class KeepBody(StrictSerializer):
    """What the scene is to be called."""

    slug = TextField(max_length=80)


class StopDocument(serializers.Serializer[Any]):
    """A moment that can be chosen."""

    item = serializers.CharField(allow_blank=True)
    frame = serializers.IntegerField()
    time_s = serializers.FloatField(allow_null=True)
    place_m = serializers.ListField(child=serializers.FloatField(), allow_null=True)


class RecordingPartDocument(serializers.Serializer[Any]):
    """One part of a recording."""

    name = serializers.CharField(allow_blank=True)
    stops = StopDocument(many=True)


class UploadDocument(serializers.ModelSerializer[SceneUpload], WarnedDocument):
    """A recording, and once it is read the moments that it offers."""

    tracks = RecordingPartDocument(many=True, read_only=True)

    class Meta:
        model = SceneUpload
        fields = (
            *("code", "name", "size_bytes", "digest", "state", "reason", "format", "is_cut"),
            *("created_at", "finished_at", "tracks", "warnings"),
        )
        read_only_fields = fields


class MomentDocument(serializers.ModelSerializer[UploadMoment], WarnedDocument):
    """A moment of a recording, with a report of what is in it."""

    upload = serializers.UUIDField(source="upload.code")
    report = serializers.DictField(allow_null=True, help_text="What is in it, once it is read.")
    notes = serializers.SerializerMethodField(help_text="What the source left open.")
    scene = serializers.CharField(source="scene.slug", default=None, allow_null=True)

    class Meta:
        model = UploadMoment
        fields = (
            *("code", "upload", "item", "frame", "state", "reason", "report"),
            *("notes", "scene", "warnings"),
        )
        read_only_fields = fields

    def get_notes(self, row: UploadMoment) -> list[str]:
        """Return them as sentences."""
        return upload_moments.sentences_of(row)


class UploadsView(ApiView):
    """Recordings."""

    parser_classes = (MultiPartParser,)
    writers = STAFF

    def initial(self, request: Request, *args: Any, **kwargs: Any) -> None:
        """Refuse a file that was cut because it is too large."""
        super().initial(request, *args, **kwargs)
        _ = request.data  # parses the body
        if was_too_large(request.META):
            raise RequestDataTooBig

    @operation(
        "Send a recording; a worker reads it",
        takes=UploadBody,
        answers=UploadDocument,
        status=202,
        name="sendRecording",
    )
    def post(self, request: Request, given: dict[str, Any]) -> tuple[SceneUpload, list[str]]:
        """Poll it until its state is read or failed."""
        file, source = given["file"], given["format"]
        keep = partial(uploads.keep_upload, name=file.name or "", content=file, source=source)
        return keep_and_send(partial(keep, actor=self.user), enqueue_upload)


class UploadView(ApiView):
    """One recording."""

    readers = STAFF

    @operation("A recording that was sent", answers=UploadDocument, name="getUpload")
    def get(self, request: Request, code: uuid.UUID) -> SceneUpload:
        """With the moments that it offers, once it is read."""
        return get_object_or_404(SceneUpload, code=code)


class MomentsView(ApiView):
    """Moments of a recording that were asked for."""

    writers = STAFF

    @operation(
        "Have a moment of a recording drawn",
        takes=MomentBody,
        answers=MomentDocument,
        status=202,
        name="showMoment",
    )
    def post(
        self, request: Request, code: uuid.UUID, given: dict[str, Any]
    ) -> tuple[UploadMoment, list[str]]:
        """The same one twice is one; poll it until it is drawn."""
        upload = get_object_or_404(SceneUpload, code=code)
        is_new = False

        def ask() -> UploadMoment:
            nonlocal is_new
            row, is_new = upload_moments.ask_for_moment(upload, **given, actor=self.user)
            return row

        def send(pk: int) -> None:
            if is_new:
                enqueue_moment(pk)

        return keep_and_send(ask, send)


class MomentView(ApiView):
    """One moment."""

    readers = STAFF

    @operation("A moment of a recording", answers=MomentDocument, name="getMoment")
    def get(self, request: Request, code: uuid.UUID) -> UploadMoment:
        """With a report of what is in it."""
        return _find_moment(code)


class KeepMomentView(ApiView):
    """A moment that becomes a scene."""

    writers = STAFF

    @operation(
        "Have a drawn moment kept as a scene",
        takes=KeepBody,
        answers=MomentDocument,
        status=202,
        name="keepMoment",
    )
    def post(
        self, request: Request, code: uuid.UUID, given: dict[str, Any]
    ) -> tuple[UploadMoment, list[str]]:
        """Poll it until its state is kept; `scene` then names the scene."""

        def ask() -> UploadMoment:
            upload_moments.ask_to_keep(_find_moment(code), slug=given["slug"], actor=self.user)
            return _find_moment(code)

        return keep_and_send(ask, enqueue_moment)


def _find_moment(code: uuid.UUID) -> UploadMoment:
    rows = UploadMoment.objects.select_related("upload", "scene").defer("upload__tracks")
    return get_object_or_404(rows, code=code)
