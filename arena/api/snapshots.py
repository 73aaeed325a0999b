"""Frozen ratings of a study with their tables, for staff who may read its results."""

from __future__ import annotations

import uuid
from functools import partial
from typing import Any, cast

from django.contrib.auth.models import User
from django.db import transaction
from django.http import Http404
from django.shortcuts import get_object_or_404
from drf_spectacular.utils import extend_schema_field
from rest_framework import serializers
from rest_framework.permissions import BasePermission
from rest_framework.request import Request
from rest_framework.response import Response
from rest_framework.views import APIView

from arena import tasks
from arena.api.errors import ApiView
from arena.api.fields import FlagField, StrictSerializer, TextField, WholeNumberField
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.schema import describe
from arena.api.studies import get_study
from arena.exports.tables import LeaderboardTable, for_experts, leaderboard_table
from arena.models import Snapshot, Study
from arena.pairing.order import MAIN, REPEAT
from arena.queries.people import role_of
from arena.queries.results import STAFF, must_read_results, snapshots_of
from arena.queries.vote_sets import Filters, of_experts
from arena.rating.bootstrap import Unit
from arena.rating.leaderboard import Intervals, Method
from arena.services.ratings import DEFAULT_ROUNDS, MOST_ROUNDS, is_big, plan_snapshot, rate
from augment.errors import QueueFault
from augment.services.scenarios.types import type_choices
from augment.services.wording import translate

HIGHEST_SEED = 2**63 - 1


class ResultReaders(BasePermission):
    """Experts read the results of their closed studies, as on the page; staff also rate."""

    def has_permission(self, request: Request, view: APIView) -> bool:
        """Whether the account may do what it asks for."""
        allowed = STAFF if request.method == "POST" else (*STAFF, "expert")
        return role_of(request.user) in allowed


class SnapshotDocument(serializers.Serializer[Any]):
    """One rating of a list."""

    code = serializers.UUIDField()
    study = serializers.UUIDField(source="study.code")
    state = serializers.CharField(help_text="queued, running, ready or failed.")
    progress = serializers.IntegerField(help_text="Percent.")
    method = serializers.CharField()
    rounds = serializers.IntegerField()
    resample = serializers.CharField(source="resampling_unit")
    intervals = serializers.CharField()
    seed = serializers.IntegerField()
    filters = serializers.SerializerMethodField()
    votes = serializers.IntegerField(source="votes_counted")
    votes_sha256 = serializers.CharField()
    is_early = serializers.BooleanField(help_text="The study was still open.")
    includes_simulated = serializers.BooleanField()
    status = serializers.CharField(help_text="Why there is no rating, if there is none.")
    made_at = serializers.DateTimeField()

    def get_filters(self, row: Snapshot) -> dict[str, Any]:
        """Which votes were asked for; an expert reads nothing of authors."""
        kept = dict(row.filters)
        return of_experts(kept) if self.context.get("is_expert") else kept


class StandingDocument(serializers.Serializer[Any]):
    """One contestant's line; null is what the votes do not determine."""

    slug = serializers.CharField()
    name = serializers.CharField()
    kind = serializers.CharField()
    simulated = serializers.BooleanField()
    rank = serializers.IntegerField(allow_null=True)
    rank_best = serializers.IntegerField(allow_null=True)
    rank_worst = serializers.IntegerField(allow_null=True)
    elo = serializers.FloatField(allow_null=True)
    lower = serializers.FloatField(allow_null=True)
    upper = serializers.FloatField(allow_null=True)
    votes = serializers.IntegerField()
    wins = serializers.IntegerField()
    ties = serializers.IntegerField()
    losses = serializers.IntegerField()
    note = serializers.CharField()
    part = serializers.IntegerField(
        help_text="Ratings compare only those with the same number here."
    )


class TableDocument(serializers.Serializer[Any]):
    """The table of a rating, best first, and what must be said with it."""

    method = serializers.CharField(source="method_text")
    left_out = serializers.DictField(child=serializers.IntegerField())
    warnings = serializers.SerializerMethodField()
    rows = StandingDocument(many=True)

    def get_warnings(self, table: LeaderboardTable) -> list[str]:
        """Sentences that no reader may miss."""
        return [translate(one) for one in table.warnings]


class WholeSnapshotDocument(SnapshotDocument):
    """One rating with its table, which is null until it is ready."""

    table = serializers.SerializerMethodField()

    @extend_schema_field(TableDocument(allow_null=True))
    def get_table(self, row: Snapshot) -> Any:
        """The table."""
        if row.state != Snapshot.State.READY:
            return None
        table = leaderboard_table(row)
        return TableDocument(for_experts(table) if self.context.get("is_expert") else table).data


class SnapshotBody(StrictSerializer):
    """How to rate; what is missing is the default."""

    method = serializers.ChoiceField(
        choices=[one.value for one in Method], required=False, default=Method.BRADLEY_TERRY.value
    )
    resample = serializers.ChoiceField(
        source="unit", choices=[one.value for one in Unit], required=False
    )
    intervals = serializers.ChoiceField(choices=[one.value for one in Intervals], required=False)
    rounds = WholeNumberField(
        required=False, default=DEFAULT_ROUNDS, min_value=1, max_value=MOST_ROUNDS
    )
    seed = WholeNumberField(required=False, default=0, min_value=0, max_value=HIGHEST_SEED)
    types = serializers.ListField(
        child=TextField(max_length=40), required=False, default=list, max_length=200
    )
    experts = serializers.ListField(
        child=TextField(max_length=200),
        required=False,
        default=list,
        max_length=5_000,
        help_text="Codes as a rating names them; none for all.",
    )
    with_repeats = FlagField(required=False, default=False)
    leave_out_settled = FlagField(required=False, default=False)
    leave_out_own = FlagField(required=False, default=False)


class SnapshotsView(ApiView):
    """The ratings of a study, the newest first."""

    permission_classes = (ResultReaders,)

    @describe(
        "Ratings of a study, the newest first",
        answers=page_of(SnapshotDocument),
        query=PageQuery,
        name="listSnapshots",
    )
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """Of an open study only after `POST .../early-look`; an expert's closed ones."""
        study, context = _readable(request, code), _context(request)
        rows = snapshots_of(study).select_related("study").defer("results")
        if context["is_expert"]:
            rows = rows.filter(state=Snapshot.State.READY)
        query = read_query(request, PageQuery)
        return answer_page(request, rows, query, SnapshotDocument, context=context)

    @describe(
        "Rate the votes as they are now",
        takes=SnapshotBody,
        answers=WholeSnapshotDocument,
        status=201,
        name="rateStudy",
    )
    def post(self, request: Request, code: uuid.UUID) -> Response:
        """Many votes are left to a worker: ask for the rating until its state is ready."""
        body = SnapshotBody(data=request.data)
        body.is_valid(raise_exception=True)
        study = _readable(request, code)
        wanted = _wanted(dict(body.validated_data)) | {
            "early": study.state == Study.State.OPEN,
            "actor": cast(User, request.user),
        }
        if not is_big(study):
            return Response(WholeSnapshotDocument(rate(study=study, **wanted)).data, status=201)
        with transaction.atomic():
            planned = plan_snapshot(study=study, **wanted)
            transaction.on_commit(partial(_send, planned))
        return Response(WholeSnapshotDocument(planned).data, status=201)


class SnapshotView(ApiView):
    """One rating."""

    permission_classes = (ResultReaders,)

    @describe("A rating with its table", answers=WholeSnapshotDocument, name="getSnapshot")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """Of an open study only after `POST .../early-look`; an expert's closed ones."""
        row, context = get_snapshot(request, code), _context(request)
        if context["is_expert"] and row.state != Snapshot.State.READY:
            raise Http404
        return Response(WholeSnapshotDocument(row, context=context).data)


def get_snapshot(request: Request, code: uuid.UUID) -> Snapshot:
    """The rating of that code, where whoever asks may read the results of its study.

    Raises:
        StudyStillOpen, NotYours: They may not, or not before an early look.
    """
    rows = Snapshot.objects.select_related("study__vote_file")
    snapshot = get_object_or_404(rows, code=code)
    must_read_results(user=cast(User, request.user), study=snapshot.study)
    return snapshot


# --- Private -----------------------------------------------------------------------------------


def _readable(request: Request, code: uuid.UUID) -> Study:
    study = get_study(code)
    must_read_results(user=cast(User, request.user), study=study)
    return study


def _context(request: Request) -> dict[str, bool]:
    """For whom the documents are."""
    return {"is_expert": role_of(request.user) == "expert"}


def _wanted(given: dict[str, Any]) -> dict[str, Any]:
    """As the service takes it."""
    kinds = (MAIN, REPEAT) if given.pop("with_repeats") else (MAIN,)
    known = [name for name, _ in type_choices()]
    for name in given["types"]:
        if name not in known:
            raise serializers.ValidationError(
                {"types": [f"There is no type {name!r}; there are {', '.join(known)}."]}
            )
    filters = Filters(
        types=tuple(given.pop("types")),
        experts=tuple(given.pop("experts")),
        kinds=kinds,
        leave_out_settled=given.pop("leave_out_settled"),
        leave_out_own=given.pop("leave_out_own"),
    )
    return given | {"filters": filters}


def _send(planned: Snapshot) -> None:
    """Without a broker it waits; its status says so to whoever asks."""
    try:
        tasks.send_snapshot(planned.pk)
    except QueueFault as error:
        planned.status = translate(error)
