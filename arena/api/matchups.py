"""GET /api/v1/matchups?study=<code>&n=4: what the expert judges next."""

from __future__ import annotations

from typing import Any

from django.contrib.auth.models import User
from django.urls import reverse
from django.utils.decorators import method_decorator
from django.views.decorators.cache import never_cache
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import ExpertsOnly
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer
from arena.errors import StudyNotOpen
from arena.models import Matchup, Study
from arena.queries.studies import voting_study
from arena.queries.votes import upcoming
from arena.services.votes import mark_served

AHEAD = 4
"""How many pairs a browser keeps ready."""


class MatchupsQuery(StrictSerializer):
    """The question: which study, and how many matchups at most."""

    study = serializers.UUIDField()
    n = serializers.IntegerField(min_value=1, max_value=12, default=AHEAD)


@method_decorator(never_cache, name="dispatch")
class MatchupsView(ApiView):
    """The expert's own next matchups; nobody else's, and nothing about who made the pictures."""

    permission_classes = (ExpertsOnly,)

    def get(self, request: Request) -> Response:
        """A list, empty when all is done."""
        query = MatchupsQuery(data=request.query_params.dict())
        query.is_valid(raise_exception=True)
        expert: User = request.user  # type: ignore[assignment]
        study = voting_study(expert=expert, code=query.validated_data["study"])
        if study.state != Study.State.OPEN:
            raise StudyNotOpen(f"The study {study.name!r} takes no votes: it is {study.state}.")
        return Response(next_ones(study, expert, query.validated_data["n"]))


def next_ones(study: Study, expert: User, n: int) -> list[dict[str, Any]]:
    """The next matchups as the wire shows them; they count as served from now on.

    A study that is not open has none: a replayed vote may be answered after the closing.
    """
    if study.state != Study.State.OPEN:
        return []
    matchups = upcoming(study=study, expert=expert, n=n)
    mark_served(matchups=matchups)
    return [as_shown(matchup) for matchup in matchups]


def as_shown(matchup: Matchup) -> dict[str, Any]:
    """All that an expert's browser learns of a matchup: tokens, never contestants."""
    return {
        "matchup": str(matchup.code),
        "position": matchup.position,
        "instruction": matchup.scenario.instruction,
        "a": reverse("matchup-image", args=[matchup.left_token]),
        "b": reverse("matchup-image", args=[matchup.right_token]),
    }
