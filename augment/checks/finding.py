"""A finding: one measured fact about what a modification puts into its scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType


class Kind(StrEnum):
    """What was measured."""

    EGO_OFFSET = "ego_offset"
    LANE_DISTANCE = "lane_distance"
    LANE = "lane"
    LANE_NAMED = "lane_named"
    HEADING = "heading"
    DEGREES = "degrees"
    WALK_HEADING = "walk_heading"
    WALK_CROSSING = "walk_crossing"
    OFF_ROAD = "off_road"
    OUTSIDE_MAP = "outside_map"
    OVERLAP = "overlap"
    DUPLICATE = "duplicate"
    SIZE = "size"
    SPEED = "speed"


class Severity(StrEnum):
    """How much a finding speaks against the modification."""

    FACT = "fact"  # a measurement, whatever was asked for
    DOUBTFUL = "doubtful"  # a fault unless the instruction asks for it
    WRONG = "wrong"  # hardly any instruction can mean it


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """A measured fact, for a person or for a model.

    Attributes:
        agents: Ids of the agents it is about; the first is a changed one.
        ways: Ids of the lanes and connectors that it names.
        measured: Numbers by name, each name with its unit; None where there is nothing to
            measure. Left and counter-clockwise are positive.
        template: Our own words with fields for `agents`, `ways` and the numbers. A number's sign
            is told by the words: a field shows its size alone.
    """

    kind: Kind
    severity: Severity
    agents: tuple[str, ...]
    template: str
    ways: tuple[str, ...] = ()
    measured: Mapping[str, float | None] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "measured", MappingProxyType(dict(self.measured)))

    def sentence(self, names: Mapping[str, str] | None = None) -> str:
        """The finding in words.

        Args:
            names: What to call agents and ways instead of their ids, such as the short names of
                a prompt; an id that is not in it stays.
        """
        known = {} if names is None else names
        sizes = {name: abs(value) for name, value in self.measured.items() if value is not None}
        return self.template.format(
            agents=[known.get(one, one) for one in self.agents],
            ways=[known.get(one, one) for one in self.ways],
            **sizes,
        )
