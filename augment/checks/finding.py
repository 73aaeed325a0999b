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


class FindingKind(StrEnum):
    """What was measured; those that begin with `asked` are held against the instruction."""

    EGO_OFFSET = "ego_offset"
    LANE_DISTANCE = "lane_distance"
    LANE = "lane"
    LANE_NAMED = "lane_named"
    HEADING = "heading"
    DEGREES = "degrees"
    WALK_HEADING = "walk_heading"
    WALK_CROSSING = "walk_crossing"
    WALK_BLOCKED = "walk_blocked"
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
    FindingKind.EGO_OFFSET: FaultClass.POSITION,
    FindingKind.LANE_DISTANCE: FaultClass.POSITION,
    FindingKind.LANE: FaultClass.POSITION,
    FindingKind.OFF_ROAD: FaultClass.POSITION,
    FindingKind.OUTSIDE_MAP: FaultClass.POSITION,
    FindingKind.ASKED_DISTANCE: FaultClass.POSITION,
    FindingKind.ASKED_ACROSS: FaultClass.POSITION,
    FindingKind.ASKED_SPACING: FaultClass.POSITION,
    FindingKind.HEADING: FaultClass.HEADING,
    FindingKind.DEGREES: FaultClass.HEADING,
    FindingKind.WALK_HEADING: FaultClass.HEADING,
    FindingKind.ASKED_HEADING: FaultClass.HEADING,
    FindingKind.LANE_NAMED: FaultClass.LOGIC,
    FindingKind.WALK_CROSSING: FaultClass.LOGIC,
    FindingKind.WALK_BLOCKED: FaultClass.LOGIC,
    FindingKind.OVERLAP: FaultClass.LOGIC,
    FindingKind.DUPLICATE: FaultClass.LOGIC,
    FindingKind.SIZE: FaultClass.LOGIC,
    FindingKind.SPEED: FaultClass.LOGIC,
    FindingKind.ASKED_SIDE: FaultClass.LOGIC,
    FindingKind.ASKED_CROSSING: FaultClass.LOGIC,
    FindingKind.ASKED_COUNT: FaultClass.LOGIC,
    FindingKind.ASKED_TYPE: FaultClass.LOGIC,
    FindingKind.ASKED_MOTION: FaultClass.LOGIC,
    FindingKind.UNASKED: FaultClass.LOGIC,
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
        lanes: Ids of the lanes and connectors that it names.
        measured: Numbers by name, each name with its unit; None where there is nothing to
            measure. Left and counter-clockwise are positive.
        belongs_m: Where what was asked for would be, None where that is no one place.
        template: Our own words with fields for `agents`, `lanes` and the numbers. A number's sign
            is told by the words: a field shows its size alone.
    """

    kind: FindingKind
    severity: Severity
    agents: tuple[str, ...]
    template: str
    lanes: tuple[str, ...] = ()
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
            names: What to call agents and lanes instead of their ids, such as the short names of
                a prompt; an id that is not in it stays.
        """
        known = {} if names is None else names
        sizes = {name: abs(value) for name, value in self.measured.items() if value is not None}
        return self.template.format(
            agents=[known.get(agent, agent) for agent in self.agents],
            lanes=[known.get(lane, lane) for lane in self.lanes],
            **sizes,
        )
