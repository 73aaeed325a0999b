"""How far the voting is, without a word on who wins."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from django.contrib.auth.models import User
from django.db.models import Count, Exists, OuterRef, QuerySet

from arena.models import Matchup, Study, Vote


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyProgress:
    """A study and how many of its matchups have a vote; those to be planned later count too.

    Attributes:
        voted: Matchups with a vote; `skipped` those that were skipped instead.
    """

    study: Study
    planned: int
    voted: int
    skipped: int

    @property
    def left(self) -> int:
        """Matchups that still wait for a decision."""
        return self.planned - self.voted - self.skipped


def of_studies(studies: Sequence[Study] | None = None) -> list[StudyProgress]:
    """Every study, or those that are given, the youngest first; four queries."""
    rows = Study.objects.select_related("vote_file").defer(*_LONG)
    if studies is not None:
        rows = rows.filter(pk__in=[study.pk for study in studies])
    return of_these(list(rows))


def studies_seen_by(user: User, *, is_staff: bool) -> QuerySet[Study]:
    """Staff see every study, an expert those that they were invited to."""
    if is_staff:
        return Study.objects.all()
    return Study.objects.filter(experts=user)


def of_these(studies: Sequence[Study], *, expert: User | None = None) -> list[StudyProgress]:
    """Some studies in their order, counted over all experts or over one's own; three queries."""
    matchups = Matchup.objects.filter(study__in=[study.pk for study in studies])
    if expert is not None:
        matchups = matchups.filter(expert=expert)
    votes = Vote.objects.filter(matchup=OuterRef("pk"))
    planned = _count(matchups)
    # A matchup's first vote tells whether it has any, and stands in an index of its own.
    decided = _count(matchups.filter(Exists(votes.filter(supersedes=None))))
    skips = Vote.objects.filter(outcome=Vote.Outcome.SKIP, superseded_by=None).values("matchup")
    skipped = _count(matchups.filter(pk__in=skips))
    return [
        StudyProgress(
            study=study,
            planned=planned.get(study.pk, 0) + _planned_later(study, expert),
            voted=decided.get(study.pk, 0) - skipped.get(study.pk, 0),
            skipped=skipped.get(study.pk, 0),
        )
        for study in studies
    ]


def of_expert(expert: User) -> list[StudyProgress]:
    """The studies that an expert was invited to, counted over their own matchups."""
    seen = studies_seen_by(expert, is_staff=False).defer(*_LONG)
    return of_these(list(seen), expert=expert)


def of_study(study: Study) -> StudyProgress:
    """One study over all its experts."""
    (line,) = of_these([study])
    return line


# --- Private -----------------------------------------------------------------------------------

_LONG = ("rules", "preregistration")
"""Columns with a line for every picture of a study, which no progress needs."""


def _count(matchups: QuerySet[Matchup]) -> dict[int, int]:
    rows: Iterable[tuple[int, int]] = (
        matchups.order_by().values("study").annotate(n=Count("pk")).values_list("study", "n")
    )
    return dict(rows)


def _planned_later(study: Study, expert: User | None) -> int:
    """Showings that the adaptive part still plans."""
    if expert is None:
        return sum(study.votes_to_plan.values())
    return int(study.votes_to_plan.get(expert.username, 0))
