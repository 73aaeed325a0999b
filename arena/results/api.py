"""Ratings of a study with their tables, for staff who may read its results."""

import uuid
from collections.abc import Callable
from dataclasses import fields
from functools import partial
from typing import Any

from django.http.response import HttpResponseBase
from django.shortcuts import get_object_or_404
from drf_spectacular.utils import extend_schema_field
from rest_framework import serializers
from rest_framework.request import Request

from arena.api import views
from arena.api.access import STAFF
from arena.api.fields import RequestBody
from arena.errors import NoSnapshot
from arena.models import Snapshot, Study
from arena.models.ratings import STORED
from arena.rating.leaderboard import Line
from arena.results.exports.tables import leaderboard_table
from arena.results.exports.writers import RATING_FILES, download_rating
from arena.results.services.rating_request import RatingRequest
from arena.results.services.ratings import is_big, plan_snapshot
from arena.results.services.ratings import rate_now as rate
from arena.shell.sending import send_charts
from arena.studies.api import get_study
from arena.voting.queries.blinding import must_read_results
from augment.services import read_request

_FIELDS: dict[Any, Callable[[], serializers.Field[Any, Any, Any, Any]]] = {
    str: serializers.CharField,
    int: serializers.IntegerField,
    int | None: partial(serializers.IntegerField, allow_null=True),
    float | None: partial(serializers.FloatField, allow_null=True),
}
"""By the type of a line's field."""


class StandingDocument(serializers.Serializer[Any]):
    """A contestant; null is what the votes do not determine."""

    slug = serializers.CharField()
    name = serializers.CharField()
    kind = serializers.CharField()
    simulated = serializers.BooleanField(source="is_simulated")
    settled_ties = serializers.IntegerField(
        help_text="Ties on pairs that nobody was shown, which are no votes."
    )
    part = serializers.IntegerField(
        help_text="Ratings compare only those with the same number here."
    )

    def get_fields(self) -> dict[str, serializers.Field[Any, Any, Any, Any]]:
        """Return these and all stored fields of a line."""
        kinds = {column.name: _FIELDS[column.type] for column in fields(Line)}
        stored = {name: kinds[name]() for name in STORED}
        stored["elo"] = serializers.FloatField(source="rating", allow_null=True)
        del stored["rating"]
        for name in ("votes", "ties"):
            stored[name] = serializers.IntegerField(source=f"{name}_cast")
        return {**super().get_fields(), **stored}


class TableDocument(serializers.Serializer[Any]):
    """The table of a rating, best first, with its warnings."""

    method = serializers.CharField(source="method_text")
    left_out = serializers.DictField(child=serializers.IntegerField())
    warnings = serializers.ListField(child=serializers.CharField())
    rows = StandingDocument(many=True)


class SnapshotDocument(views.RowDocument[Snapshot]):
    """A rating with its table, which is null until it is ready."""

    study = serializers.UUIDField(source="study.code")
    resample = serializers.CharField(source="resampling_unit")
    votes = serializers.IntegerField(source="votes_cast")
    settled_ties = serializers.IntegerField(
        source="results.board.settled_ties", allow_null=True, help_text="null where uncounted"
    )
    status = serializers.CharField(
        source="reason", help_text="why there is no rating, if there is none"
    )
    table = serializers.SerializerMethodField()

    class Meta:
        model = Snapshot
        fields = (
            *("code", "study", "state", "progress", "method", "rounds", "resample", "intervals"),
            *("seed", "filters", "votes", "votes_sha256", "is_early", "includes_simulated"),
            *("status", "made_at", "table", "settled_ties"),
        )

    @extend_schema_field(TableDocument(allow_null=True))
    def get_table(self, row: Snapshot) -> Any:
        """Return the table."""
        ready = row.state == Snapshot.State.READY
        return TableDocument(leaderboard_table(row)).data if ready else None


class SnapshotBody(RequestBody):
    """Rules of a rating; a missing field is the default."""

    request = RatingRequest


class SnapshotsView(views.ApiView):
    """The ratings of a study."""

    writers = STAFF

    @views.operation(SnapshotDocument, takes=SnapshotBody, status=201, name="rateStudy")
    def post(self, code: uuid.UUID, params: views.Params) -> Snapshot:
        """Rate the votes as they are now.

        A worker rates large studies: poll the rating until its state is ready.
        """
        study = get_study(code)
        must_read_results(user=self.user, study=study)
        choices = read_request(RatingRequest, params).choices()
        choices |= {"early": study.state == Study.State.OPEN, "actor": self.user}
        if not is_big(study):
            snapshot = rate(study=study, **choices)
            views.keep_and_send(lambda: snapshot, partial(send_charts, snapshot.pk))
            return snapshot
        plan = partial(plan_snapshot, study=study, **choices)
        planned, warnings = views.keep_and_send(plan)
        planned.reason = " ".join([planned.reason, *warnings]).strip()
        return planned


class SnapshotView(views.ApiView):
    """One rating."""

    readers = STAFF

    @views.operation(SnapshotDocument, name="getSnapshot")
    def get(self, code: uuid.UUID) -> Snapshot:
        """A rating with its table.

        Of an open study only after an early look, which is taken on its page.
        """
        return get_snapshot(self, code)


def get_snapshot(view: views.ApiView, code: uuid.UUID) -> Snapshot:
    """Return the rating with that code, for whoever may read the results of its study.

    Raises:
        StudyStillOpen, NotYours: They may not, or not before an early look.
    """
    rows = Snapshot.objects.select_related("study__vote_file")
    snapshot = get_object_or_404(rows, code=code)
    must_read_results(user=view.user, study=snapshot.study)
    return snapshot


class SnapshotExportView(views.FileView):
    """A rating as a file."""

    readers = STAFF

    @views.file_operation(name="exportSnapshot", exports=RATING_FILES)
    def get(self, request: Request, code: uuid.UUID, name: str, form: str) -> HttpResponseBase:
        """A rating as a file.

        Its table, votes, a chart, or all of them in a zip.
        """
        snapshot = get_snapshot(self, code)
        if snapshot.state != Snapshot.State.READY:
            raise NoSnapshot("This rating is not ready.")
        return download_rating(snapshot, name, form)
