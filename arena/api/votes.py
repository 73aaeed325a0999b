"""/api/v1/votes: what the expert decided. A POST answers with what comes next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from django.contrib.auth.models import User
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import ExpertsOnly
from arena.api.errors import ApiView
from arena.api.fields import CodeField, FlagField, StrictSerializer, TextField, WholeNumberField
from arena.api.matchups import AHEAD, MOST, MatchupDocument
from arena.api.schema import describe
from arena.models import AIDS, OUTCOME_LETTERS, Matchup, Vote
from arena.queries.showings import as_shown
from arena.queries.studies import voting_study
from arena.queries.votes import recent_votes
from arena.services.decisions import LONGEST_COMMENT, decision_of
from arena.services.replanning import next_pairs
from arena.services.votes import receive_vote
from augment.services.wording import translate_all

OUTCOMES = {letter: outcome for outcome, letter in OUTCOME_LETTERS.items()}
LONGEST_MS = 2**31 - 1
MOST_VOTES = 50


class VoteBody(StrictSerializer):
    """One decision of an expert."""

    key = CodeField()
    matchup = CodeField()
    outcome = serializers.ChoiceField(choices=list(OUTCOMES))
    both_miss = FlagField(required=False, default=False)
    reason = serializers.ChoiceField(
        choices=Vote.SkipReason.choices, required=False, allow_blank=True, default=""
    )
    comment = TextField(required=False, allow_blank=True, default="", max_length=LONGEST_COMMENT)
    ms_visible = WholeNumberField(
        required=False, allow_null=True, default=None, min_value=0, max_value=LONGEST_MS
    )
    aids = serializers.ListField(
        child=serializers.ChoiceField(choices=AIDS), required=False, default=list, max_length=16
    )
    supersedes = CodeField(required=False, allow_null=True, default=None)
    n = WholeNumberField(required=False, default=AHEAD, min_value=1, max_value=MOST)


_BODY = VoteBody()
"""Reads every vote: making its fields anew cost a tenth of one. Reading changes nothing in it."""


class VotesQuery(StrictSerializer):
    """The question: which study, and how many votes at most."""

    study = serializers.UUIDField()
    n = serializers.IntegerField(min_value=1, max_value=MOST_VOTES, default=10)


class VoteDocument(serializers.Serializer[Any]):
    """A vote of whoever asks, with its pair."""

    key = serializers.UUIDField()
    outcome = serializers.ChoiceField(choices=list(OUTCOMES))
    both_miss = serializers.BooleanField()
    reason = serializers.CharField()
    comment = serializers.CharField()
    matchup = MatchupDocument()


class ReceivedDocument(serializers.Serializer[Any]):
    """What a vote is answered with."""

    saved = serializers.IntegerField(help_text="Pairs with a vote.")
    skipped = serializers.IntegerField(help_text="Pairs that were skipped instead.")
    total = serializers.IntegerField()
    minutes_left = serializers.IntegerField(allow_null=True)
    next = MatchupDocument(many=True)


class VotesView(ApiView):
    """Votes of the one who is signed in; there is no way to name somebody else."""

    permission_classes = (ExpertsOnly,)
    is_never_cached = True
    may_miss = True

    @describe(
        "The expert's current votes, the latest pair first",
        answers=VoteDocument(many=True),
        query=VotesQuery,
        name="listVotes",
    )
    def get(self, request: Request) -> Response:
        """The expert's current votes, the latest matchup first."""
        query = VotesQuery(data=request.query_params.dict())
        query.is_valid(raise_exception=True)
        expert: User = request.user  # type: ignore[assignment]
        study = voting_study(expert=expert, code=query.validated_data["study"])
        votes = recent_votes(study=study, expert=expert, n=query.validated_data["n"])
        return Response([_as_given(vote) for vote in votes])

    @describe("Vote", takes=VoteBody, answers=ReceivedDocument, name="vote")
    def post(self, request: Request) -> Response:
        """Store the vote once, however often it arrives."""
        given = dict(_BODY.run_validation(request.data))
        n = given.pop("n")
        outcome = OUTCOMES[given.pop("outcome")]
        expert: User = request.user  # type: ignore[assignment]
        decision = decision_of(matchup_code=given.pop("matchup"), outcome=outcome, **given)
        received = receive_vote(expert=expert, decision=decision, ahead=n)
        now = received.state
        coming: Sequence[Matchup] = received.coming
        if len(coming) < n:  # more may be planned now that this vote is known
            coming = next_pairs(study=now.study, expert=expert, n=n)
        return Response(
            {
                "saved": now.progress.voted,
                "skipped": now.progress.skipped,
                "total": now.progress.total,
                "minutes_left": now.progress.minutes_left,
                "next": [as_shown(matchup, translate_all) for matchup in coming],
            }
        )


def _as_given(vote: Vote) -> dict[str, Any]:
    """What the expert said, with the pair that it was said of."""
    return {
        "key": str(vote.key),
        "outcome": OUTCOME_LETTERS[vote.outcome],
        "both_miss": vote.both_miss,
        "reason": vote.reason,
        "comment": vote.comment,
        "matchup": as_shown(vote.matchup, translate_all),
    }
