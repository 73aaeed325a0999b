"""The five scenario types of interPlan that the paper recreates, and the sets of the catalogue."""

from __future__ import annotations

from enum import StrEnum


class ScenarioType(StrEnum):
    """A type by interPlan's own name (`type` of a special scenario)."""

    CONSTRUCTION_ZONE = "approaching_construction_zone"
    ACCIDENT_SITE = "avoid_crashed_cars"
    JAYWALKER = "jaywalking_pedestrian"
    NUDGE = "nudge_around_parked_vehicle"
    OVERTAKE = "overtake_parked_vehicle"

    @property
    def label(self) -> str:
        """The words that the paper uses for it."""
        return _LABELS[self]


class CatalogueSet(StrEnum):
    """Which part of the authored catalogue a scenario belongs to."""

    PAPER = "paper"
    HARD = "hard"


_LABELS = {
    ScenarioType.CONSTRUCTION_ZONE: "Construction zone",
    ScenarioType.ACCIDENT_SITE: "Accident site",
    ScenarioType.JAYWALKER: "Jaywalker",
    ScenarioType.NUDGE: "Nudge around parked vehicle",
    ScenarioType.OVERTAKE: "Overtake parked vehicle",
}
