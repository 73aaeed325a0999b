"""A human reference of interPlan as an intent and as a sentence: its file has places, no words.

Both count as instructions do, along the lanes of the ego's way and across them. Only what
interPlan's keys can hold comes up: vehicles and buses that stand, cones, people.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import median

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
    """The sentence that asks for a reference, and the same as an intent.

    Args:
        kind: The type of the special scenario.
        reference: What people placed.
        scene: Before the change, with the scenario's goal.

    Returns:
        The intent is None where the ego is on no lane, or where nothing can be said as a request.
    """
    ground = Ground.of(scene)
    lanes = LanesAcross.of(ground, scene.options.goal or TurnType.STRAIGHT)
    if lanes is None:
        return _sentence(kind, reference, None, scene), None
    surveyed = _Survey(lanes)
    return _sentence(kind, reference, surveyed, scene), _intent(kind, reference, surveyed, ground)


# Private: places


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


class _Survey:
    """Reads places by the lanes across the ego's way."""

    def __init__(self, lanes: LanesAcross) -> None:
        self.lanes = lanes

    def at(self, point: Point) -> _Place:
        here = self.lanes.route.locate(*point)
        for choice in LaneChoice:
            band = self.lanes.band(choice, here.ahead_m)
            if band is not None and abs(here.left_m - band.left_m) <= band.width_m / 2.0:
                return _Place(
                    ahead_m=here.ahead_m,
                    lane=choice,
                    band=band,
                    left_m=here.left_m - band.left_m,
                    tangent_rad=band.tangent_rad,
                )
        return _Place(
            ahead_m=here.ahead_m,
            lane=None,
            band=self.lanes.band(LaneChoice.OWN, here.ahead_m),
            left_m=here.left_m,
            tangent_rad=here.tangent_rad,
        )

    def of(self, agent: TrafficAgent) -> _Place:
        return self.at((agent.x_m, agent.y_m))

    def ahead_m(self, agent: TrafficAgent) -> float:
        return self.lanes.route.locate_agent(agent).ahead_m


# Private: the intent


def _intent(
    kind: ScenarioType, reference: Modification, survey: _Survey, ground: Ground
) -> Intent | None:
    """The most detailed intent that the reference itself meets."""
    route = survey.lanes.route.turn
    full = Intent(requests=tuple(_requests(kind, reference, survey)), route=route)
    if not full.requests:
        return None
    looser = [full, *(_loosened(full, step) for step in (_without_offsets, _without_lanes))]

    def count_faults(intent: Intent) -> int:
        findings = check_against_intent(ground, reference, intent)
        return sum(one.is_fault for one in findings)

    return min(looser, key=count_faults)  # of equal ones the first


def _requests(kind: ScenarioType, reference: Modification, survey: _Survey) -> Iterator[Request]:
    added = sorted(reference.added, key=survey.ahead_m)
    cones = [agent for agent in added if agent.type is AgentType.TRAFFIC_CONE]
    people = [agent for agent in added if agent.type is AgentType.PEDESTRIAN]
    vehicles = [agent for agent in added if agent.type in (AgentType.VEHICLE, AgentType.BUS)]
    standing = [agent for agent in people if agent.walk_to_m is None]
    if cones:
        yield _cones(cones, bool(standing), survey)
    if kind is ScenarioType.ACCIDENT_SITE and len(vehicles) > 1:
        yield _crash(vehicles, survey)
    else:
        yield from (_vehicle(agent, survey) for agent in vehicles)
    yield from (_walk(agent, survey) for agent in people if agent.walk_to_m is not None)


def _spot(place: _Place) -> Spot:
    return Spot(
        distance=_length(abs(place.ahead_m)),
        relation=Relation.AHEAD if place.ahead_m >= 0.0 else Relation.BEHIND,
        lane=place.lane or LaneChoice.OWN,
    )


def _length(metres: float) -> Length:
    rounded_m = round(metres, 1)
    return Length(low_m=rounded_m, high_m=rounded_m)


def _vehicle(agent: TrafficAgent, survey: _Survey) -> VehicleRequest:
    place = survey.of(agent)
    facing, turn_deg = _turned(agent, place)
    return VehicleRequest(
        spot=replace(_spot(place), lateral=_lateral(place)),
        body=Body.BUS if agent.type is AgentType.BUS else Body.VEHICLE,
        facing=facing,
        turn_deg=turn_deg,
        speed_mps=0.0,
        count=1,
    )


def _lateral(place: _Place) -> Lateral | None:
    if abs(place.left_m) < _BESIDE_M:
        return None
    is_left = place.left_m > 0.0
    target = LateralTarget.LEFT_BOUNDARY if is_left else LateralTarget.RIGHT_BOUNDARY
    if place.lane is None:
        return Lateral(target=target, nearness=Nearness.OUTSIDE)
    return Lateral(target=target, offset=_length(abs(place.left_m)))


def _turned(agent: TrafficAgent, place: _Place) -> tuple[Facing, float]:
    """Where something looks against its lane, and how many degrees besides."""
    turn_deg = math.degrees(difference(agent.heading_rad, place.tangent_rad))
    facing, base_deg = Facing.WITH_LANE, 0.0
    if abs(turn_deg) > 90.0:
        facing, base_deg = Facing.AGAINST_LANE, 180.0
    off_deg = round((turn_deg - base_deg + 180.0) % 360.0 - 180.0)
    return facing, float(off_deg) if abs(off_deg) >= _STRAIGHT_DEG else 0.0


def _walk(agent: TrafficAgent, survey: _Survey) -> WalkRequest:
    assert agent.walk_to_m is not None
    start, end = (
        survey.lanes.route.locate(*point) for point in ((agent.x_m, agent.y_m), agent.walk_to_m)
    )
    return WalkRequest(
        spot=replace(_spot(survey.of(agent)), lane=None),
        start=Side.LEFT if start.left_m > end.left_m else Side.RIGHT,
        count=1,
        speed_mps=agent.speed_mps or None,
        drift_m=round(end.ahead_m - start.ahead_m, 1),
        on_road=abs(start.left_m) < _ON_ROAD_M,
    )


def _cones(cones: Sequence[TrafficAgent], has_worker: bool, survey: _Survey) -> ConesRequest:
    places = [survey.lanes.route.locate_agent(cone) for cone in cones]
    shape = _shape([(place.ahead_m, place.left_m) for place in places])
    first = survey.of(cones[0])
    if shape is Shape.RING:
        middle = _middle([(cone.x_m, cone.y_m) for cone in cones])
        first = survey.at(middle)
    spot = _spot(first)
    if shape is Shape.LINE:
        spot = replace(spot, lateral=replace(_at_boundary(first)))
    across_m = places[0].left_m - places[-1].left_m
    return ConesRequest(
        spot=spot,
        shape=shape,
        count=len(cones),
        spacing=_length(_spacing_m(cones)) if len(cones) > 1 else None,
        start=(Side.LEFT if across_m > 0.0 else Side.RIGHT) if shape is Shape.TAPER else None,
        has_worker=has_worker,
    )


def _at_boundary(place: _Place) -> Lateral:
    half_m = 0.0 if place.band is None else place.band.width_m / 4.0
    if abs(place.left_m) < half_m:
        return Lateral(target=LateralTarget.LANE_CENTRE)
    is_left = place.left_m > 0.0
    return Lateral(target=LateralTarget.LEFT_BOUNDARY if is_left else LateralTarget.RIGHT_BOUNDARY)


def _shape(places: Sequence[Point]) -> Shape:
    """How cones stand by their places (ahead, left), in their order ahead."""
    ahead = [place[0] for place in places]
    if len(places) > 3 and _is_ring(places):
        return Shape.RING
    if max(ahead) - min(ahead) < _ROW_M:
        return Shape.ROW
    return Shape.TAPER if abs(places[0][1] - places[-1][1]) >= _TAPER_M else Shape.LINE


def _is_ring(places: Sequence[Point]) -> bool:
    middle = _middle(places)
    angles = sorted(math.atan2(left - middle[1], ahead - middle[0]) for ahead, left in places)
    following = [*angles[1:], angles[0] + 2.0 * math.pi]
    gaps = (after - before for before, after in zip(angles, following, strict=True))
    return math.degrees(max(gaps)) < _RING_GAP_DEG


def _middle(places: Sequence[Point]) -> Point:
    return sum(x for x, _ in places) / len(places), sum(y for _, y in places) / len(places)


def _spacing_m(cones: Sequence[TrafficAgent]) -> float:
    """The median distance from a cone to the nearest other."""
    return median(
        min(math.dist((one.x_m, one.y_m), (other.x_m, other.y_m)) for other in cones
            if other is not one)
        for one in cones
    )  # fmt: skip


def _crash(vehicles: Sequence[TrafficAgent], survey: _Survey) -> CrashRequest:
    first = survey.of(vehicles[0])
    facing, turn_deg = _turned(vehicles[0], first)
    return CrashRequest(
        spot=_spot(first),
        count=len(vehicles),
        body=Body.VEHICLE,
        facing=facing if not turn_deg else None,
        others=tuple(_crashed(one, before, survey) for before, one in pairwise(vehicles)),
    )


def _crashed(one: TrafficAgent, before: TrafficAgent, survey: _Survey) -> CrashedCar:
    here, there = (survey.lanes.route.locate_agent(agent) for agent in (before, one))
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


def _loosened(intent: Intent, step: object) -> Intent:
    assert callable(step)
    return replace(intent, requests=tuple(step(request) for request in intent.requests))


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


def _without_lanes(request: Request) -> Request:
    bare = _without_offsets(request)
    return replace(bare, spot=replace(bare.spot, lane=None))


# Private: the sentence


def _sentence(
    kind: ScenarioType, reference: Modification, survey: _Survey | None, scene: Scene
) -> str:
    """The sentences from which a reader could put the same objects to the same places."""
    cones = [agent for agent in reference.added if agent.type is AgentType.TRAFFIC_CONE]
    others = [agent for agent in reference.added if agent.type is not AgentType.TRAFFIC_CONE]
    parts = []
    if cones:
        what = "a traffic cone" if len(cones) == 1 else f"{len(cones)} traffic cones"
        spots = ", ".join(_where((one.x_m, one.y_m), survey, scene) for one in _sorted(cones))
        parts.append(f"{what}: {spots}" if len(cones) > 1 else f"{what} {spots}")
    parts += [_thing(other, kind, survey, scene) for other in _sorted(others)]
    goal = scene.options.goal
    way = {None: "", TurnType.STRAIGHT: " The ego is to go straight on."}.get(
        goal, f" The ego is to turn {goal}."
    )
    return f"{_LEADS[kind]}: {'; '.join(parts)}.{way}"


def _sorted(agents: Iterable[TrafficAgent]) -> list[TrafficAgent]:
    return sorted(agents, key=lambda one: (one.x_m, one.y_m))


def _thing(agent: TrafficAgent, kind: ScenarioType, survey: _Survey | None, scene: Scene) -> str:
    here = _where((agent.x_m, agent.y_m), survey, scene)
    if agent.type is AgentType.PEDESTRIAN:
        if agent.walk_to_m is not None:
            there = _where(agent.walk_to_m, survey, scene)
            return f"a pedestrian who walks from {here} to {there}"
        who = "worker" if kind is ScenarioType.CONSTRUCTION_ZONE else "pedestrian"
        return f"a {who} who stands {here}"
    what = {AgentType.BUS: "bus"}.get(agent.type, "vehicle")
    how = "crashed" if kind is ScenarioType.ACCIDENT_SITE else "parked"
    return f"a {how} {what} {here}, {_turn(agent, survey)}"


def _where(point: Point, survey: _Survey | None, scene: Scene) -> str:
    """A place along the lanes; on a map without a lane for the ego, straight ahead of it."""
    if survey is None:
        side = f" and {abs(point[1]):.1f} m to its {_side(point[1])}"
        beside = side if abs(point[1]) >= _BESIDE_M else ""
        return f"{_ahead(point[0])} the ego{beside}"
    place = survey.at(point)
    where = f"{_ahead(place.ahead_m)} the ego along its lane"
    if place.lane is None:
        away = f"{abs(place.left_m):.1f} m to the {_side(place.left_m)} of its centre"
        return f"{where} and {away}, beside the lanes"
    lane = _LANES[place.lane]
    if abs(place.left_m) < _BESIDE_M:
        return f"{where}, {lane}"
    return f"{where}, {lane}, {abs(place.left_m):.1f} m {_side(place.left_m)} of its centre"


def _ahead(metres: float) -> str:
    return f"{abs(metres):.1f} m {'ahead of' if metres >= 0.0 else 'behind'}"


def _side(left_m: float) -> str:
    return "left" if left_m > 0.0 else "right"


def _turn(agent: TrafficAgent, survey: _Survey | None) -> str:
    if survey is None:
        base_rad, base = 0.0, "the ego's direction"
    else:
        base_rad, base = survey.of(agent).tangent_rad, "the lane's direction"
    degrees = math.degrees(difference(agent.heading_rad, base_rad))
    if abs(degrees) < _STRAIGHT_DEG:
        return f"in {base}"
    return f"turned {abs(degrees):.0f} degrees to the {_side(degrees)} of {base}"
