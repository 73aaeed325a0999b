"""Recordings that are sent: read by a worker, looked at moment by moment, kept as scenes."""

from __future__ import annotations

import uuid
from functools import partial
from typing import Any, cast

from django.contrib.auth.models import User
from django.http.response import HttpResponseBase
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import StaffOnly
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer, TextField, WholeNumberField
from arena.api.files import PNG, FileView, describe_file
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.pictures import picture_named
from arena.api.schema import describe
from arena.api.sending import FormView, WarnedDocument, keep_and_send, refuse_cut_files
from augment.models import SceneUpload, UploadMoment
from augment.scene_tasks import enqueue_moment, enqueue_upload
from augment.services.scenarios import upload_moments, uploads
from augment.services.wording import translate

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


class UploadDocument(serializers.Serializer[Any]):
    """A file that was sent, and how far its reading is."""

    code = serializers.UUIDField()
    name = serializers.CharField()
    size_bytes = serializers.IntegerField()
    digest = serializers.CharField(help_text="SHA-256.")
    state = serializers.CharField(help_text="queued, running, read or failed.")
    reason = serializers.CharField(help_text="Why it can't be read.")
    format = serializers.CharField(help_text="As it was read; empty before.")
    is_cut = serializers.BooleanField(help_text="It holds more than is offered.")
    created_at = serializers.DateTimeField()
    finished_at = serializers.DateTimeField(allow_null=True)


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


class WholeUploadDocument(UploadDocument, WarnedDocument):
    """A file with the moments that it offers."""

    tracks = RecordingPartDocument(many=True)


class MomentDocument(WarnedDocument):
    """A moment of a recording, with the report of its reading."""

    code = serializers.UUIDField()
    upload = serializers.UUIDField(source="upload.code")
    item = serializers.CharField(allow_blank=True)
    frame = serializers.IntegerField()
    state = serializers.CharField(help_text="queued, drawn, keeping, kept or failed.")
    reason = serializers.CharField(help_text="Why it can't be read or kept.")
    report = serializers.DictField(allow_null=True, help_text="What is in it, once it is read.")
    notes = serializers.SerializerMethodField(help_text="What the source left open.")
    scene = serializers.CharField(source="scene.slug", default=None, allow_null=True)

    def get_notes(self, row: UploadMoment) -> list[str]:
        """As sentences."""
        return [translate(one) for one in upload_moments.sentences_of(row)]


class UploadsView(FormView):
    """The files that were sent, the youngest first."""

    permission_classes = (StaffOnly,)

    @describe(
        "Recordings that were sent, the youngest first",
        answers=page_of(UploadDocument),
        query=PageQuery,
        name="listUploads",
    )
    def get(self, request: Request) -> Response:
        """Without their moments."""
        rows = SceneUpload.objects.defer("tracks")
        return answer_page(request, rows, read_query(request, PageQuery), UploadDocument)

    @describe(
        "Send a recording; a worker reads it",
        takes=UploadBody,
        answers=WholeUploadDocument,
        status=202,
        name="sendRecording",
    )
    def post(self, request: Request) -> Response:
        """Ask for it until its state is read or failed."""
        body = UploadBody(data=request.data)
        refuse_cut_files(request)
        body.is_valid(raise_exception=True)
        file = body.validated_data["file"]
        row, warnings = keep_and_send(
            partial(
                uploads.keep_upload,
                name=file.name or "",
                content=file,
                source=body.validated_data["format"],
                actor=cast(User, request.user),
            ),
            enqueue_upload,
        )
        return Response(_upload(row, warnings), status=202)


class UploadView(ApiView):
    """One file."""

    permission_classes = (StaffOnly,)

    @describe("A recording that was sent", answers=WholeUploadDocument, name="getUpload")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """With the moments that it offers, once it is read."""
        return Response(_upload(get_object_or_404(SceneUpload, code=code)))


class UploadAgainView(ApiView):
    """A file that could not be read, once more."""

    permission_classes = (StaffOnly,)

    @describe(
        "Have a recording read again that failed",
        answers=WholeUploadDocument,
        status=202,
        name="readUploadAgain",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Refused for one that did not fail."""
        row = get_object_or_404(SceneUpload, code=code)

        def wait() -> SceneUpload:
            uploads.read_again(row)
            row.refresh_from_db()
            return row

        found, warnings = keep_and_send(wait, enqueue_upload)
        return Response(_upload(found, warnings), status=202)


class UploadRemovedView(ApiView):
    """A file that is no longer needed."""

    permission_classes = (StaffOnly,)

    @describe(
        "Forget a recording; the scenes kept of it stay",
        answers=UploadDocument,
        name="removeUpload",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Answers with what it was."""
        row = get_object_or_404(SceneUpload, code=code)
        was = dict(UploadDocument(row).data)
        uploads.remove_upload(row, actor=cast(User, request.user))
        return Response(was)


class MomentsView(ApiView):
    """Moments of a recording that somebody looks at."""

    permission_classes = (StaffOnly,)

    @describe(
        "Have a moment of a recording drawn",
        takes=MomentBody,
        answers=MomentDocument,
        status=202,
        name="showMoment",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """The same one twice is one; ask for it until it is drawn."""
        upload = get_object_or_404(SceneUpload, code=code)
        body = MomentBody(data=request.data)
        body.is_valid(raise_exception=True)
        is_new = False

        def ask() -> UploadMoment:
            nonlocal is_new
            row, is_new = upload_moments.ask_for_moment(
                upload, **body.validated_data, actor=cast(User, request.user)
            )
            return row

        def send(pk: int) -> None:
            if is_new:
                enqueue_moment(pk)

        return Response(_moment(*keep_and_send(ask, send)), status=202)


class MomentView(ApiView):
    """One moment."""

    permission_classes = (StaffOnly,)

    @describe("A moment of a recording", answers=MomentDocument, name="getMoment")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """With the report of its reading."""
        return Response(_moment(_find_moment(code)))


class MomentPictureView(FileView):
    """A moment as it would be kept."""

    permission_classes = (StaffOnly,)
    is_never_cached = True

    @describe_file("A moment of a recording", types=[PNG], name="getMomentPicture")
    def get(self, request: Request, code: uuid.UUID) -> HttpResponseBase:
        """Nothing before it was drawn."""
        return picture_named(_find_moment(code).picture)


class KeepMomentView(ApiView):
    """A moment that becomes a scene."""

    permission_classes = (StaffOnly,)

    @describe(
        "Have a drawn moment kept as a scene",
        takes=KeepBody,
        answers=MomentDocument,
        status=202,
        name="keepMoment",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Ask for it until its state is kept; `scene` then names the scene."""
        row = _find_moment(code)
        body = KeepBody(data=request.data)
        body.is_valid(raise_exception=True)

        def ask() -> UploadMoment:
            slug = body.validated_data["slug"]
            upload_moments.ask_to_keep(row, slug=slug, actor=cast(User, request.user))
            return _find_moment(code)

        return Response(_moment(*keep_and_send(ask, enqueue_moment)), status=202)


# --- Private -----------------------------------------------------------------------------------


def _find_moment(code: uuid.UUID) -> UploadMoment:
    rows = UploadMoment.objects.select_related("upload", "scene").defer("upload__tracks")
    return get_object_or_404(rows, code=code)


def _upload(row: SceneUpload, warnings: list[str] | None = None) -> dict[str, Any]:
    return dict(WholeUploadDocument(row).data) | {"warnings": warnings or []}


def _moment(row: UploadMoment, warnings: list[str] | None = None) -> dict[str, Any]:
    return dict(MomentDocument(row).data) | {"warnings": warnings or []}
