"""Assignment of agents to the parts of an instruction, and tolerances.

There is one set of tolerances for every scenario and contestant; docs/method.md says where each
number comes from.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from augment.checks.finding import Finding, FindingKind, find
from augment.checks.ground import Ground
from augment.checks.lanes_across import LanesAcross, find_picked, resolve_spots
from augment.checks.wish_patterns import match_nearest
from augment.checks.wish_places import Place
from augment.scene import intent as wish
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AgentType, Modification, Point, TrafficAgent
from augment.scene.motion import STEP_S, FloatArray
from augment.scene.planned_motion import PlannedMotion
from augment.scene.planned_mover import carry_out


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerances:
    """Tolerance of each kind of statement, in its unit; by default of what contestants hand in.

    Attributes:
        distance_m, distance_share: Along the lane, whichever is more; 3 m at 60 m.
        across_m: Across the lane, where an offset is asked for.
        middle_m: From the lane centre, where that is asked for.
        edge_m: Beyond the edge of the lane that was asked for.
        heading_deg: Of what is turned against its lane or a neighbour.
        spacing_m, spacing_share: Between neighbours, whichever is more.
        drift_m: How much further along the lane a walk ends.
    """

    # In the paper's figures GPT-4o's plain variant has a third quartile of 2.1 m and a whisker of
    # 2.9 m, and its table counts 3 position errors in 50: people accept that.
    distance_m: float = 2.5
    distance_share: float = 0.05
    # Half the width of the paper's "slight random offset of 0 to 1.5 m".
    across_m: float = 0.75
    # A car there still blocks its lane.
    middle_m: float = 1.0
    edge_m: float = 0.25
    # Half of what the check without an intent takes for a vehicle that follows its lane.
    heading_deg: float = 15.0
    # interPlan's cones stand 1.6 to 3.9 m apart.
    spacing_m: float = 0.75
    spacing_share: float = 0.3
    drift_m: float = 5.0


USUAL = Tolerances()
CRASH_M = 6.0
"""From one crashed vehicle to the next at most: the widest of interPlan's."""
SPEED_MPS, SPEED_SHARE = 1.0, 0.2
"""Of what moves, whichever is more."""
MARK_M = 5.0
"""From a place of the map to where the ego is waited for."""
MOTION = {
    "after_s": (0.5, 0.15),
    "within_m": (2.0, 0.15),
    "speed_mps": (SPEED_MPS, SPEED_SHARE),
    "braking_mps2": (0.75, 0.15),
    "duration_s": (1.0, 0.3),
}
"""Of each number of a motion, and a share of it, whichever is more."""
LONG_VEHICLE_M = 7.0
"""A vehicle of this length passes for a bus, as interPlan's file has it."""


class Role(StrEnum):
    """Role of an agent in its request, in the words of a sentence."""

    VEHICLE = "vehicle"
    CAR = "car"
    BUS = "bus"
    BICYCLE = "bicycle"
    PEDESTRIAN = "pedestrian"
    TRAFFIC_CONE = "traffic cone"
    WORKER = "worker"
    BARRIER = "barrier"
    CONSTRUCTION_SIGN = "construction sign"
    DOOR = "door"

    def suits(self, agent: TrafficAgent) -> bool:
        """Return whether an agent's type is right."""
        if self is Role.BUS and agent.length_m >= LONG_VEHICLE_M:
            return agent.type in _TYPES[Role.VEHICLE]
        return agent.type in (_TYPES.get(self) or (AgentType[self.name],))


_TYPES = {
    Role.VEHICLE: (AgentType.VEHICLE, AgentType.BUS),
    Role.CAR: (AgentType.VEHICLE,),
    Role.WORKER: (AgentType.PEDESTRIAN,),
    Role.DOOR: (AgentType.GENERIC_OBJECT,),
}
"""Of roles that are called otherwise than a type."""
_MISTYPED_M = 1e6
"""More than any distance."""
_ROLES = {wish.Body.VAN: Role.CAR, wish.Body.TRUCK: Role.CAR}


@dataclass(frozen=True, slots=True, kw_only=True)
class Party:
    """A request and those who answer it.

    Attributes:
        agents: Of the main role and the right type, the nearest to the ego first.
        workers: Those that stand beside cones.
        mistyped: Taken for what is missing, though of another type; with what they should be.
        missing: How many agents of each role nobody stands for.
        spare: Those of the main role that are one too many, whichever of them it is.
    """

    request: wish.Request
    agents: tuple[TrafficAgent, ...] = ()
    workers: tuple[TrafficAgent, ...] = ()
    mistyped: tuple[tuple[TrafficAgent, Role], ...] = ()
    missing: tuple[tuple[Role, int], ...] = ()
    spare: tuple[TrafficAgent, ...] = ()

    @property
    def everyone(self) -> tuple[TrafficAgent, ...]:
        """All of them."""
        return (*self.agents, *self.workers, *(agent for agent, _ in self.mistyped))

    @property
    def placed(self) -> tuple[TrafficAgent, ...]:
        """Agents that define the party's place: all but the workers."""
        stand_ins = (agent for agent, role in self.mistyped if role is not Role.WORKER)
        return (*self.agents, *stand_ins)

    @property
    def is_exact(self) -> bool:
        """True if nobody is missing, spare or of another type."""
        return not (self.missing or self.spare or self.mistyped)


def match_to_requests(
    intent: wish.Intent, added: Sequence[TrafficAgent], lanes: LanesAcross
) -> tuple[list[Party], tuple[TrafficAgent, ...]]:
    """Deal the added agents out to the requests so that they are nearest to what is asked for.

    Of another type they only stand in for what is still missing.

    Returns:
        All parties, and the added agents that no request asks for.
    """
    roles = [_roles(request, added) for request in intent.requests]
    places = [(number, role) for number, some in enumerate(roles) for role in some]
    taken = _assign_places(intent, places, added, lanes) if places and added else {}
    surplus = tuple(agent for index, agent in enumerate(added) if index not in taken.values())
    parties = []
    for number, request in enumerate(intent.requests):
        own = [place for place, (owner, _) in enumerate(places) if owner == number]
        answers = [(added[taken[place]], places[place][1]) for place in own if place in taken]
        right = [(agent, role) for agent, role in answers if role.suits(agent)]
        missing = [places[place][1] for place in own if place not in taken]
        agents = [agent for agent, role in right if role is not Role.WORKER]
        # Before the ego or behind it alike.
        agents.sort(key=lambda agent: abs(lanes.route.locate_agent(agent).ahead_m))
        party = Party(
            request=request,
            agents=tuple(agents),
            workers=tuple(agent for agent, role in right if role is Role.WORKER),
            mistyped=tuple((agent, role) for agent, role in answers if not role.suits(agent)),
            missing=tuple((role, missing.count(role)) for role in dict.fromkeys(missing)),
            spare=tuple(agent for agent in surplus if roles[number][0].suits(agent)),
        )
        parties.append(party)
    return parties, surplus


def _roles(request: wish.Request, added: Sequence[TrafficAgent]) -> list[Role]:
    """Return the roles of a request; an open count is the number there is, at least one."""
    kinds = {wish.WalkRequest: Role.PEDESTRIAN, wish.DoorRequest: Role.DOOR}
    role = kinds.get(type(request), Role.TRAFFIC_CONE)
    if isinstance(request, wish.VehicleRequest | wish.CrashRequest):
        role = _ROLES.get(request.body) or Role(request.body.value)
    count = request.count or max(sum(role.suits(agent) for agent in added), 1)
    if not isinstance(request, wish.ConesRequest):
        return [role] * count
    both = 2 if request.both_sides and request.count is not None else 1
    return [role] * (count * both) + [Role.WORKER] * request.has_worker


def _assign_places(
    intent: wish.Intent,
    places: Sequence[tuple[int, Role]],
    added: Sequence[TrafficAgent],
    lanes: LanesAcross,
) -> dict[int, int]:
    """Return by the index of a place, of a request's number and a role, that of its agent."""
    spots = (request.spot for request in intent.requests)
    admitted = [Place.of(spot, lanes.over(spot.via) or lanes, 0.0) for spot in spots]
    points = [(agent.x_m, agent.y_m) for agent in added]
    # (requests, agents): how far each agent is from where each request has somebody.
    off_m = np.array([[math.dist(at, place.nearest(at)) for at in points] for place in admitted])
    off_m = off_m[[number for number, _ in places]]
    misfits = np.array([[not role.suits(agent) for agent in added] for _, role in places])
    return dict(match_nearest(off_m + _MISTYPED_M * misfits))


@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """One modification, held against one intent.

    Attributes:
        ground: Of the scene before it.
        parties: The requests with those who answer them.
        surplus: Added agents that no request asks for.
        to_move, to_remove: Ids of the scene's agents that are to be elsewhere, or to go.
        unmet: Why the wish can't be met; None where it can.
        purpose: What the change is for; then nothing is surplus.
    """

    ground: Ground
    modification: Modification
    lanes: LanesAcross
    parties: tuple[Party, ...]
    surplus: tuple[TrafficAgent, ...]
    tolerances: Tolerances
    to_move: frozenset[str] = frozenset()
    to_remove: frozenset[str] = frozenset()
    unmet: str | None = None
    purpose: wish.Purpose | None = None

    @property
    def route(self) -> EgoRoute:
        """The ego's path over lanes."""
        return self.lanes.route

    def ahead_m(self, agent: TrafficAgent) -> float:
        """Return how far along the ego's route an agent is."""
        return self.route.locate_agent(agent).ahead_m

    def left_m(self, agent: TrafficAgent) -> float:
        """Return how far left of the ego's route an agent is."""
        return self.route.locate_agent(agent).left_m

    def carry_out(self, agent: TrafficAgent, times_s: Sequence[float]) -> FloatArray:
        """Return the states (T, 4) of a changed agent whose motion, if any, waits for nobody."""
        if agent.motion is not None or self.ground.scene.options.interplan is None:
            planned = replace(agent, motion=agent.motion or PlannedMotion())
            return carry_out(planned, self.route.graph, times_s)
        every = [agent if one.id == agent.id else one for one in self.modification.changed]
        change = self.modification.with_changed(every)
        movements = self.ground.motion_after(change, of_all=False).others
        (states,) = (one.states for one in movements if one.agent.id == agent.id)
        steps = np.round(np.array(times_s) / STEP_S).astype(int)
        return np.asarray(states[steps])

    def gap(self, wanted: wish.Length) -> "Bounds":
        """Return how far apart two things may be of which this is asked for."""
        # Of the larger number of a range.
        share_m = self.tolerances.spacing_share * wanted.high_m
        return Bounds(*wanted.span_m, max(self.tolerances.spacing_m, share_m))


def assign_parties(
    ground: Ground,
    modification: Modification,
    intent: wish.Intent,
    lanes: LanesAcross,
    tolerances: Tolerances = USUAL,
) -> Case:
    """Return a modification with who answers what; a move is a request for one vehicle.

    Args:
        ground: Of the scene before it.
        modification: What was changed.
        intent: What was asked for.
        lanes: Of the intent's route.
        tolerances: Of the checks.
    """
    counted = resolve_spots(intent, lanes)
    parties, surplus = match_to_requests(counted, modification.added, lanes)
    moved = {agent.id: agent for agent in modification.moved}
    picked = [(move, agent) for move in counted.moves for agent in find_picked(lanes, move.who)]
    for move, agent in picked:
        keeps = move.motion is None and move.speed_mps is None
        speed_mps = agent.speed_mps if keeps else move.speed_mps
        if agent.id in moved:
            request = replace(move.as_request(agent.type), speed_mps=speed_mps)
            parties.append(Party(request=request, agents=(moved[agent.id],)))
    gone = [agent.id for pick in intent.removals for agent in find_picked(lanes, pick)]
    movable = {agent.id for _, agent in picked}
    if intent.purpose is not None:  # which any change may serve
        surplus, gone, movable = (), [*gone, *modification.removed], movable | moved.keys()
    return Case(
        ground=ground,
        modification=modification,
        lanes=lanes,
        parties=tuple(parties),
        surplus=surplus,
        tolerances=tolerances,
        to_move=frozenset(movable),
        to_remove=frozenset(gone),
        unmet=intent.unmet,
        purpose=intent.purpose,
    )


AskedCheck = Callable[[Case], Iterator[Finding]]


@dataclass(frozen=True, slots=True)
class Bounds:
    """A range that a number is to be in, and how far outside of it the number may be."""

    low: float
    high: float
    allowed: float

    def off(self, value: float) -> float:
        """Return how far a value is outside the range, 0 within it."""
        return max(self.low - value, value - self.high, 0.0)

    def holds(self, value: float) -> bool:
        """Return whether a value is near enough."""
        return self.off(value) <= self.allowed

    def __str__(self) -> str:
        if math.isinf(self.high - self.low):
            return f"at least {self.low:g}" if self.low >= 0.0 else f"at most {self.high:g}"
        return f"{self.low:.4g}" if self.low == self.high else f"{self.low:.4g} to {self.high:.4g}"


def motion_bounds(name: str, low: float, high: float) -> Bounds:
    """Return the bounds of a motion's number that has to be in a range."""
    allowed, share = MOTION[name]
    return Bounds(low, high, max(allowed, share * high))


def hold(
    kind: FindingKind,
    agents: Sequence[TrafficAgent],
    what: str,
    value: float,
    wanted: Bounds,
    *,
    unit: str = "m",
) -> Finding:
    """Return the finding of a number held against the requested one.

    Args:
        kind: Of the finding.
        agents: Whom it is about.
        what: The number in words, with fields as `Finding` has them.
        value: The number.
        wanted: What it is to be.
        unit: Of the number.
    """
    words = f"{what} is {value:.2f} {unit}; {wanted} {unit} is asked for."
    off = wanted.off(value)
    return find(kind, wanted.holds(value), agents, words, value=value, off=off)


def apart_m(agent: TrafficAgent, other: TrafficAgent) -> float:
    """Return the distance from centre to centre."""
    return math.hypot(agent.x_m - other.x_m, agent.y_m - other.y_m)


def meets_route(route: EgoRoute, agent: TrafficAgent) -> Point | None:
    """Return the point where a walk crosses the middle of the ego's route, None without one."""
    if agent.walk_to_m is None:
        return None
    start, end = route.locate_agent(agent).left_m, route.locate(*agent.walk_to_m).left_m
    if start * end >= 0.0:
        return None
    # Distances to the route go from start to end, linearly along the walk; there they are 0.
    share = start / (start - end)
    x_m, y_m = agent.walk_to_m
    return agent.x_m + share * (x_m - agent.x_m), agent.y_m + share * (y_m - agent.y_m)
