"""A human reference of interPlan as an intent and as a sentence: its file has places, no words.

Both count as instructions do, along the lanes of the ego's way and across them. Only what
interPlan's keys can hold comes up: vehicles and buses that stand, cones, people.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from augment.checks.ground import Ground
from augment.checks.lanes_across import Band, LanesAcross
from augment.checks.registry import check_against_intent
from augment.geometry.frames import difference
from augment.scene import intent as wish
from augment.scene.entities import (
    AgentType,
    Modification,
    Point,
    ScenarioType,
    Scene,
    TrafficAgent,
    TurnType,
)

_STRAIGHT_DEG = 5.0
_BESIDE_M = 0.1
_ON_ROAD_M = 1.0
_ROW_M, _TAPER_M = 1.0, 1.0
_LEADS = {
    ScenarioType.CONSTRUCTION_ZONE: "Put up a construction zone",
    ScenarioType.ACCIDENT_SITE: "Show the site of an accident",
    ScenarioType.JAYWALKER: "Let somebody cross the road outside a crosswalk",
    ScenarioType.NUDGE: "Have the ego nudge around what stands at the side of its lane",
    ScenarioType.OVERTAKE: "Have the ego overtake what stands in its lane",
}
_LANES = {
    wish.LaneChoice.OWN: "in the ego's lane",
    wish.LaneChoice.LEFT: "in the next lane to the left",
    wish.LaneChoice.RIGHT: "in the next lane to the right",
    wish.LaneChoice.ONCOMING: "in the oncoming lane",
}


def describe_reference(
    kind: ScenarioType, reference: Modification, scene: Scene
) -> tuple[str, wish.Intent | None]:
    """Return the sentence that asks for a reference, and the same as an intent.

    Args:
        kind: The type of the special scenario.
        reference: What people placed.
        scene: Before the change, with the scenario's goal.

    Returns:
        The intent is None where the ego is on no lane, or where nothing can be said as a request;
        else without offsets and lanes where the reference meets it better so.
    """
    ground = Ground.of(scene)
    lanes = LanesAcross.of(ground, scene.options.goal or TurnType.STRAIGHT)
    sentence = _sentence(kind, reference, lanes, scene)
    if lanes is None:
        return sentence, None
    full = wish.Intent(requests=tuple(_requests(reference, lanes)), route=lanes.route.turn)
    if not full.requests:
        return sentence, None
    looser = replace(full, requests=tuple(map(_looser, full.requests)))
    faults = [
        sum(one.is_fault for one in check_against_intent(ground, reference, intent))
        for intent in (full, looser)
    ]
    return sentence, full if faults[0] <= faults[1] else looser


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """A place by the lanes: ahead of the ego along them, and left of the centre of its lane.

    Attributes:
        lane: None beside every lane that runs along; `left_m` counts from the ego's lane then.
    """

    ahead_m: float
    lane: wish.LaneChoice | None
    band: Band | None
    left_m: float
    tangent_rad: float


def _place_at(point: Point, lanes: LanesAcross) -> _Place:
    here = lanes.route.locate(*point)
    for choice in wish.LaneChoice:
        band = lanes.band(choice, here.ahead_m)
        if band is not None and abs(here.left_m - band.left_m) <= band.width_m / 2.0:
            left_m, tangent_rad = here.left_m - band.left_m, band.tangent_rad
            break
    else:
        choice, left_m, tangent_rad = None, here.left_m, here.tangent_rad
        band = lanes.band(wish.LaneChoice.OWN, here.ahead_m)
    return _Place(
        ahead_m=here.ahead_m, lane=choice, band=band, left_m=left_m, tangent_rad=tangent_rad
    )


def _place_of(agent: TrafficAgent, lanes: LanesAcross) -> _Place:
    return _place_at((agent.x_m, agent.y_m), lanes)


# The intent


def _requests(reference: Modification, lanes: LanesAcross) -> Iterator[wish.Request]:
    added = sorted(reference.added, key=lambda one: lanes.route.locate_agent(one).ahead_m)
    cones = [agent for agent in added if agent.type is AgentType.TRAFFIC_CONE]
    people = [agent for agent in added if agent.type is AgentType.PEDESTRIAN]
    vehicles = [agent for agent in added if agent.type in (AgentType.VEHICLE, AgentType.BUS)]
    if cones:
        yield _cones(cones, any(agent.walk_to_m is None for agent in people), lanes)
    yield from (_vehicle(agent, lanes) for agent in vehicles)
    yield from (_walk(agent, lanes) for agent in people if agent.walk_to_m is not None)


def _spot(place: _Place) -> wish.Spot:
    return wish.Spot(
        distance=_length(abs(place.ahead_m)),
        relation=wish.Relation.AHEAD if place.ahead_m >= 0.0 else wish.Relation.BEHIND,
        lane=place.lane or wish.LaneChoice.OWN,
    )


def _length(metres: float) -> wish.Length:
    return wish.Length(low_m=round(metres, 1), high_m=round(metres, 1))


def _boundary(left_m: float) -> wish.LateralTarget:
    return wish.LateralTarget.LEFT_BOUNDARY if left_m > 0.0 else wish.LateralTarget.RIGHT_BOUNDARY


def _vehicle(agent: TrafficAgent, lanes: LanesAcross) -> wish.VehicleRequest:
    place = _place_of(agent, lanes)
    facing, turn_deg = _turned(agent, place)
    lateral = None
    if abs(place.left_m) >= _BESIDE_M:
        outside = place.lane is None
        lateral = wish.Lateral(
            target=_boundary(place.left_m),
            nearness=wish.Nearness.OUTSIDE if outside else None,
            offset=None if outside else _length(abs(place.left_m)),
        )
    return wish.VehicleRequest(
        spot=replace(_spot(place), lateral=lateral),
        body=wish.Body.BUS if agent.type is AgentType.BUS else wish.Body.VEHICLE,
        facing=facing,
        turn_deg=turn_deg,
        speed_mps=0.0,
        count=1,
    )


def _turned(agent: TrafficAgent, place: _Place) -> tuple[wish.Facing, float]:
    """Where something looks against its lane, and how many degrees besides."""
    turn_deg = math.degrees(difference(agent.heading_rad, place.tangent_rad))
    is_against = abs(turn_deg) > 90.0
    off_deg = round((turn_deg - 180.0 * is_against + 180.0) % 360.0 - 180.0)
    facing = wish.Facing.AGAINST_LANE if is_against else wish.Facing.WITH_LANE
    return facing, float(off_deg) if abs(off_deg) >= _STRAIGHT_DEG else 0.0


def _walk(agent: TrafficAgent, lanes: LanesAcross) -> wish.WalkRequest:
    start = lanes.route.locate(agent.x_m, agent.y_m)
    end = lanes.route.locate(*(agent.walk_to_m or (0.0, 0.0)))
    return wish.WalkRequest(
        spot=replace(_spot(_place_of(agent, lanes)), lane=None),
        start=wish.Side.LEFT if start.left_m > end.left_m else wish.Side.RIGHT,
        count=1,
        speed_mps=agent.speed_mps or None,
        drift_m=round(end.ahead_m - start.ahead_m, 1),
        on_road=abs(start.left_m) < _ON_ROAD_M,
    )


def _cones(
    cones: Sequence[TrafficAgent], has_worker: bool, lanes: LanesAcross
) -> wish.ConesRequest:
    """Cones in a line along the way, in a row across it, or in a taper."""
    points = np.array([(cone.x_m, cone.y_m) for cone in cones])
    located = [lanes.route.locate_agent(cone) for cone in cones]
    aside_m = located[0].left_m - located[-1].left_m
    shape = wish.Shape.TAPER if abs(aside_m) >= _TAPER_M else wish.Shape.LINE
    if located[-1].ahead_m - located[0].ahead_m < _ROW_M:
        shape = wish.Shape.ROW
    first = _place_of(cones[0], lanes)
    lateral, spacing = None, None
    if shape is wish.Shape.LINE:
        centre_m = 0.0 if first.band is None else first.band.width_m / 4.0
        is_central = abs(first.left_m) < centre_m
        target = wish.LateralTarget.LANE_CENTRE if is_central else _boundary(first.left_m)
        lateral = wish.Lateral(target=target)
    if len(cones) > 1:
        apart_m = np.hypot(*(points[:, None] - points).T)
        np.fill_diagonal(apart_m, np.inf)
        spacing = _length(median(apart_m.min(axis=0).tolist()))
    start = wish.Side.LEFT if aside_m > 0.0 else wish.Side.RIGHT
    return wish.ConesRequest(
        spot=replace(_spot(first), lateral=lateral),
        shape=shape,
        count=len(cones),
        spacing=spacing,
        start=start if shape is wish.Shape.TAPER else None,
        has_worker=has_worker,
    )


def _looser(request: wish.Request) -> wish.Request:
    """Without what says how things stand across the road and to each other."""
    spot = replace(request.spot, lateral=None, lane=None)
    match request:
        case wish.WalkRequest():
            return replace(request, drift_m=None, on_road=False)
        case wish.ConesRequest():
            return replace(request, spot=spot, spacing=None, start=None)
        case _:
            return replace(request, spot=spot)


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
