"""Studies: opened, closed, and their progress; never who leads."""

import uuid
from typing import Any

from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.response import Response

from arena.api import access, fields, views
from arena.models import Study
from arena.shell.accounts import top_role
from arena.shell.sending import send_pictures
from arena.studies.queries import StudyProgress, count_progress, list_studies
from arena.studies.services.opening import close_study, open_study
from arena.studies.services.plan import PLAN_INPUTS, SWITCH_COLUMNS, StudyPlan


class StudyBody(fields.StrictSerializer):
    """A new study; its rules are fixed from the moment it opens."""

    def get_fields(self) -> dict[str, fields.Field]:
        """Return a field for all that a plan asks for."""
        return {field.name: fields.body_field(field) for field in PLAN_INPUTS}


class StudyQuery(views.PageQuery):
    """Filter of a list of studies."""

    state = serializers.ChoiceField(choices=Study.State.values, required=False)


class StudyDocument(serializers.Serializer[Any]):
    """A study and the progress of its votes; an expert gets their own."""

    code = serializers.UUIDField(source="study.code")
    name = serializers.CharField(source="study.name")
    state = serializers.CharField(source="study.state")
    planned = serializers.IntegerField(source="total", help_text="Pairs to be judged.")
    voted = serializers.IntegerField()
    skipped = serializers.IntegerField()
    left = serializers.IntegerField()
    opened_at = serializers.DateTimeField(source="study.opened_at", allow_null=True)
    closed_at = serializers.DateTimeField(source="study.closed_at", allow_null=True)


class NamesField(serializers.ListField):
    """One column of related rows."""

    child = serializers.CharField()

    def __init__(self, column: str, **kwargs: Any) -> None:
        self.column = column
        super().__init__(help_text=f"Each by its {column}.", **kwargs)

    def to_representation(self, rows: Any) -> list[str]:
        """Return the values, sorted."""
        return list(rows.order_by(self.column).values_list(self.column, flat=True))


class WholeStudyDocument(StudyDocument):
    """A study with its participants, for staff."""

    contestants = NamesField("slug", source="study.contestants")
    scenarios = NamesField("slug", source="study.scenarios")
    experts = NamesField("username", source="study.experts")
    questions = serializers.ListField(
        child=serializers.CharField(), source="study.questions", help_text="The primary one first."
    )
    votes_per_expert = serializers.IntegerField(source="study.votes_per_expert")
    seed = serializers.IntegerField(source="study.seed")

    def get_fields(self) -> dict[str, fields.Field]:
        """Return the fields above and the switches of the study."""
        switches = {
            name: serializers.BooleanField(source=f"study.{name}") for name in SWITCH_COLUMNS
        }
        return super().get_fields() | switches


class StudiesView(views.ApiView):
    """Studies."""

    readers, writers = (*access.STAFF, *access.EXPERTS), access.ADMINS

    @views.operation(views.page_serializer(StudyDocument), query=StudyQuery, name="listStudies")
    def get(self, params: views.Params) -> Response:
        """Studies, the youngest first.

        An expert gets their own with their own progress, staff all with everybody's.
        """
        expert = None if top_role(self.user) in access.STAFF else self.user
        return self.answer_page(
            list_studies(expert),
            params,
            StudyDocument,
            lines=lambda page: count_progress(page, expert),
        )

    @views.operation(WholeStudyDocument, takes=StudyBody, status=201, name="openStudy")
    def post(self, params: views.Params) -> StudyProgress:
        """Plan a study and open it.

        Its experts can vote as soon as workers have drawn their first pairs.
        """
        study = open_study(StudyPlan.read(params), actor=self.user)
        send_pictures(study.pk)
        return _progress(study)


class StudyView(views.ApiView):
    """One study."""

    readers = access.STAFF

    @views.operation(WholeStudyDocument, name="getStudy")
    def get(self, code: uuid.UUID) -> StudyProgress:
        """A study.

        With its participants.
        """
        return _progress(get_study(code))


class CloseStudyView(views.ApiView):
    """The end of a study."""

    writers = access.ADMINS

    @views.operation(WholeStudyDocument, name="closeStudy")
    def post(self, code: uuid.UUID) -> StudyProgress:
        """Close a study.

        Ends voting for good. Twice changes nothing.
        """
        return _progress(close_study(study=get_study(code), actor=self.user))


def get_study(code: uuid.UUID) -> Study:
    """Return the study with that code, or raise 404."""
    return get_object_or_404(Study.objects.select_related("vote_file"), code=code)


def _progress(study: Study) -> StudyProgress:
    (line,) = count_progress([study])
    return line
