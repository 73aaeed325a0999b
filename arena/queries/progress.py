"""How far the voting is, without a word on who wins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from django.contrib.auth.models import User
from django.db.models import Count, Q, QuerySet

from arena.models import Study, Vote

_DECIDED = Q(matchups__votes__isnull=False)
_SKIPPED = Q(matchups__votes__outcome=Vote.Outcome.SKIP, matchups__votes__superseded_by=None)
_PLANNED = Count("matchups", distinct=True)


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
    """Every study, or those that are given, the youngest first."""
    rows = Study.objects.select_related("vote_file").annotate(planned=_PLANNED, **_counted(Q()))
    if studies is not None:
        rows = rows.filter(pk__in=[study.pk for study in studies])
    return [_line(row) for row in rows]


def studies_seen_by(user: User, *, is_staff: bool) -> QuerySet[Study]:
    """Staff see every study, an expert those that they were invited to; no drafts."""
    if is_staff:
        return Study.objects.all()
    return Study.objects.filter(experts=user).exclude(state=Study.State.DRAFT)


def of_these(studies: Sequence[Study], *, expert: User | None = None) -> list[StudyProgress]:
    """Some studies in their order, counted over all experts or over one's own; one query."""
    own = Q() if expert is None else Q(matchups__expert=expert)
    planned = Count("matchups", filter=own, distinct=True) if expert else _PLANNED
    rows = Study.objects.filter(pk__in=[study.pk for study in studies])
    found = {row.pk: row for row in rows.annotate(planned=planned, **_counted(own))}
    later = None if expert is None else expert.username
    return [
        _line(found[study.pk], None if later is None else study.votes_to_plan.get(later, 0))
        for study in studies
    ]


def of_expert(expert: User) -> list[StudyProgress]:
    """The studies that an expert was invited to, counted over their own matchups; no drafts."""
    own = Q(matchups__expert=expert)
    rows = (
        Study.objects.filter(experts=expert)
        .exclude(state=Study.State.DRAFT)
        .annotate(
            planned=Count("matchups", filter=own, distinct=True),
            **_counted(own),
        )
    )
    return [_line(row, row.votes_to_plan.get(expert.username, 0)) for row in rows]


def of_study(study: Study) -> StudyProgress:
    """One study over all its experts."""
    return _line(Study.objects.annotate(planned=_PLANNED, **_counted(Q())).get(pk=study.pk))


def _counted(whose: Q) -> dict[str, Count]:
    return {
        "decided": Count("matchups", filter=whose & _DECIDED, distinct=True),
        "skipped": Count("matchups", filter=whose & _SKIPPED, distinct=True),
    }


def _line(row: Study, later: int | None = None) -> StudyProgress:
    """The counts of an annotated row, with the votes that the adaptive part still plans."""
    if later is None:
        later = sum(row.votes_to_plan.values())
    planned: int = row.planned  # type: ignore[attr-defined]
    decided: int = row.decided  # type: ignore[attr-defined]
    skipped: int = row.skipped  # type: ignore[attr-defined]
    return StudyProgress(
        study=row, planned=planned + later, voted=decided - skipped, skipped=skipped
    )
