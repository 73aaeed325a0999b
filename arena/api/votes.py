"""POST /api/v1/votes: what the expert decided; answers with what comes next."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.utils.decorators import method_decorator
from django.views.decorators.cache import never_cache
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import ExpertsOnly
from arena.api.errors import ApiView
from arena.api.fields import CodeField, StrictSerializer, WholeNumberField
from arena.api.letters import OUTCOMES
from arena.api.matchups import AHEAD, next_ones
from arena.queries.votes import votes_saved
from arena.services.votes import cast_vote

LONGEST_MS = 2**31 - 1


class VoteBody(StrictSerializer):
    """One decision of an expert."""

    key = CodeField()
    matchup = CodeField()
    outcome = serializers.ChoiceField(choices=list(OUTCOMES))
    supersedes = CodeField(required=False, allow_null=True, default=None)
    ms_visible = WholeNumberField(
        required=False, allow_null=True, default=None, min_value=0, max_value=LONGEST_MS
    )


@method_decorator(never_cache, name="dispatch")
class VotesView(ApiView):
    """Votes of the one who is signed in; there is no way to name somebody else."""

    permission_classes = (ExpertsOnly,)

    def post(self, request: Request) -> Response:
        """Store the vote once, however often it arrives."""
        body = VoteBody(data=request.data)
        body.is_valid(raise_exception=True)
        given = body.validated_data
        expert: User = request.user  # type: ignore[assignment]
        vote = cast_vote(
            expert=expert,
            matchup_code=given["matchup"],
            key=given["key"],
            outcome=OUTCOMES[given["outcome"]],
            supersedes=given["supersedes"],
            ms_visible=given["ms_visible"],
        )
        study = vote.matchup.study
        return Response(
            {
                "saved": votes_saved(study=study, expert=expert),
                "next": next_ones(study, expert, AHEAD),
            }
        )
