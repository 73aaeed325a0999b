"""GET /api/v1/matchups?study=<code>&n=4: what the expert judges next."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.utils.decorators import method_decorator
from django.views.decorators.cache import never_cache
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import ExpertsOnly
from arena.api.errors import ApiView
from arena.api.fields import StrictSerializer
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
        matchups = next_pairs(study=study, expert=expert, n=query.validated_data["n"])
        return Response([as_shown(matchup, translate_all) for matchup in matchups])
