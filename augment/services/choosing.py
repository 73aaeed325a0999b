"""The words that stand for many slugs where people name contestants and scenarios."""

from __future__ import annotations

from collections.abc import Sequence

from augment.models import Contestant, Scenario
from augment.services.jobs import RUNNABLE

ALL, CATALOGUE = "all", "catalogue"


def chosen_contestants(given: Sequence[str]) -> list[str]:
    """The slugs; `all` stands for every contestant that a job can run."""
    if list(given) != [ALL]:
        return list(given)
    return list(Contestant.objects.filter(kind__in=RUNNABLE).values_list("slug", flat=True))


def chosen_scenarios(given: Sequence[str]) -> list[str]:
    """The slugs; `all` stands for every scenario, `catalogue` for the authored ones."""
    if list(given) == [ALL]:
        return list(Scenario.objects.values_list("slug", flat=True))
    if list(given) == [CATALOGUE]:
        return list(Scenario.objects.filter(in_catalogue=True).values_list("slug", flat=True))
    return list(given)
