"""Generation jobs: estimated, launched and watched."""

import uuid
from functools import partial
from typing import Any

from django.http import Http404
from django.http.response import HttpResponseBase
from django.shortcuts import get_object_or_404
from django.utils.text import slugify
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api import views
from arena.api.access import ADMINS, STAFF
from arena.api.fields import RequestBody
from arena.exports.formats import download
from arena.jobs.exports.tables import JOB_TABLES
from augment.models import Augmentation, GenerationJob
from augment.services import running
from augment.services.running.estimates import estimate
from augment.services.running.jobs import launch


class JobQuery(views.PageQuery):
    """Filter of a list of jobs."""

    state = serializers.ChoiceField(choices=GenerationJob.State.values, required=False)


class CountsDocument(serializers.Serializer[Any]):
    """Number of a job's augmentations in each state."""

    state = serializers.CharField(source="job.state")
    total = serializers.IntegerField()
    settled = serializers.IntegerField()
    by_state = serializers.DictField(child=serializers.IntegerField())
    is_over = serializers.BooleanField(help_text="Whether nothing will change by itself.")


class JobDocument(CountsDocument):
    """A job."""

    code = serializers.UUIDField(source="job.code")
    name = serializers.CharField(source="job.name")
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


class ChangedJobDocument(JobDocument, views.WarnedDocument):
    """A job after a change."""


class ProgressDocument(CountsDocument):
    """The progress of a job, small enough to poll."""

    calls = serializers.IntegerField(source="job.spent_calls")
    is_worked_on = serializers.SerializerMethodField()

    def get_is_worked_on(self, counts: running.JobCounts) -> bool:
        """Return whether it is under way and workers run."""
        return counts.is_moving and running.workforce().works


class EstimateBody(RequestBody):
    """A job that is not launched."""

    request = running.JobScope


class JobBody(RequestBody):
    """A new job; a missing cap is none."""

    request = running.JobRequest


class UseDocument(serializers.Serializer[Any]):
    """An expected use; money is null where a price is unknown."""

    rows = serializers.IntegerField()
    calls = serializers.ListField(
        child=serializers.IntegerField(), help_text="At least, as expected, at most."
    )
    tokens_in = serializers.IntegerField(allow_null=True)
    tokens_out = serializers.IntegerField(allow_null=True)
    usd = serializers.DecimalField(None, 9, allow_null=True)


class EstimateLineDocument(UseDocument):
    """The expected use of one contestant."""

    slug = serializers.CharField()
    name = serializers.CharField()
    seen = serializers.IntegerField(
        help_text="Earlier augmentations that it rests on; 0 for a guess."
    )


class EstimateDocument(UseDocument):
    """The expected use of a job."""

    scenarios = serializers.IntegerField()
    contestants = serializers.IntegerField()
    lines = EstimateLineDocument(many=True)


class JobsView(views.ApiView):
    """Jobs."""

    readers, writers = STAFF, ADMINS

    @views.operation(views.page_serializer(JobDocument), query=JobQuery, name="listJobs")
    def get(self, params: views.Params) -> Response:
        """Jobs, the youngest first.

        With their counts.
        """
        return self.answer_page(
            GenerationJob.objects.all(), params, JobDocument, lines=running.count_each
        )

    @views.operation(ChangedJobDocument, takes=JobBody, status=201, name="launchJob")
    def post(self, params: views.Params) -> tuple[running.JobCounts, list[str]]:
        """Launch a job.

        Workers begin at once.
        """
        job, warnings = views.keep_and_send(
            partial(launch, running.JobRequest(**params), self.user)
        )
        return running.count_rows(job), warnings


class JobView(views.ApiView):
    """One job."""

    readers = STAFF

    @views.operation(JobDocument, name="getJob")
    def get(self, code: uuid.UUID) -> running.JobCounts:
        """A job.

        With its counts.
        """
        return running.count_rows(get_object_or_404(GenerationJob, code=code))


class JobProgressView(views.ApiView):
    """The progress of a job."""

    readers = STAFF

    @views.operation(ProgressDocument, name="getJobProgress")
    def get(self, code: uuid.UUID) -> running.JobCounts:
        """The progress of a job.

        Counts by state, and whether workers are busy with it.
        """
        return running.count_rows(get_object_or_404(GenerationJob, code=code))


class EstimateView(views.ApiView):
    """A job before it is launched."""

    writers = ADMINS

    @views.operation(EstimateDocument, takes=EstimateBody, name="estimateJob")
    def post(self, params: views.Params) -> Any:
        """Return the estimate of a job.

        From recorded calls; null where there are none, or no price.
        """
        return estimate(running.JobScope(**params))


class JobExportView(views.FileView):
    """A table of a job."""

    readers = STAFF

    @views.file_operation(name="exportJob", exports=JOB_TABLES)
    def get(self, request: Request, code: uuid.UUID, name: str, form: str) -> HttpResponseBase:
        """A table of a job as a file.

        The same bytes as on its page.
        """
        job = get_object_or_404(GenerationJob, code=code)
        if name not in JOB_TABLES:
            raise Http404
        table, stem = JOB_TABLES[name], f"{slugify(job.name) or 'job'}-{name}"
        if form not in table.formats:
            raise Http404
        return download(table.formats, form, stem, table.make(job))


class AugmentationDocument(views.RowDocument[Augmentation], views.WarnedDocument):
    """Augmentation of one scenario by one contestant."""

    job = serializers.UUIDField(source="job.code")
    scenario = serializers.CharField(source="scenario.slug")
    contestant = serializers.CharField(source="contestant.slug")
    follows = serializers.UUIDField(
        source="follows.code", default=None, allow_null=True, help_text="The step before."
    )
    instruction = serializers.CharField(
        source="scenario.wording", help_text="Of a follow-up every step's, numbered."
    )
    modification = serializers.DictField(allow_null=True)

    class Meta:
        model = Augmentation
        fields = (
            *("code", "job", "scenario", "contestant", "sample", "follows", "instruction"),
            *("state", "reason", "notes", "modification", "created_at", "finished_at", "warnings"),
        )


class FollowUpBody(RequestBody):
    """Change that is asked for in an answer; a missing cap is no cap."""

    request = running.FollowUpRequest


class AugmentationView(views.ApiView):
    """One augmentation."""

    readers = STAFF

    @views.operation(AugmentationDocument, name="getAugmentation")
    def get(self, code: uuid.UUID) -> Augmentation:
        """An augmentation.

        Its modification is there once its state is done.
        """
        return _augmentation(code)


class FollowUpsView(views.ApiView):
    """Follow-ups of an augmentation: the contestant's next instructions."""

    writers = ADMINS

    @views.operation(AugmentationDocument, takes=FollowUpBody, status=201, name="followUp")
    def post(self, code: uuid.UUID, params: views.Params) -> tuple[Augmentation, list[str]]:
        """Have a language model change its own answer further.

        A job of its own does it; to go back is to follow up an earlier step.
        """
        ask = partial(
            running.ask_follow_up, _augmentation(code), running.FollowUpRequest(**params)
        )
        return views.keep_and_send(partial(ask, actor=self.user))


def _augmentation(code: uuid.UUID) -> Augmentation:
    rows = Augmentation.objects.select_related("job", "scenario__base_scene", "contestant")
    return get_object_or_404(rows.defer("scenario__base_scene__recording"), code=code)
