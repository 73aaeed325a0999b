"""The five scenario types of interPlan that the paper recreates, and the sets of the catalogue."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import Self


class ScenarioType(StrEnum):
    """A type by interPlan's own name (`type` of a special scenario).

    Attributes:
        label: The words that the paper uses for it.
    """

    label: str

    CONSTRUCTION_ZONE = "approaching_construction_zone", "Construction zone"
    ACCIDENT_SITE = "avoid_crashed_cars", "Accident site"
    JAYWALKER = "jaywalking_pedestrian", "Jaywalker"
    NUDGE = "nudge_around_parked_vehicle", "Nudge around parked vehicle"
    OVERTAKE = "overtake_parked_vehicle", "Overtake parked vehicle"

    def __new__(cls, value: str, label: str = "") -> Self:
        """A member with its label; a lookup has the value alone."""
        member = str.__new__(cls, value)
        member._value_ = value
        member.label = label
        return member


def in_type_order(names: Iterable[str]) -> list[str]:
    """Names of types, each once: interPlan's five in their order, then others by their slugs."""
    given = set(names)
    five = [one.value for one in ScenarioType if one.value in given]
    return [*five, *sorted(given.difference(five))]


class CatalogueSet(StrEnum):
    """Which part of the authored catalogue a scenario belongs to."""

    PAPER = "paper"
    HARD = "hard"
