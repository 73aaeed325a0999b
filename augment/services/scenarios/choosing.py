"""Scenarios and types by the names that people use."""

import fnmatch
from collections.abc import Sequence

from django.db.models import QuerySet

from augment.errors import UnknownName
from augment.models import Scenario
from augment.scene.entities import CatalogueSet
from augment.services.scenarios.scenes import type_choices

ALL, SET = "all", "set:"


def resolve_scenarios(words: Sequence[str]) -> list[str]:
    """Return the slugs, each once; words that are no slugs stand for several.

    `all`: every scenario; `catalogue`: the authored ones, `set:NAME` (or the name alone): those of
    one set, all without paraphrases; `paraphrases`: those of the
    catalogue; with *, ? or [...]: every slug of that pattern. Only a slug or a pattern names
    retired ones.

    Raises:
        UnknownName: There is no such scenario or set, or none of that pattern.
    """
    all_slugs = list(Scenario.objects.values_list("slug", flat=True))
    slugs: list[str] = []
    for word in words:
        several = _several(word)
        if several is None:
            matching = fnmatch.filter(all_slugs, word)
            if not matching:
                raise UnknownName("scenario", word, sorted(all_slugs))
            slugs += matching
        else:
            slugs += several.values_list("slug", flat=True)
    return list(dict.fromkeys(slugs))


def types_named(names: Sequence[str]) -> tuple[str, ...]:
    """Return scenario types by their names, or all there are by the word `all`.

    Raises:
        UnknownName: There is no such type.
    """
    types = [name for name, _ in type_choices()]
    if list(names) == ["all"]:
        return tuple(types)
    for name in names:
        if name not in types:
            raise UnknownName("scenario type", name, ["all", *types])
    return tuple(names)


def _several(word: str) -> QuerySet[Scenario] | None:
    """Return the scenarios that a word other than a slug stands for."""
    offered = Scenario.objects.filter(retired_at=None)
    authored = offered.exclude(catalogue_set="")
    name = word.removeprefix(SET)
    if name in list(CatalogueSet):
        return authored.filter(paraphrase_of=None, catalogue_set=name)
    if word.startswith(SET):
        raise UnknownName("set", name, [choice.value for choice in CatalogueSet])
    meanings = {
        ALL: offered,
        "paraphrases": authored.exclude(paraphrase_of=None),
        "catalogue": authored.filter(paraphrase_of=None),
    }
    return meanings.get(word)
