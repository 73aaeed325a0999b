"""Studies: opened, closed, and how far their votes are; never who leads."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django.contrib.auth.models import User
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.permissions import BasePermission
from rest_framework.request import Request
from rest_framework.response import Response
from rest_framework.views import APIView

from arena.api.access import AdminsOnly, StaffOnly
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer, TextField
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from arena.api.study_body import StudyBody
from arena.models import Study
from arena.queries.people import role_of
from arena.queries.progress import StudyProgress, of_these, studies_seen_by
from arena.services.early_looks import open_early
from arena.services.ending import LONGEST_WHY
from arena.services.studies import cancel_study, close_study, open_study

STAFF = ("admin", "analyst")


class StudyReaders(BasePermission):
    """Experts see their own studies; staff see all, and admins open new ones."""

    def has_permission(self, request: Request, view: APIView) -> bool:
        """Whether the account may do what it asks for."""
        allowed = ("admin",) if request.method == "POST" else (*STAFF, "expert")
        return role_of(request.user) in allowed


class StudyQuery(PageQuery):
    """Which studies."""

    state = serializers.ChoiceField(choices=Study.State.values, required=False)


class StudyDocument(serializers.Serializer[Any]):
    """A study and how far its votes are; to an expert, their own."""

    code = serializers.UUIDField(source="study.code")
    name = serializers.CharField(source="study.name")
    state = serializers.CharField(source="study.state")
    planned = serializers.IntegerField(help_text="Pairs to be judged.")
    voted = serializers.IntegerField()
    skipped = serializers.IntegerField()
    left = serializers.IntegerField()
    opened_at = serializers.DateTimeField(source="study.opened_at", allow_null=True)
    closed_at = serializers.DateTimeField(source="study.closed_at", allow_null=True)


class WholeStudyDocument(StudyDocument):
    """A study with who takes part, for staff."""

    contestants = serializers.ListField(child=serializers.CharField(), help_text="Slugs.")
    scenarios = serializers.ListField(child=serializers.CharField(), help_text="Slugs.")
    experts = serializers.ListField(child=serializers.CharField(), help_text="Usernames.")
    votes_per_expert = serializers.IntegerField(source="study.votes_per_expert")
    seed = serializers.IntegerField(source="study.seed")
    allow_both_miss = serializers.BooleanField(source="study.allow_both_miss")
    allow_text = serializers.BooleanField(source="study.allow_text")
    allow_replay = serializers.BooleanField(source="study.allow_replay")
    allow_measures = serializers.BooleanField(source="study.allow_measures")
    allow_simulated = serializers.BooleanField(source="study.allow_simulated")


class StudiesView(ApiView):
    """The studies, the youngest first."""

    permission_classes = (StudyReaders,)

    @describe(
        "Studies, the youngest first",
        answers=page_of(StudyDocument),
        query=StudyQuery,
        name="listStudies",
    )
    def get(self, request: Request) -> Response:
        """An expert's own with their own progress, staff's all with everybody's."""
        query, user = read_query(request, StudyQuery), cast(User, request.user)
        is_staff = role_of(user) in STAFF
        rows = studies_seen_by(user, is_staff=is_staff)
        if "state" in query:
            rows = rows.filter(state=query["state"])
        expert = None if is_staff else user
        return answer_page(
            request, rows, query, StudyDocument, lines=lambda page: of_these(page, expert=expert)
        )

    @describe(
        "Plan a study and open it",
        takes=StudyBody,
        answers=WholeStudyDocument,
        status=201,
        name="openStudy",
    )
    def post(self, request: Request) -> Response:
        """Its experts can vote at once."""
        body = StudyBody(data=request.data)
        body.is_valid(raise_exception=True)
        study = open_study(**body.rules(), actor=cast(User, request.user))
        return Response(whole_study(study), status=201)


class StudyView(ApiView):
    """One study."""

    permission_classes = (StaffOnly,)

    @describe("A study", answers=WholeStudyDocument, name="getStudy")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """With who takes part."""
        return Response(whole_study(get_study(code)))


class CloseStudyView(ApiView):
    """The end of a study."""

    permission_classes = (AdminsOnly,)

    @describe("Close a study", answers=WholeStudyDocument, name="closeStudy")
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """No more votes are taken; there is no way back. Twice changes nothing."""
        return Response(
            whole_study(close_study(study=get_study(code), actor=cast(User, request.user)))
        )


class CancelBody(StrictSerializer):
    """Why a study is given up."""

    why = TextField(max_length=LONGEST_WHY, required=False, default="", allow_blank=True)


class CancelStudyView(ApiView):
    """A study that is given up."""

    permission_classes = (AdminsOnly,)

    @describe("Cancel a study", takes=CancelBody, answers=WholeStudyDocument, name="cancelStudy")
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """No more votes, no rating, no results; there is no way back. Twice changes nothing."""
        study = get_study(code)
        body = CancelBody(data=request.data)
        body.is_valid(raise_exception=True)
        actor = cast(User, request.user)
        return Response(
            whole_study(cancel_study(study=study, why=body.validated_data["why"], actor=actor))
        )


class EarlyLookView(ApiView):
    """Results before the end."""

    permission_classes = (StaffOnly,)

    @describe("Open the results of an open study", answers=StudyDocument, name="lookEarly")
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """An act that is written to the log; who votes in the study votes no longer."""
        study = get_study(code)
        open_early(study=study, actor=cast(User, request.user))
        return Response(StudyDocument(_progress(study)).data)


def get_study(code: uuid.UUID) -> Study:
    """The study of that code, 404 without one."""
    return get_object_or_404(Study.objects.select_related("vote_file"), code=code)


def whole_study(study: Study) -> dict[str, Any]:
    """As `WholeStudyDocument` has it."""
    lists = {
        "contestants": study.contestants.values_list("slug", flat=True),
        "scenarios": study.scenarios.values_list("slug", flat=True),
        "experts": study.experts.order_by("username").values_list("username", flat=True),
    }
    found = dict(StudyDocument(_progress(study)).data)
    for name in WholeStudyDocument().fields.keys() - found.keys() - lists.keys():
        found[name] = getattr(study, name)
    return found | {name: list(values) for name, values in lists.items()}


# --- Private -----------------------------------------------------------------------------------


def _progress(study: Study) -> StudyProgress:
    (found,) = of_these([study])
    return found
