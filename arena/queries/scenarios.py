"""The catalogue as the pages show it."""

from __future__ import annotations

import uuid
from dataclasses import dataclass

from augment.models import Augmentation, Contestant, Scenario
from augment.services.scenarios.types import type_choices


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeGroup:
    """All scenarios of one type."""

    type: str
    label: str
    scenarios: list[Scenario]


def by_type() -> list[TypeGroup]:
    """Every scenario, in the order of the types; types without any are left out."""
    rows = list(
        Scenario.objects.select_related("base_scene").defer(
            "reference", "base_scene__document", "base_scene__recording"
        )
    )
    groups = [
        TypeGroup(type=name, label=label, scenarios=[row for row in rows if row.type == name])
        for name, label in type_choices()
    ]
    return [group for group in groups if group.scenarios]


def reference_pictures() -> dict[int, uuid.UUID]:
    """By scenario, the youngest augmentation that draws its reference."""
    rows = Augmentation.objects.filter(
        contestant__kind=Contestant.Kind.REFERENCE, state=Augmentation.State.DONE
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
