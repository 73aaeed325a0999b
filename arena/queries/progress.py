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
    """A study and how many of its planned matchups have a vote."""

    study: Study
    planned: int
    voted: int

    @property
    def left(self) -> int:
        """Matchups that still wait for a vote."""
        return self.planned - self.voted


def of_studies() -> list[StudyProgress]:
    """Every study, the youngest first."""
    rows = Study.objects.annotate(planned=_PLANNED, voted=_VOTED)
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
    return [_line(row) for row in rows]


def of_study(study: Study) -> StudyProgress:
    """One study over all its experts."""
    return _line(Study.objects.annotate(planned=_PLANNED, voted=_VOTED).get(pk=study.pk))


def _line(row: Study) -> StudyProgress:
    return StudyProgress(study=row, planned=row.planned, voted=row.voted)  # type: ignore[attr-defined]
