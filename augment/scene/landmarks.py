"""What of a scene a sentence names to say where: its road users and places of its map.

Sides, ahead and behind are those of the ego's direction of travel.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Self

from pydantic import model_validator

from augment.scene.schema import Count, Yes


class Side(StrEnum):
    """A side of the ego's direction of travel."""

    LEFT = "left"
    RIGHT = "right"

    @property
    def other(self) -> Side:
        """The opposite side."""
        return Side.RIGHT if self is Side.LEFT else Side.LEFT


class Relation(StrEnum):
    """On which end of its anchor a distance is measured."""

    AHEAD = "ahead"
    BEHIND = "behind"


class LaneChoice(StrEnum):
    """A lane by its place beside the ego's."""

    OWN = "own"
    LEFT = "left"
    RIGHT = "right"
    ONCOMING = "oncoming"


class Sight(StrEnum):
    """What a road user of the scene is called."""

    VEHICLE = "vehicle"
    PARKED = "parked vehicle"
    MOVING = "moving vehicle"
    BUS = "bus"
    BICYCLE = "bicycle"
    PEDESTRIAN = "pedestrian"


class MapPlace(StrEnum):
    """A place of the map on the ego's route; a merge is a junction too."""

    JUNCTION_START = "start of the junction"
    JUNCTION_END = "end of the junction"
    CROSSWALK = "crosswalk"


@dataclass(frozen=True, slots=True, kw_only=True)
class Pick:
    """A road user of the scene, by what a sentence says of it.

    Attributes:
        side: On which side of the ego's lane.
        lane: In which lane.
        relation: Whether it is counted ahead of the ego or behind it, the nearest first.
        ordinal: Which of those that fit; 1 is the nearest.
        every: All that fit.
    """

    kind: Sight
    side: Side | None = None
    lane: LaneChoice | None = None
    relation: Relation = Relation.AHEAD
    ordinal: Count = 1
    every: Yes = False

    @model_validator(mode="after")
    def _is_one_or_all(self) -> Self:
        if self.every and self.ordinal != 1:
            raise ValueError("every one and one of a number contradict each other")
        return self
