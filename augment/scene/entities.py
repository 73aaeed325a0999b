"""The entities of a scene: every attribute of the paper's table "Input vectors".

Frame: ego frame. Angles counter-clockwise from +x. Values are frozen; change by `replace`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Annotated

from pydantic import Field

from augment.errors import InvalidModification
from augment.geometry.frames import Box, Pose
from augment.scene import schema
from augment.scene.planned_motion import PlannedMotion

STOPPED_BELOW_MPS = 0.5
MOST_AGENTS = 5_000
MOST_WAYS = 50_000

Point = tuple[float, float]


class AgentType(StrEnum):
    """Type of a traffic agent: nuPlan's classes, and the bus that interPlan adds to them."""

    EGO_VEHICLE = "EGO_VEHICLE"
    VEHICLE = "VEHICLE"
    BUS = "BUS"
    BICYCLE = "BICYCLE"
    PEDESTRIAN = "PEDESTRIAN"
    TRAFFIC_CONE = "TRAFFIC_CONE"
    BARRIER = "BARRIER"
    CONSTRUCTION_SIGN = "CONSTRUCTION_SIGN"
    GENERIC_OBJECT = "GENERIC_OBJECT"


STEERED = (AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE)
"""Who drives or rides, the ego apart; all of them are longer than wide."""
UPRIGHT = (AgentType.TRAFFIC_CONE, AgentType.CONSTRUCTION_SIGN)
"""What shows no front, whatever its heading."""


class TrafficLight(StrEnum):
    """The state of a connector's light; `none` means that there is no light."""

    GREEN = "green"
    YELLOW = "yellow"
    RED = "red"
    UNKNOWN = "unknown"
    NONE = "none"


class TurnType(StrEnum):
    """Turn of a connector through its intersection."""

    STRAIGHT = "straight"
    LEFT = "left"
    RIGHT = "right"
    U_TURN = "u_turn"


class TrafficDensity(StrEnum):
    """Density of traffic spawned in place of the recorded one; interPlan's three, and none."""

    NONE = "none"
    LOW = "low"
    MEDIUM = "medium"
    HIGH = "high"


class AreaKind(StrEnum):
    """Kind of an area; the union of lanes, connectors and `drivable` areas can be driven on."""

    DRIVABLE = "drivable"
    WALKWAY = "walkway"
    CROSSWALK = "crosswalk"
    INTERSECTION = "intersection"
    CARPARK = "carpark"


DRIVEN_ON = (AreaKind.DRIVABLE, AreaKind.CARPARK, AreaKind.INTERSECTION)
"""Areas that are part of the road."""


class TrafficSide(StrEnum):
    """On which side of the road people drive; it comes from the map, never from a guess."""

    LEFT = "left"
    RIGHT = "right"


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficAgent:
    """A road user or an object: a box with a heading, a speed and the lane that it is on.

    Attributes:
        id: Short and stable within its scene ("Agent1" is the ego).
        x_m, y_m: The centre of the box.
        length_m: Along the heading; width_m: across it.
        speed_mps: Along the heading, 0 for what stands.
        lane_id: The lane or connector under the centre, None off every lane.
        walk_to_m: Where a pedestrian's walk ends (interPlan's end point), None without a walk.
        motion: What it is made to do after t0; None to go on by itself. Never beside a walk.
    """

    id: schema.Id
    type: AgentType
    x_m: schema.Metres
    y_m: schema.Metres
    heading_rad: schema.Heading
    width_m: schema.Size
    length_m: schema.Size
    speed_mps: schema.Speed = 0.0
    lane_id: schema.Id | None = None
    walk_to_m: schema.PointPair | None = None
    motion: PlannedMotion | None = None

    @classmethod
    def at(
        cls,
        kind: AgentType,
        pose: Pose,
        size_m: tuple[float, float] | None = None,
        *,
        id: str = "",
        speed_mps: float = 0.0,
        lane_id: str | None = None,
        walk_to_m: schema.PointPair | None = None,
    ) -> TrafficAgent:
        """Return an agent at a pose, of its kind's usual size or of another length and width."""
        length_m, width_m = size_m or LENGTH_WIDTH_M[kind]
        return cls(
            id=id,
            type=kind,
            x_m=pose.x_m,
            y_m=pose.y_m,
            heading_rad=pose.heading_rad,
            length_m=length_m,
            width_m=width_m,
            speed_mps=speed_mps,
            lane_id=lane_id,
            walk_to_m=walk_to_m,
        )

    @property
    def pose(self) -> Pose:
        """Centre and heading."""
        return Pose(x_m=self.x_m, y_m=self.y_m, heading_rad=self.heading_rad)

    @property
    def box(self) -> Box:
        """The ground that it takes up."""
        return Box(pose=self.pose, length_m=self.length_m, width_m=self.width_m)

    @property
    def is_stopped(self) -> bool:
        """True if it stands."""
        return abs(self.speed_mps) < STOPPED_BELOW_MPS

    @property
    def size_m(self) -> tuple[float, float]:
        """Length and width."""
        return self.length_m, self.width_m


Agents = Annotated[tuple[TrafficAgent, ...], Field(fail_fast=True, max_length=MOST_AGENTS)]
_Centerline = Annotated[schema.Line, Field(alias="centerline_m")]
_Left = Annotated[schema.Line | None, Field(alias="left_boundary_m")]
_Right = Annotated[schema.Line | None, Field(alias="right_boundary_m")]
_Ids = Annotated[
    tuple[schema.Id, ...],
    Field(fail_fast=True, max_length=MOST_WAYS, exclude_if=lambda names: not names),
]
_MOST = Field(fail_fast=True, max_length=MOST_WAYS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lane:
    """A lane between intersections.

    Attributes:
        centerline: In the direction of travel.
        width_m: Mean distance between the boundaries.
        speed_limit_mps: None where the map does not say.
        left_boundary, right_boundary: In the direction of travel, None where the map has none.
        left_neighbor, right_neighbor: Ids of adjacent lanes of the same direction, if any.
        successors: Ids of the lanes that follow at its end with no intersection between.
    """

    id: schema.Id
    centerline: _Centerline
    width_m: schema.Size
    speed_limit_mps: schema.Limit | None = None
    left_boundary: _Left = None
    right_boundary: _Right = None
    left_neighbor: schema.Id | None = None
    right_neighbor: schema.Id | None = None
    successors: _Ids = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class LaneConnector:
    """One way through an intersection, from one lane to one other.

    Attributes:
        from_lane, to_lane: Ids of lanes or connectors; None where the map ends.
    """

    id: schema.Id
    from_lane: schema.Id | None = None
    to_lane: schema.Id | None = None
    centerline: _Centerline
    width_m: schema.Size
    traffic_light: TrafficLight = TrafficLight.NONE
    turn_type: TurnType = TurnType.STRAIGHT
    speed_limit_mps: schema.Limit | None = None
    left_boundary: _Left = None
    right_boundary: _Right = None


AnyLane = Lane | LaneConnector
"""Both are read by the verbs of `Polyline`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Area:
    """A polygon given by its boundary points (P >= 3), not closed."""

    id: schema.Id
    kind: AreaKind
    boundary_m: schema.Ring


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """Pose of the ego frame in the source's own world frame."""

    frame: Annotated[schema.Text, Field(min_length=1, max_length=200)]
    x_m: schema.WorldMetres
    y_m: schema.WorldMetres
    heading_rad: schema.Heading

    @classmethod
    def at(cls, pose: Pose, *, frame: str) -> Origin:
        """The origin at a pose of the source's frame."""
        return cls(frame=frame, x_m=pose.x_m, y_m=pose.y_m, heading_rad=pose.heading_rad)

    @property
    def pose(self) -> Pose:
        """The ego frame seen from the source's."""
        return Pose(x_m=self.x_m, y_m=self.y_m, heading_rad=self.heading_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class InterplanRules:
    """interPlan's rules for a scenario of its file: it lasts 30 s, and boxes are interPlan's.

    Attributes:
        boxes_m: Length and width of the vehicles put there, one after the other; those after the
            last get the ego's. None where nobody knows them.
    """

    boxes_m: tuple[tuple[schema.Size, schema.Size], ...] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneOptions:
    """Settings of a scenario besides its change.

    Attributes:
        density: Of the spawned traffic, which is among the scene's agents.
        goal: Where the ego's way turns: left, right or straight; None where nobody says.
        goal_m: A place in the ego frame that the way leads to, None where the turn alone is said.
        interplan: None for a scene that is not driven by interPlan's rules.
    """

    density: TrafficDensity = TrafficDensity.NONE
    goal: TurnType | None = None
    goal_m: schema.PointPair | None = None
    interplan: InterplanRules | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """Ego, traffic, lanes, connectors and areas at one moment, t0.

    Attributes:
        name: The slug of the scene.
        ego: Always at (0, 0), heading 0, type EGO_VEHICLE, id "Agent1".
        agents: All others, nearest to the ego first.
        provenance: Where it comes from and under which licence, in a sentence.
        options: Set by a scenario; a stored scene has none unless its file names them.
    """

    __pydantic_config__ = schema.CLOSED

    name: Annotated[schema.Text, Field(min_length=1, max_length=200)]
    provenance: Annotated[schema.Text, Field(min_length=1)]
    traffic_side: TrafficSide
    origin: Origin
    ego: TrafficAgent
    agents: Agents = ()
    lanes: Annotated[tuple[Lane, ...], _MOST] = ()
    connectors: Annotated[tuple[LaneConnector, ...], _MOST] = ()
    areas: Annotated[tuple[Area, ...], _MOST] = ()
    options: Annotated[SceneOptions, Field(exclude_if=lambda value: value == SceneOptions())] = (
        SceneOptions()
    )

    @property
    def everyone(self) -> tuple[TrafficAgent, ...]:
        """The ego first, then the others."""
        return (self.ego, *self.agents)

    @property
    def ways(self) -> tuple[AnyLane, ...]:
        """Lanes, then connectors."""
        return (*self.lanes, *self.connectors)


EGO_LENGTH_M = 5.176
EGO_WIDTH_M = 2.297

LENGTH_WIDTH_M: dict[AgentType, tuple[float, float]] = {
    AgentType.EGO_VEHICLE: (EGO_LENGTH_M, EGO_WIDTH_M),
    AgentType.VEHICLE: (4.8, 2.0),
    AgentType.BUS: (7.456, 2.079),
    AgentType.BICYCLE: (1.8, 0.6),
    AgentType.PEDESTRIAN: (0.900, 0.791),
    AgentType.TRAFFIC_CONE: (0.5, 0.5),
    AgentType.BARRIER: (2.0, 0.6),
    AgentType.CONSTRUCTION_SIGN: (0.8, 0.8),
    AgentType.GENERIC_OBJECT: (1.0, 1.0),
}
"""Length, width for each type; a plain vehicle is a mid-size car, not the ego's large one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Modification:
    """A change to a scene; empty means that nothing changes.

    Attributes:
        added: New agents, their ids not in the scene.
        moved: Agents of the scene in their new state, by id.
        removed: Ids of the scene's agents that go.
    """

    __pydantic_config__ = schema.CLOSED

    added: Annotated[Agents, Field(alias="add")] = ()
    moved: Annotated[Agents, Field(alias="move")] = ()
    removed: Annotated[
        tuple[schema.Id, ...], Field(alias="remove", fail_fast=True, max_length=MOST_AGENTS)
    ] = ()

    @property
    def is_empty(self) -> bool:
        """True if the scene stays as it is."""
        return not (self.added or self.moved or self.removed)

    @property
    def changed(self) -> tuple[TrafficAgent, ...]:
        """Every agent that a picture marks as changed: the added, then the moved."""
        return self.added + self.moved

    @property
    def replaced(self) -> frozenset[str]:
        """Ids of the scene's agents whose recording counts no longer."""
        return frozenset([*(agent.id for agent in self.moved), *self.removed])

    @property
    def has_motion(self) -> bool:
        """True if an agent has a motion after t0."""
        return any(agent.motion is not None for agent in self.changed)

    def with_changed(self, agents: Iterable[TrafficAgent]) -> Modification:
        """Return the same with these as all its added and moved agents.

        Those whose id is moved here stay moved, all others are added; who is left out is dropped.
        """
        names = {agent.id for agent in self.moved}
        added, moved = list[TrafficAgent](), list[TrafficAgent]()
        for agent in agents:
            (moved if agent.id in names else added).append(agent)
        return replace(self, added=tuple(added), moved=tuple(moved))


def apply(scene: Scene, modification: Modification) -> Scene:
    """The scene after the change; the given one stays as it is.

    Raises:
        InvalidModification: An id is unknown, taken, named twice, or the ego's.
    """
    check_fits(scene, modification)
    moved = {agent.id: agent for agent in modification.moved}
    # Who stays keeps its place in the order; who is added comes last.
    gone = set(modification.removed)
    agents = tuple(moved.get(agent.id, agent) for agent in scene.agents if agent.id not in gone)
    return replace(scene, agents=agents + modification.added)


def check_fits(scene: Scene, modification: Modification) -> None:
    """Raise InvalidModification unless every id of the modification fits the scene."""
    ids = {agent.id for agent in scene.agents}
    touched = [agent.id for agent in modification.changed] + list(modification.removed)
    doubled = sorted({name for name in touched if touched.count(name) > 1})
    if doubled:
        raise InvalidModification(f"named more than once: {', '.join(doubled)}")
    for agent in modification.changed:
        if agent.type is AgentType.EGO_VEHICLE:
            raise InvalidModification(f"{agent.id}: an added or moved agent can't be the ego")
    for agent in modification.added:
        if agent.id in ids or agent.id == scene.ego.id:
            raise InvalidModification(f"{agent.id} is in the scene already; an added agent is new")
    for name in [agent.id for agent in modification.moved] + list(modification.removed):
        if name == scene.ego.id:
            raise InvalidModification(f"{name} is the ego, which stays where it is")
        if name not in ids:
            allowed = ", ".join(sorted(ids)) or "none"
            raise InvalidModification(f"{name} is not in the scene; its agents: {allowed}")


def without_traffic(scene: Scene) -> Scene:
    """The scene with the ego alone, as interPlan clears it before its own objects are added."""
    return replace(scene, agents=())


class ScenarioType(schema.LabelEnum):
    """A type by interPlan's own name (`type` of a special scenario), with the paper's words."""

    CONSTRUCTION_ZONE = "approaching_construction_zone", "Construction zone"
    ACCIDENT_SITE = "avoid_crashed_cars", "Accident site"
    JAYWALKER = "jaywalking_pedestrian", "Jaywalker"
    NUDGE = "nudge_around_parked_vehicle", "Nudge around parked vehicle"
    OVERTAKE = "overtake_parked_vehicle", "Overtake parked vehicle"


def in_type_order(names: Iterable[str]) -> list[str]:
    """Names of types, each once: interPlan's five in their order, then others by their slugs."""
    present = set(names)
    five = [kind.value for kind in ScenarioType if kind.value in present]
    return [*five, *sorted(present.difference(five))]


class CatalogueSet(StrEnum):
    """Part of the authored catalogue that a scenario belongs to."""

    PAPER = "paper"
    HARD = "hard"
    MOVING = "moving"
    FOLLOW_UPS = "follow-ups"
    OPEN = "open"
