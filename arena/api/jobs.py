"""Generation jobs: launched, watched, and told to go on or to end."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from functools import partial
from typing import Any, cast

from django.contrib.auth.models import User
from django.db import transaction
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import AdminsOnly, ReadersAndAdmins, StaffOnly
from arena.api.errors import ApiView
from arena.api.fields import FlagField, StrictSerializer, TextField, WholeNumberField
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from augment.errors import QueueFault
from augment.models import GenerationJob
from augment.services.running import caps, jobs
from augment.services.running.caps import Caps
from augment.services.running.estimates import estimate
from augment.services.running.summary import JobCounts, count_each, count_rows
from augment.services.running.workers import workforce
from augment.services.wording import translate
from augment.tasks import enqueue_job

MOST_CHOSEN = 5_000


class JobQuery(PageQuery):
    """Which jobs."""

    state = serializers.ChoiceField(choices=GenerationJob.State.values, required=False)


class JobDocument(serializers.Serializer[Any]):
    """A job and how many of its augmentations are in each state."""

    code = serializers.UUIDField(source="job.code")
    name = serializers.CharField(source="job.name")
    state = serializers.CharField(source="job.state")
    total = serializers.IntegerField()
    settled = serializers.IntegerField()
    by_state = serializers.SerializerMethodField()
    is_over = serializers.SerializerMethodField()
    samples = serializers.IntegerField(source="job.samples")
    is_fresh = serializers.BooleanField(source="job.is_fresh")
    cap_usd = serializers.DecimalField(None, 9, source="job.cap_usd", allow_null=True)
    cap_calls = serializers.IntegerField(source="job.cap_calls", allow_null=True)
    cap_tokens = serializers.IntegerField(source="job.cap_tokens", allow_null=True)
    spent_usd = serializers.DecimalField(
        None, 9, source="job.spent_usd", help_text="As far as prices are known."
    )
    spent_calls = serializers.IntegerField(source="job.spent_calls")
    spent_tokens = serializers.IntegerField(source="job.spent_tokens")
    created_at = serializers.DateTimeField(source="job.created_at")
    finished_at = serializers.DateTimeField(source="job.finished_at", allow_null=True)

    def get_by_state(self, found: JobCounts) -> dict[str, int]:
        """Augmentations by state."""
        return {state.value: number for state, number in found.by_state.items()}

    def get_is_over(self, found: JobCounts) -> bool:
        """Whether nothing will change by itself."""
        return not found.is_moving


class ChangedJobDocument(JobDocument):
    """A job after a change."""

    warnings = serializers.ListField(
        child=serializers.CharField(),
        help_text="What did not work: without a broker the job waits until there is one.",
    )


class ProgressDocument(serializers.Serializer[Any]):
    """How far a job is, for whoever asks every other second."""

    state = serializers.CharField()
    total = serializers.IntegerField()
    settled = serializers.IntegerField()
    by_state = serializers.DictField(child=serializers.IntegerField())
    calls = serializers.IntegerField()
    is_over = serializers.BooleanField()
    is_worked_on = serializers.BooleanField()


class ChoiceBody(StrictSerializer):
    """Whom to ask about what, and how often."""

    contestants = serializers.ListField(
        child=TextField(max_length=80), max_length=MOST_CHOSEN, help_text="Slugs."
    )
    scenarios = serializers.ListField(
        child=TextField(max_length=80), max_length=MOST_CHOSEN, help_text="Slugs."
    )
    samples = WholeNumberField(
        required=False, default=1, min_value=1, max_value=jobs.HIGHEST_SAMPLES
    )


class CapsBody(StrictSerializer):
    """What a job may use at most; what is missing is no cap, or one that stays."""

    cap_usd = serializers.DecimalField(16, 9, required=False)
    cap_calls = WholeNumberField(required=False, min_value=1, max_value=caps.HIGHEST_CALLS)
    cap_tokens = WholeNumberField(required=False, min_value=1, max_value=caps.HIGHEST_TOKENS)


class EstimateBody(ChoiceBody):
    """A job that is not launched."""

    is_fresh = FlagField(
        required=False,
        default=False,
        help_text="Ask anew what was answered in other jobs before.",
    )


class JobBody(EstimateBody, CapsBody):
    """A new job."""

    name = TextField(max_length=120)


class EstimateLineDocument(serializers.Serializer[Any]):
    """What one contestant is expected to use."""

    slug = serializers.CharField()
    name = serializers.CharField()
    rows = serializers.IntegerField()
    calls = serializers.ListField(
        child=serializers.IntegerField(), help_text="At least, as expected, at most."
    )
    tokens_in = serializers.IntegerField()
    tokens_out = serializers.IntegerField()
    usd = serializers.DecimalField(None, 9, allow_null=True)
    usd_most = serializers.DecimalField(None, 9, allow_null=True)
    seen = serializers.IntegerField(
        help_text="Earlier augmentations that it rests on; 0 for a guess."
    )
    answered = serializers.IntegerField(help_text="Rows whose answers are in the store already.")


class EstimateDocument(serializers.Serializer[Any]):
    """What a job would use."""

    rows = serializers.IntegerField()
    scenarios = serializers.IntegerField()
    contestants = serializers.IntegerField()
    calls = serializers.ListField(child=serializers.IntegerField())
    tokens_in = serializers.IntegerField()
    tokens_out = serializers.IntegerField()
    usd = serializers.DecimalField(None, 9)
    usd_most = serializers.DecimalField(None, 9)
    answered = serializers.IntegerField(help_text="Rows whose answers are in the store already.")
    seconds = serializers.FloatField()
    is_time_guessed = serializers.BooleanField(help_text="A model among them was never asked.")
    lines = EstimateLineDocument(many=True)


class JobsView(ApiView):
    """The jobs, the youngest first."""

    permission_classes = (ReadersAndAdmins,)

    @describe(
        "Jobs, the youngest first", answers=page_of(JobDocument), query=JobQuery, name="listJobs"
    )
    def get(self, request: Request) -> Response:
        """With their counts."""
        query = read_query(request, JobQuery)
        rows = GenerationJob.objects.all()
        if "state" in query:
            rows = rows.filter(state=query["state"])
        return answer_page(request, rows, query, JobDocument, lines=count_each)

    @describe(
        "Launch a job", takes=JobBody, answers=ChangedJobDocument, status=201, name="launchJob"
    )
    def post(self, request: Request) -> Response:
        """As the page and the command do; workers begin at once."""
        body = JobBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = dict(body.validated_data)
        launch = partial(
            jobs.launch, caps=take_caps(given), **given, actor=cast(User, request.user)
        )
        return Response(change_job(launch), status=201)


class JobView(ApiView):
    """One job."""

    permission_classes = (StaffOnly,)

    @describe("A job", answers=JobDocument, name="getJob")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """With its counts."""
        return Response(JobDocument(count_rows(find_job(code))).data)


class JobProgressView(ApiView):
    """How far a job is."""

    permission_classes = (StaffOnly,)

    @describe("How far a job is", answers=ProgressDocument, name="getJobProgress")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """State, counts by state, whether it is under way and whether anybody works on it."""
        found = count_rows(find_job(code))
        body = {
            "state": found.job.state,
            "total": found.total,
            "settled": found.settled,
            "by_state": {state.value: number for state, number in found.by_state.items()},
            "calls": found.job.spent_calls,
            "is_over": not found.is_moving,
            "is_worked_on": found.is_moving and workforce().works,
        }
        return Response(body)


class EstimateView(ApiView):
    """A job before it is launched."""

    permission_classes = (AdminsOnly,)

    @describe(
        "What a job would use", takes=EstimateBody, answers=EstimateDocument, name="estimateJob"
    )
    def post(self, request: Request) -> Response:
        """From recorded figures where there are some, else a guess; nothing is launched."""
        body = EstimateBody(data=request.data)
        body.is_valid(raise_exception=True)
        return Response(EstimateDocument(estimate(**body.validated_data)).data)


def find_job(code: uuid.UUID) -> GenerationJob:
    """The job of that code, 404 without one."""
    return get_object_or_404(GenerationJob, code=code)


def take_caps(given: dict[str, Any]) -> Caps:
    """The caps, taken out of what was given."""
    return Caps(**{name: given.pop(f"cap_{name}", None) for name in ("usd", "calls", "tokens")})


def change_job(change: Callable[[], GenerationJob], *, sends: bool = True) -> dict[str, Any]:
    """Change a job, put what waits on the queue, and tell of the job as it is then."""
    warnings: list[str] = []
    with transaction.atomic():
        job = change()
        if sends:
            transaction.on_commit(partial(_send, warnings, job.pk))
    found = dict(JobDocument(count_rows(job)).data)
    return found | {"warnings": warnings}


# --- Private -----------------------------------------------------------------------------------


def _send(warnings: list[str], job_pk: int) -> None:
    try:
        enqueue_job(job_pk)
    except QueueFault as error:
        warnings.append(translate(error))
