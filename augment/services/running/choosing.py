"""What people mean when they name contestants, scenarios and jobs to a command."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from uuid import UUID

from django.db.models import Q

from augment.errors import Conflict, UnknownName
from augment.models import Contestant, GenerationJob, Scenario
from augment.services.running.feasible import RUNNABLE

ALL, CATALOGUE = "all", "catalogue"


def resolve_contestants(given: Sequence[str]) -> list[str]:
    """The slugs; `all` stands for every contestant that a job can run."""
    if list(given) != [ALL]:
        return list(given)
    return list(Contestant.objects.filter(RUNNABLE).values_list("slug", flat=True))


def resolve_scenarios(given: Sequence[str]) -> list[str]:
    """The slugs; `all` stands for every scenario, `catalogue` for the authored ones."""
    if list(given) == [ALL]:
        return list(Scenario.objects.values_list("slug", flat=True))
    if list(given) == [CATALOGUE]:
        return list(Scenario.objects.filter(in_catalogue=True).values_list("slug", flat=True))
    return list(given)


def find_job(name_or_code: str) -> GenerationJob:
    """A job by its name or its code.

    Raises:
        UnknownName: There is none.
        Conflict: Several have that name.
    """
    wanted = Q(name=name_or_code)
    with suppress(ValueError):  # most names are not codes
        wanted |= Q(code=UUID(name_or_code))
    found = list(GenerationJob.objects.filter(wanted))
    if not found:
        names = GenerationJob.objects.values_list("name", flat=True)
        raise UnknownName("job", name_or_code, sorted(set(names)))
    if len(found) > 1:
        codes = ", ".join(str(job.code) for job in found)
        raise Conflict(f"{len(found)} jobs are called {name_or_code!r}; name one code: {codes}.")
    return found[0]
