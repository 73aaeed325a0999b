"""GET /api/v1/matchups?study=<code>&n=4: what the expert judges next."""

from __future__ import annotations

from typing import Any

from django.contrib.auth.models import User
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import ExpertsOnly
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer
from arena.api.schema import describe
from arena.errors import StudyNotOpen
from arena.models import Study
from arena.queries.showings import as_shown
from arena.queries.studies import voting_study
from arena.services.replanning import next_pairs
from augment.services.wording import translate_all

AHEAD = 4
"""How many pairs a browser keeps ready."""

MOST = 12


class MatchupsQuery(StrictSerializer):
    """The question: which study, and how many matchups at most."""

    study = serializers.UUIDField()
    n = serializers.IntegerField(min_value=1, max_value=MOST, default=AHEAD)


class SidesDocument(serializers.Serializer[Any]):
    """What changed, in words, a sentence for each object."""

    a = serializers.ListField(child=serializers.CharField())
    b = serializers.ListField(child=serializers.CharField())


class MatchupDocument(serializers.Serializer[Any]):
    """All that an expert learns of a pair."""

    matchup = serializers.UUIDField()
    position = serializers.IntegerField()
    instruction = serializers.CharField()
    a = serializers.CharField(help_text="The address of a picture.")
    b = serializers.CharField(help_text="The address of a picture.")
    original = serializers.CharField(
        allow_null=True, help_text="The scene before any change, null where it was never drawn."
    )
    px_per_m = serializers.FloatField()
    ego_px = serializers.ListField(child=serializers.FloatField())
    width = serializers.IntegerField()
    height = serializers.IntegerField()
    legend = serializers.ListField(
        child=serializers.CharField(),
        required=False,
        help_text="Which kinds of marks the two pictures hold; absent of pairs planned before.",
    )
    text = SidesDocument(required=False, help_text="In studies that offer it.")


class MatchupsView(ApiView):
    """The expert's own next matchups; nobody else's, and nothing about who made the pictures."""

    permission_classes = (ExpertsOnly,)
    is_never_cached = True
    may_miss = True
    read_errors = (410,)

    @describe(
        "The next pairs of the expert who asks",
        answers=MatchupDocument(many=True),
        query=MatchupsQuery,
        name="listMatchups",
    )
    def get(self, request: Request) -> Response:
        """A list, empty when all is done."""
        query = MatchupsQuery(data=request.query_params.dict())
        query.is_valid(raise_exception=True)
        expert: User = request.user  # type: ignore[assignment]
        study = voting_study(expert=expert, code=query.validated_data["study"])
        if study.state != Study.State.OPEN:
            raise StudyNotOpen(f"The study {study.name!r} takes no votes: it is {study.state}.")
        matchups = next_pairs(study=study, expert=expert, n=query.validated_data["n"])
        return Response([as_shown(matchup, translate_all) for matchup in matchups])
