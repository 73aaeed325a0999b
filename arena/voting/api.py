"""Operations of an expert: pairs, their pictures, votes, reports and preferences."""

from typing import Any

from django.core.files.storage import default_storage
from django.http import Http404, HttpResponse
from django.http.response import HttpResponseBase
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.permissions import IsAuthenticated
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api import fields
from arena.api.access import ADMINS, EXPERTS
from arena.api.views import ApiView, FileView, Params, file_operation, operation
from arena.errors import BeingDrawn
from arena.models import AIDS, OUTCOME_LETTERS, Question, Report, Vote
from arena.people.services import keep_voting
from arena.shell.sending import send_pictures
from arena.voting.queries.ballots import find_undrawn, is_being_drawn, require_open, upcoming
from arena.voting.queries.keys import SWITCHES, voting_switches
from arena.voting.queries.showings import as_shown, picture_shown
from arena.voting.services import casting
from arena.voting.services.reports import SIDES, Complaint, report

PNG = "image/png"
OUTCOMES = {letter: outcome for outcome, letter in OUTCOME_LETTERS.items()}
LONGEST_MS = 2**31 - 1
AHEAD, MOST = 4, 12
"""How many coming pairs are sent, by default and at most."""


class MatchupsQuery(fields.StrictSerializer):
    """Study, and largest number of pairs."""

    study = serializers.UUIDField()
    n = serializers.IntegerField(min_value=1, max_value=MOST, default=AHEAD)


class MatchupDocument(serializers.Serializer[Any]):
    """A pair as an expert sees it."""

    matchup = serializers.UUIDField()
    position = serializers.IntegerField()
    question = serializers.ChoiceField(
        choices=Question.choices,
        help_text="What is asked next; a pair comes until all are answered.",
    )
    instruction = serializers.CharField()
    a = serializers.CharField(help_text="The address of a picture.")
    b = serializers.CharField(help_text="The address of a picture.")
    original = serializers.CharField(
        allow_null=True, help_text="The scene before any change, null where it was never drawn."
    )
    unchanged = serializers.ListField(
        child=serializers.CharField(), help_text="Which of a and b show the scene as it was."
    )
    is_filmed = serializers.BooleanField(
        help_text="Both pictures have films: at their addresses with `?film`, as JSON."
    )
    px_per_m = serializers.FloatField()
    ego_px = serializers.ListField(child=serializers.FloatField())
    width = serializers.IntegerField()
    height = serializers.IntegerField()
    objects = serializers.DictField(
        child=serializers.ListField(child=serializers.ListField(child=serializers.FloatField())),
        required=False,
        help_text="Where the study asks what is wrong: of a and b the changed objects that can be "
        "marked, x, y and radius in pixels each.",
    )
    legend = serializers.ListField(
        child=serializers.CharField(),
        required=False,
        help_text="Which kinds of marks the two pictures hold; absent of pairs planned before.",
    )


class FaultBody(fields.StrictSerializer):
    """A mark of what is wrong."""

    side = serializers.ChoiceField(choices=["A", "B"])
    object = fields.WholeNumberField(min_value=0, help_text="Its place in `objects` of the side.")
    fault = serializers.ChoiceField(choices=casting.FAULT_CLASSES)


class VoteBody(fields.StrictSerializer):
    """One decision of an expert."""

    key = fields.CodeField()
    matchup = fields.CodeField()
    question = serializers.ChoiceField(
        choices=Question.choices, required=False, allow_blank=True, default=""
    )
    outcome = serializers.ChoiceField(choices=list(OUTCOMES))
    both_miss = fields.FlagField(required=False, default=False)
    strength = serializers.ChoiceField(
        choices=Vote.Strength.choices, required=False, allow_blank=True, default=""
    )
    reason = serializers.ChoiceField(
        choices=Vote.SkipReason.choices, required=False, allow_blank=True, default=""
    )
    comment = fields.TextField(
        required=False, allow_blank=True, default="", max_length=casting.LONGEST_COMMENT
    )
    ms_visible = fields.WholeNumberField(
        required=False, allow_null=True, default=None, min_value=0, max_value=LONGEST_MS
    )
    aids = serializers.ListField(
        child=serializers.ChoiceField(choices=AIDS), required=False, default=list, max_length=16
    )
    faults = FaultBody(many=True, required=False, default=list)
    supersedes = fields.CodeField(required=False, allow_null=True, default=None)
    n = fields.WholeNumberField(required=False, default=AHEAD, min_value=1, max_value=MOST)


class ReceivedDocument(serializers.Serializer[Any]):
    """The progress after a vote, and the next pairs."""

    saved = serializers.IntegerField(help_text="Pairs with a vote.")
    skipped = serializers.IntegerField(help_text="Pairs that were skipped instead.")
    total = serializers.IntegerField()
    next = MatchupDocument(many=True)


class ReportBody(fields.StrictSerializer):
    """One report of an expert."""

    key = fields.CodeField()
    matchup = fields.CodeField()
    reason = serializers.ChoiceField(choices=Report.Reason.choices)
    side = serializers.ChoiceField(choices=list(SIDES), required=False, default="both")
    comment = fields.TextField(
        required=False, allow_blank=True, default="", max_length=casting.LONGEST_COMMENT
    )


class SavedDocument(serializers.Serializer[Any]):
    """The report is stored."""

    saved = serializers.BooleanField()


class PreferencesBody(fields.StrictSerializer):
    """Changed preferences; missing fields stay."""

    def get_fields(self) -> dict[str, fields.Field]:
        """Return a field for every switch."""
        return {name: fields.FlagField(required=False) for name in SWITCHES}


class PreferencesDocument(serializers.Serializer[Any]):
    """All preferences."""

    def get_fields(self) -> dict[str, fields.Field]:
        """Return a field for every switch."""
        return {name: serializers.BooleanField() for name in SWITCHES}


class MatchupsView(ApiView):
    """An expert's own next pairs; nothing tells who made the pictures."""

    readers = EXPERTS
    is_never_cached = True

    @operation(MatchupDocument(many=True), query=MatchupsQuery, name="listMatchups")
    def get(self, params: Params) -> Response:
        """The next pairs of the expert who asks.

        An empty list when all is done; 409 `being_drawn` while workers draw what comes next.
        """
        study = get_object_or_404(self.user.studies, code=params["study"])
        require_open(study)
        matchups = upcoming(study=study, expert=self.user, n=params["n"])
        if not matchups and find_undrawn(study).filter(expert=self.user).exists():
            if not is_being_drawn(study):
                send_pictures(study.pk)
            raise BeingDrawn
        return Response([as_shown(matchup) for matchup in matchups])


class VotesView(ApiView):
    """An expert's own votes."""

    writers = EXPERTS
    is_never_cached = True

    @operation(ReceivedDocument, takes=VoteBody, name="vote")
    def post(self, params: Params) -> Response:
        """Vote.

        The same key counts once, however often it arrives.
        """
        n, outcome = params.pop("n"), OUTCOMES[params.pop("outcome")]
        marks = params.pop("faults")
        params["faults"] = [
            casting.FaultMark(SIDES[mark["side"]].value, mark["object"], mark["fault"])
            for mark in marks
        ]
        received = casting.receive_vote(
            expert=self.user, decision=casting.Decision(outcome=outcome, **params)
        )
        progress = received.progress
        coming = upcoming(study=received.study, expert=self.user, n=n)
        return Response(
            {
                "saved": progress.voted,
                "skipped": progress.skipped,
                "total": progress.total,
                "next": [as_shown(matchup) for matchup in coming],
            }
        )


class ReportsView(ApiView):
    """Reports of pairs; they change no vote."""

    writers = EXPERTS

    @operation(SavedDocument, takes=ReportBody, name="report")
    def post(self, params: Params) -> dict[str, bool]:
        """Report that something is wrong with a pair.

        The same key counts once, however often it arrives.
        """
        side = SIDES[params.pop("side")]
        report(expert=self.user, complaint=Complaint(side=side, **params))
        return {"saved": True}


class PreferencesView(ApiView):
    """The voting preferences of whoever is signed in."""

    permission_classes = (IsAuthenticated,)

    @operation(PreferencesDocument, takes=PreferencesBody, name="keepPreferences")
    def post(self, params: Params) -> Any:
        """Keep voting preferences.

        Answers with all of them.
        """
        keep_voting(self.user, params)
        return voting_switches(self.user)


class ShownPictureView(FileView):
    """A picture of a pair, by its token: the last part of its address in `a`, `b`, `original`."""

    readers = (*EXPERTS, *ADMINS)
    is_never_cached = True

    @file_operation(types=[PNG], name="getShownPicture")
    def get(self, request: Request, token: str) -> HttpResponseBase:
        """A picture of a pair.

        Has neither a name nor an ETag, which would show which pictures are the same.
        """
        name = picture_shown(user=self.user, token=token)
        if not name or not default_storage.exists(name):
            raise Http404
        with default_storage.open(name) as file:
            return HttpResponse(file.read(), content_type=PNG)
