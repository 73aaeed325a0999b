"""A finding: one measured fact about what a modification puts into its scene."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import Self

from augment.scene.entities import Point, TrafficAgent


class FaultClass(StrEnum):
    """The paper's three classes of faults; a modification may have any of them, or none."""

    POSITION = "position"
    HEADING = "heading"
    LOGIC = "logic"


class FindingKind(StrEnum):
    """What was measured; those that begin with `asked` are held against the instruction.

    Attributes:
        fault: The class of fault that such a finding speaks for if it is more than a fact.
    """

    fault: FaultClass

    EGO_OFFSET = "ego_offset", FaultClass.POSITION
    LANE_DISTANCE = "lane_distance", FaultClass.POSITION
    LANE = "lane", FaultClass.POSITION
    LANE_NAMED = "lane_named", FaultClass.LOGIC
    HEADING = "heading", FaultClass.HEADING
    DEGREES = "degrees", FaultClass.HEADING
    WALK_HEADING = "walk_heading", FaultClass.HEADING
    WALK_CROSSING = "walk_crossing", FaultClass.LOGIC
    WALK_BLOCKED = "walk_blocked", FaultClass.LOGIC
    OFF_ROAD = "off_road", FaultClass.POSITION
    OUTSIDE_MAP = "outside_map", FaultClass.POSITION
    OVERLAP = "overlap", FaultClass.LOGIC
    DUPLICATE = "duplicate", FaultClass.LOGIC
    SIZE = "size", FaultClass.LOGIC
    SPEED = "speed", FaultClass.LOGIC
    ASKED_DISTANCE = "asked_distance", FaultClass.POSITION
    ASKED_ACROSS = "asked_across", FaultClass.POSITION
    ASKED_SPACING = "asked_spacing", FaultClass.POSITION
    ASKED_HEADING = "asked_heading", FaultClass.HEADING
    ASKED_SIDE = "asked_side", FaultClass.LOGIC
    ASKED_CROSSING = "asked_crossing", FaultClass.LOGIC
    ASKED_COUNT = "asked_count", FaultClass.LOGIC
    ASKED_TYPE = "asked_type", FaultClass.LOGIC
    ASKED_MOTION = "asked_motion", FaultClass.LOGIC
    UNASKED = "unasked", FaultClass.LOGIC

    def __new__(cls, value: str, fault: FaultClass = FaultClass.LOGIC) -> Self:
        """A member with its class of fault; a lookup has the value alone."""
        member = str.__new__(cls, value)
        member._value_ = value
        member.fault = fault
        return member


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
        return self.kind.fault

    def sentence(self, names: Mapping[str, str] | None = None) -> str:
        """Return the finding in words.

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


def find(
    kind: FindingKind,
    severity: Severity | bool,
    agents: Iterable[TrafficAgent | str],
    template: str,
    *,
    measured: Mapping[str, float | None] | None = None,
    lanes: tuple[str, ...] = (),
    belongs_m: Point | None = None,
    **numbers: float | None,
) -> Finding:
    """Return the finding of a kind about some agents.

    Args:
        kind: What was measured.
        severity: How bad it is; of what was asked for in so many words, whether it is there.
        agents: Whom it is about, or their ids.
        template: The words.
        measured: What was measured, by name.
        lanes: Ids of lanes that the words name.
        belongs_m: Where what was asked for would be.
        **numbers: More of what was measured.
    """
    if isinstance(severity, bool):
        severity = Severity.FACT if severity else Severity.WRONG
    return Finding(
        kind=kind,
        severity=severity,
        agents=tuple(one if isinstance(one, str) else one.id for one in agents),
        template=template,
        lanes=lanes,
        belongs_m=belongs_m,
        measured={**(measured or {}), **numbers},
    )


def side_of(left: float) -> str:
    """Return the side of a number whose left is positive."""
    return "left" if left >= 0.0 else "right"


def ahead_of(ahead: float) -> str:
    """Return on which end of the ego a number is whose ahead is positive."""
    return "ahead of" if ahead >= 0.0 else "behind"
