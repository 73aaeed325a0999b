"""Studies: opened, closed, and their progress; never who leads."""

from __future__ import annotations

import uuid
from typing import Any

from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import ADMINS, EXPERTS, STAFF
from arena.api.fields import FlagField, NumberField, StrictSerializer, TextField, WholeNumberField
from arena.api.paging import PageQuery, answer_page, page_of
from arena.api.schema import operation
from arena.api.views import ApiView
from arena.models import Study
from arena.pairing.target_lines import read_targets
from arena.queries.people import role_of
from arena.queries.progress import StudyProgress, of_these, studies_seen_by
from arena.services.shown_pictures import SampleRule
from arena.services.studies import PlanOptions, close_study, open_study

MOST_CHOSEN = 5_000
MOST_VOTES = 10_000
MOST_LINES = 2_000
HIGHEST_SEED = 2**63 - 1
WHO_AND_WHAT = (
    *("name", "contestants", "scenarios", "experts", "votes_per_expert", "seed"),
    "allow_simulated",
)
"""Arguments of `open_study` beside the options of the plan."""


def _slugs() -> serializers.ListField:
    return serializers.ListField(
        child=TextField(max_length=80), max_length=MOST_CHOSEN, help_text="Slugs."
    )


def _lines(words: str) -> serializers.ListField:
    return serializers.ListField(
        child=TextField(max_length=500, allow_blank=True),
        required=False,
        default=list,
        max_length=MOST_LINES,
        help_text=words,
    )


def _share(most: float) -> NumberField:
    return NumberField(required=False, default=0.0, min_value=0, max_value=most)


class StudyBody(StrictSerializer):
    """A new study; its rules are fixed from the moment it opens."""

    name = TextField(max_length=120)
    contestants = _slugs()
    scenarios = _slugs()
    experts = serializers.ListField(
        child=TextField(max_length=150), max_length=MOST_CHOSEN, help_text="Usernames."
    )
    votes_per_expert = WholeNumberField(min_value=1, max_value=MOST_VOTES)
    seed = WholeNumberField(required=False, default=1, min_value=0, max_value=HIGHEST_SEED)
    repeat_share = _share(0.5)
    check_share = _share(0.5)
    overlap_share = _share(0.8)
    adaptive_share = _share(0.9)
    targets = _lines("“CONTESTANT NUMBER” or “CONTESTANT vs CONTESTANT NUMBER” each.")
    hypotheses = _lines("What is expected, a line each; frozen at the opening.")
    allow_both_miss = FlagField(required=False, default=False)
    allow_text = FlagField(required=False, default=False)
    allow_replay = FlagField(required=False, default=False)
    allow_measures = FlagField(required=False, default=True)
    allow_simulated = FlagField(required=False, default=False)
    settle_alike = FlagField(required=False, default=False)
    practice = FlagField(required=False, default=False)
    samples = serializers.ChoiceField(
        choices=[rule.value for rule in SampleRule], required=False, default=SampleRule.ONE.value
    )
    jobs = serializers.ListField(
        child=TextField(max_length=120),
        required=False,
        default=list,
        max_length=MOST_CHOSEN,
        help_text="Names or codes of the jobs whose augmentations are shown; none for all.",
    )


class StudyQuery(PageQuery):
    """Which studies."""

    state = serializers.ChoiceField(choices=Study.State.values, required=False)


class StudyDocument(serializers.Serializer[Any]):
    """A study and the progress of its votes; an expert gets their own."""

    code = serializers.UUIDField(source="study.code")
    name = serializers.CharField(source="study.name")
    state = serializers.CharField(source="study.state")
    planned = serializers.IntegerField(help_text="Pairs to be judged.")
    voted = serializers.IntegerField()
    skipped = serializers.IntegerField()
    left = serializers.IntegerField()
    opened_at = serializers.DateTimeField(source="study.opened_at", allow_null=True)
    closed_at = serializers.DateTimeField(source="study.closed_at", allow_null=True)


class NamesField(serializers.ListField):
    """One column of related rows."""

    child = serializers.CharField()

    def __init__(self, column: str, **kwargs: Any) -> None:
        self.column = column
        super().__init__(help_text=f"Each by its {column}.", **kwargs)

    def to_representation(self, rows: Any) -> list[str]:
        """Return the values, sorted."""
        return list(rows.order_by(self.column).values_list(self.column, flat=True))


class WholeStudyDocument(StudyDocument):
    """A study with its participants, for staff."""

    contestants = NamesField("slug", source="study.contestants")
    scenarios = NamesField("slug", source="study.scenarios")
    experts = NamesField("username", source="study.experts")
    votes_per_expert = serializers.IntegerField(source="study.votes_per_expert")
    seed = serializers.IntegerField(source="study.seed")
    allow_both_miss = serializers.BooleanField(source="study.allow_both_miss")
    allow_text = serializers.BooleanField(source="study.allow_text")
    allow_replay = serializers.BooleanField(source="study.allow_replay")
    allow_measures = serializers.BooleanField(source="study.allow_measures")
    allow_simulated = serializers.BooleanField(source="study.allow_simulated")


class StudiesView(ApiView):
    """Studies."""

    readers, writers = (*STAFF, *EXPERTS), ADMINS

    @operation(
        "Studies, the youngest first",
        answers=page_of(StudyDocument),
        query=StudyQuery,
        name="listStudies",
    )
    def get(self, request: Request, given: dict[str, Any]) -> Response:
        """An expert gets their own with their own progress, staff all with everybody's."""
        is_staff = role_of(self.user) in STAFF
        expert = None if is_staff else self.user
        return answer_page(
            request,
            studies_seen_by(self.user, is_staff=is_staff),
            given,
            StudyDocument,
            lines=lambda page: of_these(page, expert=expert),
        )

    @operation(
        "Plan a study and open it",
        takes=StudyBody,
        answers=WholeStudyDocument,
        status=201,
        name="openStudy",
    )
    def post(self, request: Request, given: dict[str, Any]) -> StudyProgress:
        """Its experts can vote at once."""
        return _progress(open_study(**study_rules(given), actor=self.user))


class StudyView(ApiView):
    """One study."""

    readers = STAFF

    @operation("A study", answers=WholeStudyDocument, name="getStudy")
    def get(self, request: Request, code: uuid.UUID) -> StudyProgress:
        """With its participants."""
        return _progress(get_study(code))


class CloseStudyView(ApiView):
    """The end of a study."""

    writers = ADMINS

    @operation("Close a study", answers=WholeStudyDocument, name="closeStudy")
    def post(self, request: Request, code: uuid.UUID) -> StudyProgress:
        """Ends voting for good. Twice changes nothing."""
        return _progress(close_study(study=get_study(code), actor=self.user))


def study_rules(given: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments of `open_study` from a valid body.

    Raises:
        NothingToPlan: A target can't be parsed.
    """
    who = {name: given.pop(name) for name in WHO_AND_WHAT}
    appearances, pair_votes = read_targets(given.pop("targets"))
    options = PlanOptions(
        appearances=appearances,
        pair_votes=pair_votes,
        hypotheses=tuple(given.pop("hypotheses")),
        jobs=tuple(given.pop("jobs")),
        samples=SampleRule(given.pop("samples")),
        **given,
    )
    return who | {"options": options}


def get_study(code: uuid.UUID) -> Study:
    """Return the study with that code, or raise 404."""
    return get_object_or_404(Study.objects.select_related("vote_file"), code=code)


def _progress(study: Study) -> StudyProgress:
    (found,) = of_these([study])
    return found
