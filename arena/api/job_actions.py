"""What is done with a job that there is: pause, resume, cancel, try again."""

from __future__ import annotations

import uuid
from functools import partial
from typing import Any, cast

from django.contrib.auth.models import User
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import AdminsOnly, StaffOnly
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer, TextField
from arena.api.jobs import CapsBody, ChangedJobDocument, change_job, find_job, take_caps
from arena.api.schema import describe
from arena.services.retrying import retry_cause
from augment.services.running import jobs, pausing
from augment.services.running.causes import failure_groups


class RetryBody(StrictSerializer):
    """What is to be tried again."""

    cause = TextField(
        max_length=80, required=False, help_text="The key of a cause; all that failed without one."
    )


class CauseDocument(serializers.Serializer[Any]):
    """Augmentations that ended for the same cause."""

    key = serializers.CharField()
    state = serializers.CharField()
    reason = serializers.CharField(help_text="What most of them have.")
    number = serializers.IntegerField()


class CancelJobView(ApiView):
    """The end of a job."""

    permission_classes = (AdminsOnly,)

    @describe("Cancel a job", answers=ChangedJobDocument, name="cancelJob")
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """What waits is never made; what is done stays. There is no way back."""
        actor = cast(User, request.user)
        return Response(change_job(partial(jobs.cancel, find_job(code), actor), sends=False))


class RetryJobView(ApiView):
    """A second try at what failed."""

    permission_classes = (AdminsOnly,)

    @describe(
        "Queue again what failed, or the rows of one cause",
        takes=RetryBody,
        answers=ChangedJobDocument,
        name="retryJob",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Without a cause outcomes of the contestants themselves stay."""
        body = RetryBody(data=request.data)
        body.is_valid(raise_exception=True)
        job, cause, actor = find_job(code), body.validated_data.get("cause"), request.user
        by = cast(User, actor)
        if cause is None:
            return Response(change_job(partial(jobs.retry_failed, job, by)))
        return Response(change_job(partial(retry_cause, job, key=cause, actor=by)))


class FailuresView(ApiView):
    """What has no modification."""

    permission_classes = (StaffOnly,)

    @describe(
        "What has no modification, by cause", answers=CauseDocument(many=True), name="listFailures"
    )
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """Faults of the machinery first."""
        return Response(CauseDocument(failure_groups(find_job(code)), many=True).data)


class PauseJobView(ApiView):
    """A job that is held."""

    permission_classes = (AdminsOnly,)

    @describe("Pause a job", answers=ChangedJobDocument, name="pauseJob")
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Nothing new is started; what is in flight ends and keeps its results."""
        actor = cast(User, request.user)
        return Response(
            change_job(partial(pausing.pause, find_job(code), actor=actor), sends=False)
        )


class ResumeJobView(ApiView):
    """A job that stopped goes on."""

    permission_classes = (AdminsOnly,)

    @describe(
        "Raise the caps that are given and go on",
        takes=CapsBody,
        answers=ChangedJobDocument,
        name="resumeJob",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """What is left is queued again."""
        body = CapsBody(data=request.data)
        body.is_valid(raise_exception=True)
        job, higher = find_job(code), take_caps(dict(body.validated_data))
        actor = cast(User, request.user)
        return Response(change_job(partial(pausing.resume, job, higher=higher, actor=actor)))
