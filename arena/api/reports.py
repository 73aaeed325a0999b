"""POST /api/v1/reports: something is wrong with a pair."""

from __future__ import annotations

from typing import Any

from django.contrib.auth.models import User
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import ExpertsOnly
from arena.api.errors import ApiView
from arena.api.fields import CodeField, ShareField, StrictSerializer, TextField
from arena.api.schema import describe
from arena.models import Report
from arena.services.decisions import LONGEST_COMMENT
from arena.services.reports import SIDES, Complaint, report


class ReportBody(StrictSerializer):
    """One report of an expert."""

    key = CodeField()
    matchup = CodeField()
    reason = serializers.ChoiceField(choices=Report.Reason.choices)
    side = serializers.ChoiceField(choices=list(SIDES), required=False, default="both")
    mark = serializers.ListField(
        child=ShareField(),
        required=False,
        allow_null=True,
        default=None,
        min_length=2,
        max_length=2,
    )
    comment = TextField(required=False, allow_blank=True, default="", max_length=LONGEST_COMMENT)


class SavedDocument(serializers.Serializer[Any]):
    """That it is kept."""

    saved = serializers.BooleanField()


class ReportsView(ApiView):
    """Reports of the one who is signed in; they change no vote."""

    permission_classes = (ExpertsOnly,)

    @describe(
        "Report that something is wrong with a pair",
        takes=ReportBody,
        answers=SavedDocument,
        name="report",
    )
    def post(self, request: Request) -> Response:
        """Keep the report once, however often it arrives."""
        body = ReportBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = dict(body.validated_data)
        expert: User = request.user  # type: ignore[assignment]
        mark = given["mark"]
        said = Complaint(
            reason=given["reason"],
            side=SIDES[given["side"]],
            mark=None if mark is None else (mark[0], mark[1]),
            comment=given["comment"],
        )
        report(expert=expert, matchup_code=given["matchup"], key=given["key"], said=said)
        return Response({"saved": True})
