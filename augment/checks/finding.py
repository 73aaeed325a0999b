"""A finding: one measured fact about what a modification puts into its scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType

from augment.scene.entities import Point


class FaultClass(StrEnum):
    """The paper's three classes of faults; a modification may have any of them, or none."""

    POSITION = "position"
    HEADING = "heading"
    LOGIC = "logic"


class Kind(StrEnum):
    """What was measured; those that begin with `asked` are held against the instruction."""

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
    ASKED_DISTANCE = "asked_distance"
    ASKED_ACROSS = "asked_across"
    ASKED_SPACING = "asked_spacing"
    ASKED_HEADING = "asked_heading"
    ASKED_SIDE = "asked_side"
    ASKED_CROSSING = "asked_crossing"
    ASKED_COUNT = "asked_count"
    ASKED_TYPE = "asked_type"
    ASKED_MOTION = "asked_motion"
    UNASKED = "unasked"


FAULT_OF = {
    Kind.EGO_OFFSET: FaultClass.POSITION,
    Kind.LANE_DISTANCE: FaultClass.POSITION,
    Kind.LANE: FaultClass.POSITION,
    Kind.OFF_ROAD: FaultClass.POSITION,
    Kind.OUTSIDE_MAP: FaultClass.POSITION,
    Kind.ASKED_DISTANCE: FaultClass.POSITION,
    Kind.ASKED_ACROSS: FaultClass.POSITION,
    Kind.ASKED_SPACING: FaultClass.POSITION,
    Kind.HEADING: FaultClass.HEADING,
    Kind.DEGREES: FaultClass.HEADING,
    Kind.WALK_HEADING: FaultClass.HEADING,
    Kind.ASKED_HEADING: FaultClass.HEADING,
    Kind.LANE_NAMED: FaultClass.LOGIC,
    Kind.WALK_CROSSING: FaultClass.LOGIC,
    Kind.OVERLAP: FaultClass.LOGIC,
    Kind.DUPLICATE: FaultClass.LOGIC,
    Kind.SIZE: FaultClass.LOGIC,
    Kind.SPEED: FaultClass.LOGIC,
    Kind.ASKED_SIDE: FaultClass.LOGIC,
    Kind.ASKED_CROSSING: FaultClass.LOGIC,
    Kind.ASKED_COUNT: FaultClass.LOGIC,
    Kind.ASKED_TYPE: FaultClass.LOGIC,
    Kind.ASKED_MOTION: FaultClass.LOGIC,
    Kind.UNASKED: FaultClass.LOGIC,
}
"""The class of fault that a finding of each kind speaks for, where it speaks for one."""


class Severity(StrEnum):
    """How much a finding speaks against the modification."""

    FACT = "fact"  # a measurement, whatever was asked for
    DOUBTFUL = "doubtful"  # a fault unless the instruction asks for it
    WRONG = "wrong"  # hardly any instruction can mean it


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """A measured fact, for a person or for a model.

    Attributes:
        agents: Ids of the agents it is about; the first is a changed one. None for what is
            missing altogether.
        ways: Ids of the lanes and connectors that it names.
        measured: Numbers by name, each name with its unit; None where there is nothing to
            measure. Left and counter-clockwise are positive.
        belongs_m: Where what was asked for would be, None where that is no one place.
        template: Our own words with fields for `agents`, `ways` and the numbers. A number's sign
            is told by the words: a field shows its size alone.
    """

    kind: Kind
    severity: Severity
    agents: tuple[str, ...]
    template: str
    ways: tuple[str, ...] = ()
    belongs_m: Point | None = None
    measured: Mapping[str, float | None] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "measured", MappingProxyType(dict(self.measured)))

    @property
    def is_fault(self) -> bool:
        """Whether it speaks against the modification: it is wrong or doubtful."""
        return self.severity is not Severity.FACT

    @property
    def fault(self) -> FaultClass:
        """The class of fault that it speaks for if it is more than a fact."""
        return FAULT_OF[self.kind]

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
