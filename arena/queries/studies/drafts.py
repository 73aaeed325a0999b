"""Drafts of studies: which there are, and what of them is gone meanwhile."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from django.db.models import QuerySet

from arena.models import StudyDraft
from arena.queries.people import experts
from augment.models import Contestant, GenerationJob, Scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class Missing:
    """A name in a draft that can't be chosen any more.

    Attributes:
        field: Of the form.
        name: As the draft has it.
        why: A sentence.
    """

    field: str
    name: str
    why: str


def find_drafts(search: str = "") -> QuerySet[StudyDraft]:
    """Drafts, those that were changed last first."""
    found = StudyDraft.objects.select_related("changed_by__person")
    return found.filter(entered__name__icontains=search) if search else found


def missing_of(draft: StudyDraft) -> list[Missing]:
    """What the draft chooses and nobody could choose now, by field."""
    retired = "the contestant was retired"
    offered = Contestant.objects.exclude(kind=Contestant.Kind.CHECK)
    active = set(offered.filter(retired_at=None).values_list("slug", flat=True))
    known = set(offered.values_list("slug", flat=True))
    found = [
        Missing(
            field="contestants",
            name=name,
            why=retired if name in known else "there is no such contestant any more",
        )
        for name in draft.names_in("contestants")
        if name not in active
    ]
    accounts = {user.username for user in experts()}
    scenarios = set(Scenario.objects.values_list("slug", flat=True))
    jobs = {str(code) for code in GenerationJob.objects.values_list("code", flat=True)}
    found += _gone(draft, "experts", accounts, "no active expert has this name any more")
    found += _gone(draft, "scenarios", scenarios, "there is no such scenario any more")
    found += _gone(draft, "jobs", jobs, "there is no such job any more")
    return found


def _gone(draft: StudyDraft, field: str, known: set[str], why: str) -> Iterable[Missing]:
    return (
        Missing(field=field, name=name, why=why)
        for name in draft.names_in(field)
        if name not in known
    )
