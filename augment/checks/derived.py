"""A change that somebody drew as an intent and as a sentence, so that no words need be found.

Both count as instructions do, along the lanes of the ego's way and across them.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from augment.checks.bodies import end_of_walk
from augment.checks.derived_motions import find_wish
from augment.checks.ground import Ground, is_stopped
from augment.checks.lanes_across import Band, LanesAcross, find_picked
from augment.checks.registry import check_against_intent
from augment.geometry.frames import difference
from augment.scene import intent as wish
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import (
    AgentType,
    Modification,
    Point,
    ScenarioType,
    Scene,
    TrafficAgent,
    TurnType,
    apply,
)
from augment.scene.intent_statements import list_motion_facts
from augment.scene.planned_motion import MotionPreset
from augment.scene.schema import MOST_OBJECTS

_STRAIGHT_DEG = 5.0
_BESIDE_M = 0.1
_ASIDE_M = 0.5
_ON_ROAD_M = 1.0
_ROW_M, _TAPER_M = 1.0, 1.0
_LEADS = {
    ScenarioType.CONSTRUCTION_ZONE: "Put up a construction zone",
    ScenarioType.ACCIDENT_SITE: "Show the site of an accident",
    ScenarioType.JAYWALKER: "Let somebody cross the road outside a crosswalk",
    ScenarioType.NUDGE: "Have the ego nudge around what stands at the side of its lane",
    ScenarioType.OVERTAKE: "Have the ego overtake what stands in its lane",
}
_BODIES = {
    AgentType.VEHICLE: wish.Body.VEHICLE,
    AgentType.BUS: wish.Body.BUS,
    AgentType.BICYCLE: wish.Body.BICYCLE,
    AgentType.BARRIER: wish.Body.BARRIER,
    AgentType.CONSTRUCTION_SIGN: wish.Body.CONSTRUCTION_SIGN,
}
_MOVERS = (*_BODIES, AgentType.PEDESTRIAN)
_Wishes = Mapping[str, tuple[wish.MotionWish, TrafficAgent]]
_FRONTLESS = (AgentType.BARRIER, AgentType.CONSTRUCTION_SIGN)
_LANES = {
    wish.LaneChoice.OWN: "in the ego's lane",
    wish.LaneChoice.LEFT: "in the next lane to the left",
    wish.LaneChoice.RIGHT: "in the next lane to the right",
    wish.LaneChoice.ONCOMING: "in the oncoming lane",
}


def describe_change(
    kind: ScenarioType | None, change: Modification, scene: Scene
) -> tuple[str, wish.Intent | None]:
    """Return the sentence that asks for a change, and the same as an intent.

    Args:
        kind: The type of the scenario, None for one of one's own.
        change: What people placed, moved and removed; not empty.
        scene: Before the change, with the scenario's goal.

    Returns:
        The intent is None where the ego is on no lane, or where nothing or too much can be said
        as requests; else without offsets and lanes where the change meets it better so.
    """
    ground = Ground.of(scene)
    lanes = LanesAcross.of(ground, scene.options.goal or TurnType.STRAIGHT)
    touched = {*change.removed, *(agent.id for agent in change.moved)}
    picks = {
        agent.id: None if lanes is None else _find_pick(agent, lanes)
        for agent in scene.agents
        if agent.id in touched
    }
    wishes = _wishes(change, scene)
    sentence = _sentence(kind, change, lanes, scene, picks, wishes)
    if lanes is None:
        return sentence, None
    requests = tuple(_requests(change, lanes, wishes))
    moves = tuple(_moves(change, lanes, picks, wishes))
    removals = tuple(pick for name in change.removed if (pick := picks[name]))
    counts = [len(part) for part in (requests, moves, removals)]
    if not any(counts) or max(counts) > wish.MOST_REQUESTS:
        return sentence, None
    unnamed = [one.id for one in change.changed if one.motion and one.id not in wishes]
    full = wish.Intent(
        requests=requests,
        moves=moves,
        removals=removals,
        route=lanes.route.turn,
        beyond=tuple(f"the motion of {name}" for name in unnamed),
    )
    looser = replace(
        full,
        requests=tuple(map(_looser, requests)),
        moves=tuple(replace(one, spot=_looser_spot(one.spot)) for one in moves),
    )
    faults = [
        sum(one.is_fault for one in check_against_intent(ground, change, intent))
        for intent in (full, looser)
    ]
    return sentence, full if faults[0] <= faults[1] else looser


def classify_change(change: Modification, scene: Scene) -> ScenarioType | MotionPreset:
    """Return the planned motion's preset, else the most similar of the five types."""
    for motion, _ in _wishes(change, scene).values():
        return motion.preset
    kinds = {agent.type for agent in change.added}
    if kinds & {AgentType.TRAFFIC_CONE, *_FRONTLESS}:
        return ScenarioType.CONSTRUCTION_ZONE
    if AgentType.PEDESTRIAN in kinds:
        return ScenarioType.JAYWALKER
    if len(change.added) > 1:
        return ScenarioType.ACCIDENT_SITE
    route = EgoRoute.of(scene)
    is_aside = any(
        route and abs(route.locate_agent(agent).left_m) > _ASIDE_M for agent in change.changed
    )
    return ScenarioType.NUDGE if is_aside else ScenarioType.OVERTAKE


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


def _find_place(agent: TrafficAgent, lanes: LanesAcross) -> _Place:
    return _place_at((agent.x_m, agent.y_m), lanes)


# The intent


def _wishes(change: Modification, scene: Scene) -> _Wishes:
    cars = [one for one in apply(scene, change).agents if is_stopped(one)]
    found = {agent.id: find_wish(agent, scene, cars) for agent in change.changed}
    return {name: one for name, one in found.items() if one is not None}


def _requests(change: Modification, lanes: LanesAcross, wishes: _Wishes) -> Iterator[wish.Request]:
    added = sorted(change.added, key=lambda one: lanes.route.locate_agent(one).ahead_m)
    cones = [agent for agent in added if agent.type is AgentType.TRAFFIC_CONE]
    people = [agent for agent in added if agent.type is AgentType.PEDESTRIAN]
    if cones:
        yield _cones(
            cones, any(one.walk_to_m is None and one.id not in wishes for one in people), lanes
        )
    doors = [wishes[one.id] for one in added if one.id in wishes and one.type not in _MOVERS]
    anchors = {car.id for _, car in doors} & {agent.id for agent in added}
    for agent in added:
        if agent.type in _BODIES:
            request = _vehicle(agent, lanes, _find_motion(agent, wishes))
            yield replace(request, name=agent.id) if agent.id in anchors else request
    for agent in people:
        motion = _find_motion(agent, wishes)
        if agent.walk_to_m is not None or motion is not None:
            yield replace(_walk(agent, lanes), motion=motion)
    for motion, car in doors:
        spot = wish.Spot(anchor=car.id)
        if car.id not in anchors:
            spot = wish.Spot(landmark=_find_pick(car, lanes))
        if spot != wish.Spot():
            yield wish.DoorRequest(spot=spot, motion=motion)


def _moves(
    change: Modification,
    lanes: LanesAcross,
    picks: Mapping[str, wish.Pick | None],
    wishes: _Wishes,
) -> Iterator[wish.Move]:
    before = {agent.id: agent for agent in lanes.route.scene.agents}
    for agent in change.moved:
        who = picks[agent.id]
        motion = _find_motion(agent, wishes)
        if who is not None and motion is not None and _stays(agent, before[agent.id]):
            yield wish.Move(who=who, motion=motion)
        elif who is not None:
            there = _vehicle(agent, lanes)
            yield wish.Move(
                who=who,
                spot=there.spot,
                facing=there.facing,
                turn_deg=there.turn_deg,
                speed_mps=agent.speed_mps,
                motion=motion,
            )


def _find_motion(agent: TrafficAgent, wishes: _Wishes) -> wish.MotionWish | None:
    return wishes[agent.id][0] if agent.id in wishes else None


def _stays(agent: TrafficAgent, before: TrafficAgent) -> bool:
    """Return whether only its motion changes; one that starts late stands until then."""
    is_as_fast = agent.type is AgentType.PEDESTRIAN or agent.speed_mps == before.speed_mps
    return is_as_fast and math.dist(agent.pose.beside(0.0), before.pose.beside(0.0)) < _BESIDE_M


def _find_pick(agent: TrafficAgent, lanes: LanesAcross) -> wish.Pick | None:
    """Return the sentence's name of a road user of the scene; None if it has none."""
    kind = {
        AgentType.VEHICLE: wish.Sight.PARKED if is_stopped(agent) else wish.Sight.MOVING,
        AgentType.BUS: wish.Sight.BUS,
        AgentType.BICYCLE: wish.Sight.BICYCLE,
        AgentType.PEDESTRIAN: wish.Sight.PEDESTRIAN,
    }.get(agent.type)
    for relation in wish.Relation if kind else ():
        assert kind is not None
        alike = find_picked(lanes, wish.Pick(kind=kind, relation=relation, every=True))
        if agent in alike[:MOST_OBJECTS]:
            return wish.Pick(kind=kind, relation=relation, ordinal=alike.index(agent) + 1)
    return None


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


def _vehicle(
    agent: TrafficAgent, lanes: LanesAcross, motion: wish.MotionWish | None = None
) -> wish.VehicleRequest:
    place, body = _find_place(agent, lanes), _BODIES.get(agent.type, wish.Body.VEHICLE)
    if motion is not None and motion.preset is MotionPreset.RED_LIGHT:
        from_left = lanes.route.locate_agent(agent).left_m > 0.0
        comes = replace(motion, side=wish.Side.LEFT if from_left else wish.Side.RIGHT)
        return wish.VehicleRequest(body=body, speed_mps=agent.speed_mps, count=1, motion=comes)
    facing, turn_deg = (None, 0.0) if agent.type in _FRONTLESS else _facing(agent, place)
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
        body=body,
        facing=facing,
        turn_deg=turn_deg,
        speed_mps=agent.speed_mps,
        count=1,
        motion=motion,
    )


def _facing(agent: TrafficAgent, place: _Place) -> tuple[wish.Facing, float]:
    """Return the facing against the lane, and the remaining angle in degrees."""
    turn_deg = math.degrees(difference(agent.heading_rad, place.tangent_rad))
    is_against = abs(turn_deg) > 90.0
    off_deg = round((turn_deg - 180.0 * is_against + 180.0) % 360.0 - 180.0)
    facing = wish.Facing.AGAINST_LANE if is_against else wish.Facing.WITH_LANE
    return facing, float(off_deg) if abs(off_deg) >= _STRAIGHT_DEG else 0.0


def _walk(agent: TrafficAgent, lanes: LanesAcross) -> wish.WalkRequest:
    start = lanes.route.locate(agent.x_m, agent.y_m)
    end = lanes.route.locate(*(end_of_walk(agent) or (0.0, 0.0)))
    return wish.WalkRequest(
        spot=replace(_spot(_find_place(agent, lanes)), lane=None),
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
    first = _find_place(cones[0], lanes)
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
    spot = _looser_spot(request.spot)
    match request:
        case wish.WalkRequest():
            return replace(request, drift_m=None, on_road=False)
        case wish.ConesRequest():
            return replace(request, spot=spot, spacing=None, start=None)
        case _:
            return replace(request, spot=spot)


def _looser_spot(spot: wish.Spot) -> wish.Spot:
    return replace(spot, lateral=None, lane=None)


# The sentence


def _sentence(
    kind: ScenarioType | None,
    change: Modification,
    lanes: LanesAcross | None,
    scene: Scene,
    picks: Mapping[str, wish.Pick | None],
    wishes: _Wishes,
) -> str:
    """The sentences from which a reader could put the same objects to the same places."""
    added = sorted(change.added, key=lambda one: (one.x_m, one.y_m))
    cones = [agent for agent in added if agent.type is AgentType.TRAFFIC_CONE]
    spots = ", ".join(_where((one.x_m, one.y_m), lanes) for one in cones)
    parts = [f"{len(cones)} traffic cones: {spots}"] if len(cones) > 1 else []
    if len(cones) == 1:
        parts = [f"a traffic cone {spots}"]
    others = [agent for agent in added if agent.type is not AgentType.TRAFFIC_CONE]
    parts += [_thing(other, kind, lanes) + _then(other, wishes) for other in others]
    before = {agent.id: agent for agent in scene.agents}
    for agent in change.moved:
        where = f"move {_who(agent.id, picks)} to {_where((agent.x_m, agent.y_m), lanes)}"
        if agent.id in wishes and _stays(agent, before[agent.id]):
            where = f"keep {_who(agent.id, picks)} where it is"
        parts.append(where + _then(agent, wishes))
    parts += [f"remove {_who(name, picks)}" for name in change.removed]
    goal = scene.options.goal
    way = "" if goal is None else f" The ego is to turn {goal}."
    if goal is TurnType.STRAIGHT:
        way = " The ego is to go straight on."
    lead = "Change the scene" if kind is None else _LEADS[kind]
    if kind is ScenarioType.JAYWALKER and not any(
        one.walk_to_m or one.id in wishes for one in others if one.type is AgentType.PEDESTRIAN
    ):
        lead = "Change the scene"  # nobody crosses
    return f"{lead}: {'; '.join(parts)}.{way}"


def _then(agent: TrafficAgent, wishes: _Wishes) -> str:
    motion = _find_motion(agent, wishes)
    return f", {', '.join(list_motion_facts(motion))}" if motion else ""


def _who(name: str, picks: Mapping[str, wish.Pick | None]) -> str:
    pick = picks[name]
    if pick is None:
        return name
    place = f"{pick.relation.words} the ego"
    if pick.ordinal == 1:
        return f"the nearest {pick.kind} {place}"
    return f"{pick.kind} number {pick.ordinal} {place}"


def _thing(agent: TrafficAgent, kind: ScenarioType | None, lanes: LanesAcross | None) -> str:
    here = _where((agent.x_m, agent.y_m), lanes)
    if agent.type is AgentType.PEDESTRIAN:
        if agent.walk_to_m is not None:
            return f"a pedestrian who walks from {here} to {_where(agent.walk_to_m, lanes)}"
        who = "worker" if kind is ScenarioType.CONSTRUCTION_ZONE else "pedestrian"
        return f"a {who} who stands {here}"
    what, drives = agent.type.lower().replace("_", " "), not is_stopped(agent)
    if agent.type in (AgentType.VEHICLE, AgentType.BUS) and not drives:
        what = f"{'crashed' if kind is ScenarioType.ACCIDENT_SITE else 'parked'} {what}"
    pace = f", driving at {agent.speed_mps:.1f} m/s" if drives else ""
    base_rad = 0.0 if lanes is None else _find_place(agent, lanes).tangent_rad
    base = "the ego's direction" if lanes is None else "the lane's direction"
    degrees = math.degrees(difference(agent.heading_rad, base_rad))
    turn = f"turned {abs(degrees):.0f} degrees to the {_side(degrees)} of {base}"
    if abs(degrees) < _STRAIGHT_DEG:
        turn = f"in {base}"
    return f"a {what} {here}, {turn}{pace}"


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
