"""How far the voting is, without a word on who wins."""

from __future__ import annotations

from dataclasses import dataclass

from django.contrib.auth.models import User
from django.db.models import Count, Q

from arena.models import Study

_VOTED = Count("matchups", filter=Q(matchups__votes__isnull=False), distinct=True)
_PLANNED = Count("matchups", distinct=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyProgress:
    """A study and how many of its matchups have a vote; those to be planned later count too."""

    study: Study
    planned: int
    voted: int

    @property
    def left(self) -> int:
        """Matchups that still wait for a vote."""
        return self.planned - self.voted


def of_studies() -> list[StudyProgress]:
    """Every study, the youngest first."""
    rows = Study.objects.select_related("vote_file").annotate(planned=_PLANNED, voted=_VOTED)
    return [_line(row) for row in rows]


def of_expert(expert: User) -> list[StudyProgress]:
    """The studies that an expert was invited to, counted over their own matchups; no drafts."""
    own = Q(matchups__expert=expert)
    rows = (
        Study.objects.filter(experts=expert)
        .exclude(state=Study.State.DRAFT)
        .annotate(
            planned=Count("matchups", filter=own, distinct=True),
            voted=Count("matchups", filter=own & Q(matchups__votes__isnull=False), distinct=True),
        )
    )
    return [_line(row, row.votes_to_plan.get(expert.username, 0)) for row in rows]


def of_study(study: Study) -> StudyProgress:
    """One study over all its experts."""
    return _line(Study.objects.annotate(planned=_PLANNED, voted=_VOTED).get(pk=study.pk))


def _line(row: Study, later: int | None = None) -> StudyProgress:
    """The counts of an annotated row, with the votes that the adaptive part still plans."""
    if later is None:
        later = sum(row.votes_to_plan.values())
    planned: int = row.planned  # type: ignore[attr-defined]
    return StudyProgress(
        study=row,
        planned=planned + later,
        voted=row.voted,  # type: ignore[attr-defined]
    )
