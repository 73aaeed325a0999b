"""Studies that are set up over several sittings: drafts of the form, opened by the same rules."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django.contrib.auth.models import User
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import AdminsOnly, ReadersAndAdmins
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer, WholeNumberField
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from arena.api.studies import WholeStudyDocument, get_study, whole_study
from arena.api.study_body import StudyBody
from arena.models import StudyDraft
from arena.queries.study_drafts import missing_of
from arena.services.study_drafts import (
    FIELDS,
    change_draft,
    discard_draft,
    draft_like,
    keep_draft,
    open_draft,
)
from augment.services.wording import translate

HIGHEST_REVISION = 2**31 - 1


def _entered() -> serializers.DictField:
    words = "As the form of the page has it, shares in percent: " + ", ".join(FIELDS) + "."
    return serializers.DictField(help_text=words)


class StudyDraftLine(serializers.Serializer[Any]):
    """One draft of a list."""

    code = serializers.UUIDField()
    name = serializers.CharField(help_text="What the study is to be called; may be empty.")
    revision = serializers.IntegerField()
    changed_at = serializers.DateTimeField()


class MissingDocument(serializers.Serializer[Any]):
    """A name in a draft that can't be chosen any more."""

    field = serializers.CharField()
    name = serializers.CharField()
    why = serializers.SerializerMethodField()

    def get_why(self, found: Any) -> str:
        """A sentence."""
        return translate(found.why)


class WholeStudyDraftDocument(StudyDraftLine):
    """One draft with all that was entered."""

    entered = _entered()
    missing = MissingDocument(many=True)


class DraftBody(StrictSerializer):
    """What was entered so far; a field that is missing is empty."""

    entered = _entered()


class DraftChangeBody(DraftBody):
    """The same, and the revision that it was made of."""

    revision = WholeNumberField(min_value=1, max_value=HIGHEST_REVISION)


class OpenDraftBody(StudyBody):
    """The study that a draft became; the draft goes."""

    beside = ("revision",)
    revision = WholeNumberField(min_value=1, max_value=HIGHEST_REVISION)


class StudyDraftsView(ApiView):
    """The drafts."""

    permission_classes = (ReadersAndAdmins,)

    @describe(
        "Drafts of studies, the youngest first",
        answers=page_of(StudyDraftLine),
        query=PageQuery,
        name="listStudyDrafts",
    )
    def get(self, request: Request) -> Response:
        """Without what was entered."""
        rows = StudyDraft.objects.all()
        return answer_page(request, rows, read_query(request, PageQuery), StudyDraftLine)

    @describe(
        "Keep a draft of a study",
        takes=DraftBody,
        answers=WholeStudyDraftDocument,
        status=201,
        name="keepStudyDraft",
    )
    def post(self, request: Request) -> Response:
        """Nothing is asked of it but that it can be stored."""
        body = DraftBody(data=request.data)
        body.is_valid(raise_exception=True)
        made = keep_draft(**body.validated_data, actor=cast(User, request.user))
        return Response(_whole(made), status=201)


class StudyDraftView(ApiView):
    """One draft."""

    permission_classes = (AdminsOnly,)

    @describe("A draft of a study", answers=WholeStudyDraftDocument, name="getStudyDraft")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """With what of it is gone meanwhile."""
        return Response(_whole(_draft(code)))

    @describe(
        "Change a draft of a study",
        takes=DraftChangeBody,
        answers=WholeStudyDraftDocument,
        name="changeStudyDraft",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Refused where somebody else changed it meanwhile."""
        draft = _draft(code)
        body = DraftChangeBody(data=request.data)
        body.is_valid(raise_exception=True)
        actor = cast(User, request.user)
        return Response(_whole(change_draft(draft=draft, **body.validated_data, actor=actor)))


class DiscardDraftView(ApiView):
    """A draft that nobody needs."""

    permission_classes = (AdminsOnly,)

    @describe("Discard a draft", answers=WholeStudyDraftDocument, name="discardStudyDraft")
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Answers with what it was."""
        draft = _draft(code)
        was = _whole(draft)
        discard_draft(draft=draft, actor=cast(User, request.user))
        return Response(was)


class OpenDraftView(ApiView):
    """A draft that becomes a study."""

    permission_classes = (AdminsOnly,)

    @describe(
        "Open the study of a draft",
        takes=OpenDraftBody,
        answers=WholeStudyDocument,
        status=201,
        name="openStudyDraft",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """By these rules, which are not read from the draft; it goes then."""
        draft = _draft(code)
        body = OpenDraftBody(data=request.data)
        body.is_valid(raise_exception=True)
        rules = body.rules()
        study = open_draft(draft=draft, actor=cast(User, request.user), **rules)
        return Response(whole_study(study), status=201)


class DraftLikeView(ApiView):
    """The settings of a study, to be used again."""

    permission_classes = (AdminsOnly,)

    @describe(
        "Keep a draft with the settings of a study",
        answers=WholeStudyDraftDocument,
        status=201,
        name="draftLikeStudy",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Under a name that is free."""
        made = draft_like(study=get_study(code), actor=cast(User, request.user))
        return Response(_whole(made), status=201)


# --- Private -----------------------------------------------------------------------------------


def _draft(code: uuid.UUID) -> StudyDraft:
    return get_object_or_404(StudyDraft, code=code)


def _whole(draft: StudyDraft) -> dict[str, Any]:
    found = {name: getattr(draft, name) for name in ("code", "name", "revision", "changed_at")}
    found |= {"entered": draft.entered, "missing": missing_of(draft)}
    return dict(WholeStudyDraftDocument(found).data)
