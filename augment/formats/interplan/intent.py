"""A human reference of interPlan as an intent and as a sentence: its file has places, no words.

Both count as instructions do, along the lanes of the ego's way and across them. Only what
interPlan's keys can hold comes up: vehicles and buses that stand, cones, people.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import median

import numpy as np

from augment.checks.ground import Ground
from augment.checks.lanes_across import Band, LanesAcross
from augment.checks.registry import check_against_intent
from augment.geometry.frames import difference
from augment.scene.entities import (
    AgentType,
    Modification,
    Point,
    ScenarioType,
    Scene,
    TrafficAgent,
    TurnType,
)
from augment.scene.intent import (
    Bearing,
    Body,
    ConesRequest,
    CrashedCar,
    CrashRequest,
    Facing,
    Intent,
    LaneChoice,
    Lateral,
    LateralTarget,
    Length,
    Nearness,
    Relation,
    Request,
    Shape,
    Side,
    Spot,
    VehicleRequest,
    WalkRequest,
)

_STRAIGHT_DEG = 5.0
_BESIDE_M = 0.1
_ON_ROAD_M = 1.0
_ROW_M, _TAPER_M = 1.0, 1.0
_RING_GAP_DEG = 100.0
"""Cones with no wider gap than this around their middle stand in a ring."""
_LEADS = {
    ScenarioType.CONSTRUCTION_ZONE: "Put up a construction zone",
    ScenarioType.ACCIDENT_SITE: "Show the site of an accident",
    ScenarioType.JAYWALKER: "Let somebody cross the road outside a crosswalk",
    ScenarioType.NUDGE: "Have the ego nudge around what stands at the side of its lane",
    ScenarioType.OVERTAKE: "Have the ego overtake what stands in its lane",
}
_LANES = {
    LaneChoice.OWN: "in the ego's lane",
    LaneChoice.LEFT: "in the next lane to the left",
    LaneChoice.RIGHT: "in the next lane to the right",
    LaneChoice.ONCOMING: "in the oncoming lane",
}


def describe_reference(
    kind: ScenarioType, reference: Modification, scene: Scene
) -> tuple[str, Intent | None]:
    """Return the sentence that asks for a reference, and the same as an intent.

    Args:
        kind: The type of the special scenario.
        reference: What people placed.
        scene: Before the change, with the scenario's goal.

    Returns:
        The intent is None where the ego is on no lane, or where nothing can be said as a request;
        else the most detailed one that the reference itself meets.
    """
    ground = Ground.of(scene)
    lanes = LanesAcross.of(ground, scene.options.goal or TurnType.STRAIGHT)
    sentence = _sentence(kind, reference, lanes, scene)
    if lanes is None:
        return sentence, None
    full = Intent(requests=tuple(_requests(kind, reference, lanes)), route=lanes.route.turn)
    if not full.requests:
        return sentence, None

    def count_faults(intent: Intent) -> int:
        findings = check_against_intent(ground, reference, intent)
        return sum(one.is_fault for one in findings)

    looser: list[Callable[[Request], Request]] = [_without_offsets, _without_lane]
    intents = [replace(full, requests=tuple(map(step, full.requests))) for step in looser]
    return sentence, min([full, *intents], key=count_faults)  # of equal ones the first


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """A place by the lanes: ahead of the ego along them, and left of the centre of its lane.

    Attributes:
        lane: None beside every lane that runs along; `left_m` counts from the ego's lane then.
    """

    ahead_m: float
    lane: LaneChoice | None
    band: Band | None
    left_m: float
    tangent_rad: float


def _place_at(point: Point, lanes: LanesAcross) -> _Place:
    here = lanes.route.locate(*point)
    for choice in LaneChoice:
        band = lanes.band(choice, here.ahead_m)
        if band is not None and abs(here.left_m - band.left_m) <= band.width_m / 2.0:
            left_m, tangent_rad = here.left_m - band.left_m, band.tangent_rad
            break
    else:
        choice, left_m, tangent_rad = None, here.left_m, here.tangent_rad
        band = lanes.band(LaneChoice.OWN, here.ahead_m)
    return _Place(
        ahead_m=here.ahead_m, lane=choice, band=band, left_m=left_m, tangent_rad=tangent_rad
    )


def _place_of(agent: TrafficAgent, lanes: LanesAcross) -> _Place:
    return _place_at((agent.x_m, agent.y_m), lanes)


# The intent


def _requests(
    kind: ScenarioType, reference: Modification, lanes: LanesAcross
) -> Iterator[Request]:
    added = sorted(reference.added, key=lambda one: lanes.route.locate_agent(one).ahead_m)
    cones = [agent for agent in added if agent.type is AgentType.TRAFFIC_CONE]
    people = [agent for agent in added if agent.type is AgentType.PEDESTRIAN]
    vehicles = [agent for agent in added if agent.type in (AgentType.VEHICLE, AgentType.BUS)]
    if cones:
        yield _cones(cones, any(agent.walk_to_m is None for agent in people), lanes)
    if kind is ScenarioType.ACCIDENT_SITE and len(vehicles) > 1:
        yield _crash(vehicles, lanes)
    else:
        yield from (_vehicle(agent, lanes) for agent in vehicles)
    yield from (_walk(agent, lanes) for agent in people if agent.walk_to_m is not None)


def _spot(place: _Place) -> Spot:
    return Spot(
        distance=_length(abs(place.ahead_m)),
        relation=Relation.AHEAD if place.ahead_m >= 0.0 else Relation.BEHIND,
        lane=place.lane or LaneChoice.OWN,
    )


def _length(metres: float) -> Length:
    return Length(low_m=round(metres, 1), high_m=round(metres, 1))


def _boundary(left_m: float) -> LateralTarget:
    return LateralTarget.LEFT_BOUNDARY if left_m > 0.0 else LateralTarget.RIGHT_BOUNDARY


def _vehicle(agent: TrafficAgent, lanes: LanesAcross) -> VehicleRequest:
    place = _place_of(agent, lanes)
    facing, turn_deg = _turned(agent, place)
    lateral = None
    if abs(place.left_m) >= _BESIDE_M:
        outside = place.lane is None
        lateral = Lateral(
            target=_boundary(place.left_m),
            nearness=Nearness.OUTSIDE if outside else None,
            offset=None if outside else _length(abs(place.left_m)),
        )
    return VehicleRequest(
        spot=replace(_spot(place), lateral=lateral),
        body=Body.BUS if agent.type is AgentType.BUS else Body.VEHICLE,
        facing=facing,
        turn_deg=turn_deg,
        speed_mps=0.0,
        count=1,
    )


def _turned(agent: TrafficAgent, place: _Place) -> tuple[Facing, float]:
    """Where something looks against its lane, and how many degrees besides."""
    turn_deg = math.degrees(difference(agent.heading_rad, place.tangent_rad))
    is_against = abs(turn_deg) > 90.0
    off_deg = round((turn_deg - 180.0 * is_against + 180.0) % 360.0 - 180.0)
    facing = Facing.AGAINST_LANE if is_against else Facing.WITH_LANE
    return facing, float(off_deg) if abs(off_deg) >= _STRAIGHT_DEG else 0.0


def _walk(agent: TrafficAgent, lanes: LanesAcross) -> WalkRequest:
    start = lanes.route.locate(agent.x_m, agent.y_m)
    end = lanes.route.locate(*(agent.walk_to_m or (0.0, 0.0)))
    return WalkRequest(
        spot=replace(_spot(_place_of(agent, lanes)), lane=None),
        start=Side.LEFT if start.left_m > end.left_m else Side.RIGHT,
        count=1,
        speed_mps=agent.speed_mps or None,
        drift_m=round(end.ahead_m - start.ahead_m, 1),
        on_road=abs(start.left_m) < _ON_ROAD_M,
    )


def _cones(cones: Sequence[TrafficAgent], has_worker: bool, lanes: LanesAcross) -> ConesRequest:
    points = np.array([(cone.x_m, cone.y_m) for cone in cones])
    located = [lanes.route.locate_agent(cone) for cone in cones]
    places = np.array([(place.ahead_m, place.left_m) for place in located])
    shape, first = _shape(places), _place_of(cones[0], lanes)
    if shape is Shape.RING:
        x_m, y_m = points.mean(axis=0).tolist()
        first = _place_at((x_m, y_m), lanes)
    spot = _spot(first)
    if shape is Shape.LINE:
        centre_m = 0.0 if first.band is None else first.band.width_m / 4.0
        is_central = abs(first.left_m) < centre_m
        target = LateralTarget.LANE_CENTRE if is_central else _boundary(first.left_m)
        spot = replace(spot, lateral=Lateral(target=target))
    spacing = None
    if len(cones) > 1:
        apart_m = np.hypot(*(points[:, None] - points).T)
        np.fill_diagonal(apart_m, np.inf)
        spacing = _length(median(apart_m.min(axis=0).tolist()))
    start = Side.LEFT if places[0, 1] > places[-1, 1] else Side.RIGHT
    return ConesRequest(
        spot=spot,
        shape=shape,
        count=len(cones),
        spacing=spacing,
        start=start if shape is Shape.TAPER else None,
        has_worker=has_worker,
    )


def _shape(places: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> Shape:
    """How cones stand by their places (ahead, left), in their order ahead."""
    if len(places) > 3:
        ahead_m, left_m = (places - places.mean(axis=0)).T
        angles = np.sort(np.arctan2(left_m, ahead_m))
        gaps = np.diff(angles, append=angles[0] + 2.0 * math.pi)
        if math.degrees(gaps.max()) < _RING_GAP_DEG:
            return Shape.RING
    if np.ptp(places[:, 0]) < _ROW_M:
        return Shape.ROW
    return Shape.TAPER if abs(places[0, 1] - places[-1, 1]) >= _TAPER_M else Shape.LINE


def _crash(vehicles: Sequence[TrafficAgent], lanes: LanesAcross) -> CrashRequest:
    first = _place_of(vehicles[0], lanes)
    facing, turn_deg = _turned(vehicles[0], first)
    return CrashRequest(
        spot=_spot(first),
        count=len(vehicles),
        body=Body.VEHICLE,
        facing=facing if not turn_deg else None,
        others=tuple(_crashed(one, before, lanes) for before, one in pairwise(vehicles)),
    )


def _crashed(one: TrafficAgent, before: TrafficAgent, lanes: LanesAcross) -> CrashedCar:
    here, there = (lanes.route.locate_agent(agent) for agent in (before, one))
    ahead_m, left_m = there.ahead_m - here.ahead_m, there.left_m - here.left_m
    if abs(ahead_m) >= abs(left_m):
        bearing = Bearing.AHEAD if ahead_m > 0.0 else Bearing.BEHIND
    else:
        bearing = Bearing.LEFT if left_m > 0.0 else Bearing.RIGHT
    return CrashedCar(
        gap=_length(math.dist((before.x_m, before.y_m), (one.x_m, one.y_m))),
        bearing=bearing,
        turn_deg=float(round(math.degrees(difference(one.heading_rad, before.heading_rad)))),
        is_signed=True,
    )


def _without_offsets(request: Request) -> Request:
    """Without what says how things stand across their lane and to each other."""
    spot = replace(request.spot, lateral=None)
    match request:
        case VehicleRequest():
            return replace(request, spot=spot)
        case WalkRequest():
            return replace(request, drift_m=None, on_road=False)
        case ConesRequest():
            return replace(request, spot=spot, spacing=None, start=None)
        case CrashRequest():
            return replace(request, facing=None, others=())


def _without_lane(request: Request) -> Request:
    bare = _without_offsets(request)
    return replace(bare, spot=replace(bare.spot, lane=None))


# The sentence


def _sentence(
    kind: ScenarioType, reference: Modification, lanes: LanesAcross | None, scene: Scene
) -> str:
    """The sentences from which a reader could put the same objects to the same places."""
    added = sorted(reference.added, key=lambda one: (one.x_m, one.y_m))
    cones = [agent for agent in added if agent.type is AgentType.TRAFFIC_CONE]
    spots = ", ".join(_where((one.x_m, one.y_m), lanes) for one in cones)
    parts = [f"{len(cones)} traffic cones: {spots}"] if len(cones) > 1 else []
    if len(cones) == 1:
        parts = [f"a traffic cone {spots}"]
    others = [agent for agent in added if agent.type is not AgentType.TRAFFIC_CONE]
    parts += [_thing(other, kind, lanes) for other in others]
    goal = scene.options.goal
    way = "" if goal is None else f" The ego is to turn {goal}."
    if goal is TurnType.STRAIGHT:
        way = " The ego is to go straight on."
    return f"{_LEADS[kind]}: {'; '.join(parts)}.{way}"


def _thing(agent: TrafficAgent, kind: ScenarioType, lanes: LanesAcross | None) -> str:
    here = _where((agent.x_m, agent.y_m), lanes)
    if agent.type is AgentType.PEDESTRIAN:
        if agent.walk_to_m is not None:
            return f"a pedestrian who walks from {here} to {_where(agent.walk_to_m, lanes)}"
        who = "worker" if kind is ScenarioType.CONSTRUCTION_ZONE else "pedestrian"
        return f"a {who} who stands {here}"
    what = "bus" if agent.type is AgentType.BUS else "vehicle"
    how = "crashed" if kind is ScenarioType.ACCIDENT_SITE else "parked"
    base_rad = 0.0 if lanes is None else _place_of(agent, lanes).tangent_rad
    base = "the ego's direction" if lanes is None else "the lane's direction"
    degrees = math.degrees(difference(agent.heading_rad, base_rad))
    turn = f"turned {abs(degrees):.0f} degrees to the {_side(degrees)} of {base}"
    if abs(degrees) < _STRAIGHT_DEG:
        turn = f"in {base}"
    return f"a {how} {what} {here}, {turn}"


def _where(point: Point, lanes: LanesAcross | None) -> str:
    """A place along the lanes; on a map without a lane for the ego, straight ahead of it."""
    if lanes is None:
        side = f" and {abs(point[1]):.1f} m to its {_side(point[1])}"
        return f"{_ahead(point[0])} the ego{side if abs(point[1]) >= _BESIDE_M else ''}"
    place = _place_at(point, lanes)
    where = f"{_ahead(place.ahead_m)} the ego along its lane"
    aside = f"{abs(place.left_m):.1f} m"
    side = _side(place.left_m)
    if place.lane is None:
        return f"{where} and {aside} to the {side} of its centre, beside the lanes"
    where += f", {_LANES[place.lane]}"
    return where if abs(place.left_m) < _BESIDE_M else f"{where}, {aside} {side} of its centre"


def _ahead(metres: float) -> str:
    return f"{abs(metres):.1f} m {'ahead of' if metres >= 0.0 else 'behind'}"


def _side(left_m: float) -> str:
    return "left" if left_m > 0.0 else "right"
