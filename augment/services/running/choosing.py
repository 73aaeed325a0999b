"""What people mean when they name contestants, scenarios and jobs to a command."""

from __future__ import annotations

import fnmatch
from collections.abc import Sequence
from contextlib import suppress
from uuid import UUID

from django.db.models import Q, QuerySet

from augment.baselines.registry import PLACERS
from augment.errors import AugmentError, Conflict, KeyMissing, KeyNotAllowed, UnknownName
from augment.models import Contestant, GenerationJob, Scenario
from augment.scene.entities import CatalogueSet
from augment.services.endpoints.known_endpoints import key_of, may_hold_key
from augment.services.endpoints.treatments import (
    Respondent,
    options_of,
    other_prompts,
    respondents_of,
    sight_of,
    viewer_of,
)
from augment.variants.options import ToolProtocol
from augment.variants.respondents import ModelRole

Kind = Contestant.Kind

_KINDS = (Kind.REFERENCE, Kind.RULE, Kind.LLM, Kind.SIMULATED)

RUNNABLE = Q(kind__in=_KINDS, error_rates__isnull=True) | Q(kind=Kind.BASELINE, slug__in=PLACERS)
"""Whom a job can run. What humans and outside baselines made is imported; the simulated errors of
earlier versions are kept, but run no more."""


def is_runnable(contestant: Contestant) -> bool:
    """Whether it is one of RUNNABLE."""
    is_ours = contestant.kind == Kind.BASELINE and contestant.slug in PLACERS
    return (contestant.kind in _KINDS and contestant.error_rates is None) or is_ours


def find_obstacle(contestant: Contestant) -> str:
    """Why no job can run a contestant, whatever the scenarios; empty where one can."""
    if not is_runnable(contestant):
        return "made by people or by an outside program, and imported"
    try:
        respondents_of(contestant)
    except AugmentError as error:
        return str(error)
    forbidden = _forbidden_keys(contestant)
    if forbidden:
        return (
            f"the variable {', '.join(forbidden)} may not hold a key; its name has to end in "
            "_API_KEY, or ARENA_KEY_VARIABLES has to list it"
        )
    unaskable = _unaskable(contestant)
    if unaskable is not None:
        return unaskable
    viewer = viewer_of(contestant)
    if viewer is not None and sight_of(viewer) is False:
        return "its viewer sees text alone; visual QA needs vision"
    if viewer is not None and sight_of(viewer) is None:
        return (
            f"nobody knows whether its viewer {viewer} sees pictures, which visual QA "
            "needs: probe it on its page, or say there what you know"
        )
    return ""


def keys_missing(contestant: Contestant) -> list[str]:
    """Environment variables with keys that a contestant needs and this process does not have.

    Workers elsewhere may have them: this is a warning, no obstacle.
    """
    missing = set()
    for respondent in respondents_of(contestant).values():
        try:
            key_of(respondent.endpoint)
        except KeyMissing as error:
            missing.add(error.variable)
        except KeyNotAllowed:
            continue  # an obstacle, see there
    return sorted(missing)


def refuse_impossible(who: Sequence[Contestant], where: Sequence[Scenario]) -> None:
    """Do nothing for a job that can run to its end.

    Raises:
        Conflict: Nothing is chosen, or a contestant can't run, or not on these scenarios.
    """
    if not who:
        raise Conflict("Choose at least one contestant.")
    if not where:
        raise Conflict("Choose at least one scenario.")
    strangers = [row.slug for row in who if not is_runnable(row)]
    if strangers:
        raise Conflict(
            f"A job can't run {', '.join(strangers)}: what humans or outside programs made "
            "is imported."
        )
    _refuse_forbidden_keys(who)
    for row in who:
        unaskable = _unaskable(row)
        if unaskable is not None:
            raise Conflict(unaskable)
    _refuse_without_sight(who)
    references = [row.slug for row in who if row.kind == Kind.REFERENCE]
    without = [row.slug for row in where if row.reference is None]
    if references and without:
        raise Conflict(
            f"{references[0]} can't run on scenarios without a reference modification: "
            f"{', '.join(without)}."
        )


# --- Private -----------------------------------------------------------------------------------


def _unaskable(contestant: Contestant) -> str | None:
    """Why nobody can ask with a contestant's options; None where it can be tried."""
    if contestant.endpoint is None:
        return None
    options = options_of(contestant)
    if options.protocol is ToolProtocol.NATIVE:
        modifier = respondents_of(contestant)[ModelRole.MODIFIER]
        known = modifier.known
        if contestant.frozen_options is None and known is not None and known.native_tools is False:
            return (
                f"{contestant.slug} is to call its function natively, and {modifier} has no "
                "native calls. Add a contestant with the protocol prompt, or probe the model "
                "anew."
            )
    return other_prompts(contestant.slug, options)


def _forbidden_keys(contestant: Contestant) -> tuple[str, ...]:
    """Variables that a contestant's endpoints name and that no endpoint may be sent."""
    named = {
        respondent.endpoint.key_variable for respondent in respondents_of(contestant).values()
    } - {""}
    return tuple(sorted(name for name in named if not may_hold_key(name)))


def _refuse_forbidden_keys(who: Sequence[Contestant]) -> None:
    for row in who:
        forbidden = _forbidden_keys(row)
        if forbidden:
            raise Conflict(
                f"The endpoint of {row.slug} names {', '.join(forbidden)}, which may not "
                "hold a key: a variable is needed whose name ends in _API_KEY or that "
                "ARENA_KEY_VARIABLES lists."
            )


def _refuse_without_sight(who: Sequence[Contestant]) -> None:
    """Two calls of every augmentation would be paid for before its viewer fails."""
    viewers = {row.slug: viewer_of(row) for row in who}
    lacking: dict[bool | None, list[tuple[str, Respondent]]] = {True: [], False: [], None: []}
    for slug, respondent in viewers.items():
        if respondent is not None:
            lacking[sight_of(respondent)].append((slug, respondent))
    if lacking[False]:
        names = ", ".join(f"{slug} ({respondent})" for slug, respondent in lacking[False])
        raise Conflict(
            f"Visual QA needs a viewer that sees, and these see text alone: {names}. Give "
            "the contestant another viewer or another variant."
        )
    if lacking[None]:
        names = ", ".join(f"{slug} ({respondent})" for slug, respondent in lacking[None])
        raise Conflict(
            "Visual QA needs a viewer that sees, and of these nobody knows whether they do: "
            f"{names}. Probe the model on the page of its endpoint, or say there what you "
            "know."
        )


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
