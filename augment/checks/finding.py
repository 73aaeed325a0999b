"""A finding: one measured fact about what a modification puts into its scene."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from augment.scene.entities import TrafficAgent


class FaultClass(StrEnum):
    """The paper's three classes of faults; a modification may have any of them, or none."""

    POSITION = "position"
    HEADING = "heading"
    LOGIC = "logic"


class FindingKind(StrEnum):
    """Measured quantity; those that begin with `asked` are held against the instruction."""

    LANE = "lane"
    LANE_NAMED = "lane_named"
    HEADING = "heading"
    WALK_HEADING = "walk_heading"
    WALK_BLOCKED = "walk_blocked"
    OFF_ROAD = "off_road"
    OVERLAP = "overlap"
    SIZE = "size"
    SPEED = "speed"
    MOTION_TRIGGER = "motion_trigger"
    MOTION_START = "motion_start"
    MOTION_LIMITS = "motion_limits"
    MOTION_OFF_ROAD = "motion_off_road"
    MOTION_BLOCKED = "motion_blocked"
    ASKED_DISTANCE = "asked_distance"
    ASKED_ACROSS = "asked_across"
    ASKED_SPACING = "asked_spacing"
    ASKED_HEADING = "asked_heading"
    ASKED_SIDE = "asked_side"
    ASKED_CROSSING = "asked_crossing"
    ASKED_COUNT = "asked_count"
    ASKED_TYPE = "asked_type"
    ASKED_MOTION = "asked_motion"
    ASKED_START = "asked_start"
    UNASKED = "unasked"
    PURPOSE = "purpose"


_FAULTS = {
    FindingKind.LANE: FaultClass.POSITION,
    FindingKind.OFF_ROAD: FaultClass.POSITION,
    FindingKind.MOTION_OFF_ROAD: FaultClass.POSITION,
    FindingKind.ASKED_DISTANCE: FaultClass.POSITION,
    FindingKind.ASKED_ACROSS: FaultClass.POSITION,
    FindingKind.ASKED_SPACING: FaultClass.POSITION,
    FindingKind.HEADING: FaultClass.HEADING,
    FindingKind.WALK_HEADING: FaultClass.HEADING,
    FindingKind.MOTION_START: FaultClass.HEADING,
    FindingKind.ASKED_HEADING: FaultClass.HEADING,
}
"""All others speak for a fault of logic."""


class Severity(StrEnum):
    """Severity of a finding for the modification."""

    FACT = "fact"  # a measurement, whatever was asked for
    DOUBTFUL = "doubtful"  # a fault unless the instruction asks for it
    WRONG = "wrong"  # hardly any instruction can mean it


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """A measured fact, for a person or for a model.

    Attributes:
        agents: Ids of the agents it is about; the first is a changed one. None for what is
            missing altogether.
        template: Our own words with fields for `agents`, `lanes` and the numbers.
        lanes: Ids of lanes and connectors that the words name.
        measured: Numbers by name, each name with its unit. Left, ahead and counter-clockwise are
            positive, in the words as well.
    """

    kind: FindingKind
    severity: Severity
    agents: tuple[str, ...]
    template: str
    lanes: tuple[str, ...] = ()
    measured: Mapping[str, float] = field(default_factory=dict, hash=False)

    @property
    def is_fault(self) -> bool:
        """True if it is evidence against the modification: wrong or doubtful."""
        return self.severity is not Severity.FACT

    @property
    def fault(self) -> FaultClass:
        """The class of fault that it speaks for if it is more than a fact."""
        return _FAULTS.get(self.kind, FaultClass.LOGIC)

    def sentence(self, names: Mapping[str, str] | None = None) -> str:
        """Return the finding in words.

        Args:
            names: What to call agents and lanes instead of their ids, such as the short names of
                a prompt; an id that is not in it stays.
        """
        shown_names = names or {}
        return self.template.format(
            agents=[shown_names.get(agent, agent) for agent in self.agents],
            lanes=[shown_names.get(lane, lane) for lane in self.lanes],
            **self.measured,
        )


def find(
    kind: FindingKind,
    severity: Severity | bool,
    agents: Iterable[TrafficAgent | str],
    template: str,
    *,
    lanes: tuple[str, ...] = (),
    **measured: float,
) -> Finding:
    """Return the finding of a kind about some agents.

    Args:
        kind: What was measured.
        severity: How bad it is; of what was asked for in so many words, whether it is there.
        agents: Whom it is about, or their ids.
        template: The words, as `Finding` has them.
        lanes: Ids of lanes that the words name.
        **measured: What was measured.
    """
    if isinstance(severity, bool):
        severity = Severity.FACT if severity else Severity.WRONG
    return Finding(
        kind=kind,
        severity=severity,
        agents=tuple(agent if isinstance(agent, str) else agent.id for agent in agents),
        template=template,
        lanes=lanes,
        measured=measured,
    )
