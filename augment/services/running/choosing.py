"""What people mean when they name contestants, scenarios and jobs to a command."""

from __future__ import annotations

import fnmatch
from collections.abc import Sequence
from contextlib import suppress
from uuid import UUID

from django.db.models import Q, QuerySet

from augment.errors import Conflict, UnknownName
from augment.models import Contestant, GenerationJob, Scenario
from augment.scene.entities import CatalogueSet
from augment.services.running.choosing import RUNNABLE

ALL, SET = "all", "set:"


def resolve_contestants(given: Sequence[str]) -> list[str]:
    """The slugs; `all` stands for every contestant that a job can run and nobody retired.

    Raises:
        UnknownName: There is no contestant of that slug.
    """
    if list(given) == [ALL]:
        rows = Contestant.objects.filter(RUNNABLE, retired_at=None)
        return list(rows.values_list("slug", flat=True))
    known = set(Contestant.objects.values_list("slug", flat=True))
    for slug in given:
        if slug not in known:
            raise UnknownName("contestant", slug, sorted(known))
    return list(given)


def resolve_scenarios(given: Sequence[str]) -> list[str]:
    """The slugs, each once; words that are no slugs stand for several.

    `all`: every scenario; `catalogue`: the authored ones, `set:paper` or `set:hard` (or the name
    alone): those of one set, all three without paraphrases; `paraphrases`: those of the
    catalogue; with *, ? or [...]: every slug of that pattern. Only a slug or a pattern names
    retired ones.

    Raises:
        UnknownName: There is no such scenario or set, or none of that pattern.
    """
    known = list(Scenario.objects.values_list("slug", flat=True))
    slugs: list[str] = []
    for word in given:
        slugs += _matching(word, known)
    return list(dict.fromkeys(slugs))


def _matching(word: str, known: Sequence[str]) -> list[str]:
    several = _several(word)
    if several is not None:
        return list(several.values_list("slug", flat=True))
    found = fnmatch.filter(known, word)
    if not found:
        raise UnknownName("scenario", word, sorted(known))
    return found


def _several(word: str) -> QuerySet[Scenario] | None:
    offered = Scenario.objects.filter(retired_at=None)
    authored = offered.exclude(catalogue_set="")
    name = word.removeprefix(SET)
    if name in list(CatalogueSet):
        return authored.filter(paraphrase_of=None, catalogue_set=name)
    if word.startswith(SET):
        raise UnknownName("set", name, [one.value for one in CatalogueSet])
    match word:
        case "all":
            return offered
        case "paraphrases":
            return authored.exclude(paraphrase_of=None)
        case "catalogue":
            return authored.filter(paraphrase_of=None)
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
