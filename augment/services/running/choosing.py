"""What people mean when they name contestants, scenarios and jobs to a command."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from uuid import UUID

from django.db.models import Q, QuerySet

from augment.errors import Conflict, UnknownName
from augment.models import Contestant, GenerationJob, Scenario
from augment.scene.catalogue import CatalogueSet
from augment.services.running.feasible import RUNNABLE

ALL = "all"


def resolve_contestants(given: Sequence[str]) -> list[str]:
    """The slugs; `all` stands for every contestant that a job can run and nobody retired."""
    if list(given) != [ALL]:
        return list(given)
    return list(
        Contestant.objects.filter(RUNNABLE, retired_at=None).values_list("slug", flat=True)
    )


def resolve_scenarios(given: Sequence[str]) -> list[str]:
    """The slugs, each once; words that are no slugs stand for several.

    `all`: every scenario; `catalogue`: the authored ones, `paper` or `hard`: those of one set,
    all three without paraphrases; `paraphrases`: those of the catalogue.
    """
    slugs: list[str] = []
    for word in given:
        several = _several(word)
        slugs += [word] if several is None else several.values_list("slug", flat=True)
    return list(dict.fromkeys(slugs))


def _several(word: str) -> QuerySet[Scenario] | None:
    authored = Scenario.objects.exclude(catalogue_set="")
    match word:
        case "all":
            return Scenario.objects.all()
        case "paraphrases":
            return authored.exclude(paraphrase_of=None)
        case "catalogue":
            return authored.filter(paraphrase_of=None)
        case CatalogueSet.PAPER | CatalogueSet.HARD:
            return authored.filter(paraphrase_of=None, catalogue_set=word)
    return None


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
