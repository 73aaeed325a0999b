"""Scenarios and types by the names that people use."""

import fnmatch
import re
from collections.abc import Sequence

from django.db.models import QuerySet

from augment.errors import InvalidDocument, UnknownName
from augment.models import Scenario
from augment.scene.entities import CatalogueSet, ScenarioType
from augment.scene.intent_parts import Aim
from augment.scene.planned_motion import MotionPreset

ALL, SET = "all", "set:"
LONGEST_TYPE = 40


def type_choices() -> list[tuple[str, str]]:
    """Every type with its label: the five in their order, then one's own by their slugs."""
    own = Scenario.objects.exclude(type_label="").order_by("type")
    labels = dict(own.values_list("type", "type_label"))
    return [*((kind.value, kind.label) for kind in ScenarioType), *labels.items()]


def type_label(name: str) -> str:
    """Return the label of a type; an unknown type is its own label."""
    found_type = find_type(name)
    return found_type.label if found_type else dict(type_choices()).get(name, name)


def find_type(name: str) -> ScenarioType | None:
    """The one of the five, None for a type of one's own."""
    return ScenarioType(name) if name in list(ScenarioType) else None


def label_for(name: str) -> str:
    """Return the label that a scenario of this type is stored with: empty for one of the five.

    Raises:
        InvalidDocument: It is neither one of the five nor a slug.
    """
    if find_type(name) is not None:
        return ""
    for kind in (MotionPreset, Aim):
        if name in list(kind):
            return kind(name).label
    if len(name) > LONGEST_TYPE or not re.fullmatch(r"[a-z0-9]+([_-][a-z0-9]+)*", name):
        types = ", ".join(kind.value for kind in ScenarioType)
        rule = f"one of {types}, or up to {LONGEST_TYPE} lower-case letters, digits, _ or -"
        raise InvalidDocument("scenario", [("type", f"{name!r} must be {rule}")])
    before = Scenario.objects.filter(type=name).values_list("type_label", flat=True)
    return before.first() or re.sub(r"[_-]", " ", name).capitalize()


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
