"""The catalogue as the pages show it."""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from dataclasses import dataclass

from django.db.models import Count

from augment.models import Augmentation, Contestant, Scenario
from augment.services.scenarios.scenes import type_choices


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeGroup:
    """All scenarios of one type."""

    type: str
    label: str
    scenarios: list[Scenario]


OWN = "own"
"""The scenarios that are in no set of the catalogue."""


def by_type(chosen: str = "", *, with_paraphrases: bool = True) -> list[TypeGroup]:
    """The scenarios that forms offer, in the order of the types; types without any are left out.

    Args:
        chosen: A set of the catalogue, `own` for those in none; empty for all.
        with_paraphrases: Whether those count that say another one in other words.
    """
    offered = Scenario.objects.filter(retired_at=None).select_related("base_scene")
    found = offered.defer("reference", "base_scene__document", "base_scene__recording")
    if chosen:
        found = found.filter(catalogue_set="" if chosen == OWN else chosen)
    if not with_paraphrases:
        found = found.filter(paraphrase_of=None)
    rows = list(found)
    groups = [
        TypeGroup(type=name, label=label, scenarios=[row for row in rows if row.type == name])
        for name, label in type_choices()
    ]
    return [group for group in groups if group.scenarios]


@dataclass(frozen=True, slots=True, kw_only=True)
class SetChoice:
    """A part of the scenarios that a page can show alone."""

    name: str
    number: int
    is_chosen: bool


def set_choices(chosen: str) -> list[SetChoice]:
    """All scenarios first (named by the empty text), then the sets that there are."""
    counted = Scenario.objects.filter(paraphrase_of=None, retired_at=None).values_list(
        "catalogue_set"
    )
    numbers = dict(counted.annotate(number=Count("pk")).order_by())
    found = [(name, numbers.get(name, 0)) for name in Scenario.SETS]
    found.append((OWN, numbers.get("", 0)))
    present = [("", sum(numbers.values())), *(one for one in found if one[1])]
    return [
        SetChoice(name=name, number=number, is_chosen=name == chosen) for name, number in present
    ]


def set_asked(name: str | None) -> str:
    """What an address asks for; all where it names no set."""
    return name if name in {*Scenario.SETS, OWN} and name is not None else ""


def reference_pictures(scenarios: Sequence[Scenario]) -> dict[int, uuid.UUID]:
    """By scenario, the youngest augmentation that draws its reference."""
    rows = Augmentation.objects.filter(
        scenario__in=scenarios,
        contestant__kind=Contestant.Kind.REFERENCE,
        state=Augmentation.State.DONE,
    )
    return dict(rows.order_by("created_at", "pk").values_list("scenario_id", "code"))


def augmentations_of(scenario: Scenario) -> list[Augmentation]:
    """Every augmentation of a scenario with a picture, the youngest job first."""
    rows = scenario.augmentations.filter(state__in=Augmentation.SHOWABLE).exclude(image="")
    return list(
        rows.select_related("contestant", "job")
        .defer("modification")
        .order_by("-job__created_at", "contestant__name")
    )
