"""A study before it is opened, in numbers: opened, counted, and taken back at once."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from django.db import transaction

from arena.models import Matchup
from arena.queries.studies.coverage import shared_units
from arena.services.prospects import usual_seconds
from arena.services.studies import open_study
from arena.services.study_estimate import StudyEstimate
from arena.services.study_plan import StudyPlan

Kind = Matchup.Kind


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyPreview:
    """What a study would be.

    Attributes:
        votes: Of all experts, those that are planned later among them.
        later: So many of them are planned later, by those before.
        repeats, checks: Shown on top of the votes.
        judged: Pairs of a scenario that somebody judges.
        shared: So many of them two experts or more.
        settled: Pairs that are settled as ties and shown to nobody.
        alike: So many of them because they are alike within the limits, identical ones among them.
        seconds: For one pair, from votes that were timed, else a guess.
        minutes: For each expert.
    """

    experts: int
    contestants: int
    scenarios: int
    votes: int
    later: int
    repeats: int
    checks: int
    judged: int
    shared: int
    settled: int
    alike: int
    seconds: float
    minutes: int


def preview_study(study_plan: StudyPlan) -> StudyPreview:
    """What opening this study would make; nothing is kept.

    Raises:
        ArenaError, AugmentError: It can't be opened.
    """
    with transaction.atomic():
        study = open_study(study_plan)
        kinds = Counter(study.matchups.values_list("kind", flat=True))
        later = sum(study.votes_to_plan.values())
        experts = study.experts.count()
        judged, shared = shared_units(study)
        sides = study.contestants.count(), study.scenarios.count()
        settled, alike = len(study.rules["identical"]), len(study.rules["alike"])
        transaction.set_rollback(True)
    seconds = usual_seconds() or StudyEstimate().seconds
    shown = kinds[Kind.MAIN] + later + kinds[Kind.REPEAT] + kinds[Kind.CHECK]
    return StudyPreview(
        experts=experts,
        contestants=sides[0],
        scenarios=sides[1],
        votes=kinds[Kind.MAIN] + later,
        later=later,
        repeats=kinds[Kind.REPEAT],
        checks=kinds[Kind.CHECK],
        judged=judged,
        shared=shared,
        settled=settled,
        alike=alike,
        seconds=float(seconds),
        minutes=round(shown / experts * seconds / 60),
    )
