"""A change that somebody drew as an intent and as a sentence, so that no words need be found.

Both count as instructions do, along the lanes of the ego's way and across them.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from augment.checks.bodies import end_of_walk
from augment.checks.derived_motions import find_wish
from augment.checks.ground import Ground
from augment.checks.lanes_across import (
    LanePlace,
    LanesAcross,
    find_picked,
    find_place,
    find_place_along,
)
from augment.checks.places import SHORT_M
from augment.geometry.frames import difference
from augment.scene import intent as wish
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import (
    AgentType,
    LaneConnector,
    Modification,
    ScenarioType,
    Scene,
    TrafficAgent,
    TurnType,
    apply,
)
from augment.scene.intent_statements import list_motion_facts
from augment.scene.planned_motion import MotionPreset
from augment.scene.schema import MOST_OBJECTS

# Smaller turns are not said.
_STRAIGHT_DEG = 5.0
# Nearer to the middle of a lane nothing is beside it; who is moved by less stays.
_BESIDE_M = 0.1
# Off the ego's way by more, something is nudged around; else it is overtaken.
_ASIDE_M = 0.5
_ON_ROAD_M = 1.0
_ACROSS_SHARE = 0.25
"""Who goes less than this across a lane goes along it."""
_LEADS = {
    ScenarioType.CONSTRUCTION_ZONE: "Put up a construction zone",
    ScenarioType.ACCIDENT_SITE: "Show the site of an accident",
    ScenarioType.JAYWALKER: "Let somebody cross the road outside a crosswalk",
    ScenarioType.NUDGE: "Have the ego nudge around what stands at the side of its lane",
    ScenarioType.OVERTAKE: "Have the ego overtake what stands in its lane",
}
_MOVERS = tuple(kind for kind in AgentType if kind.name in wish.Body.__members__)
_Wishes = Mapping[str, tuple[wish.MotionWish, TrafficAgent]]
_FRONTLESS = (AgentType.BARRIER, AgentType.CONSTRUCTION_SIGN)
_HEADLESS = (AgentType.TRAFFIC_CONE, AgentType.PEDESTRIAN)
"""Of which no sentence says where they look."""
_LANES = {
    wish.LaneChoice.OWN: "{}",
    wish.LaneChoice.LEFT: "the next lane to the left of {}",
    wish.LaneChoice.RIGHT: "the next lane to the right of {}",
    wish.LaneChoice.ONCOMING: "the oncoming lane beside {}",
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
        The intent is None where the ego is on no lane, where somebody who is changed has no name,
        or where nothing or too much can be said as requests.
    """
    ground = Ground.of(scene)
    lanes = LanesAcross.of(ground, scene.options.goal or TurnType.STRAIGHT)
    touched = {*change.removed, *(agent.id for agent in change.moved)}
    changed = [agent for agent in scene.agents if agent.id in touched]
    picks = {agent.id: pick for agent in changed if lanes and (pick := _find_pick(agent, lanes))}
    wishes = _wishes(change, scene)
    sentence = _sentence(kind, change, lanes, scene, picks, wishes)
    if lanes is None or len(picks) < len(touched):
        return sentence, None
    requests = tuple(_requests(change, lanes, wishes))
    moves = tuple(_moves(change, lanes, picks, wishes))
    removals = tuple(picks[name] for name in change.removed)
    counts = [len(part) for part in (requests, moves, removals)]
    if not any(counts) or max(counts) > wish.MOST_REQUESTS:
        return sentence, None
    unsaid = [
        agent.id
        for agent in change.changed
        if (agent.motion and agent.id not in wishes)
        or (agent.walk_to_m and (agent in change.moved or not _crosses(agent, lanes)))
    ]
    return sentence, wish.Intent(
        requests=requests,
        moves=moves,
        removals=removals,
        route=lanes.route.turn,
        beyond=tuple(f"the motion of {name}" for name in unsaid),
    )


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


def _find_place(agent: TrafficAgent, lanes: LanesAcross) -> LanePlace:
    return find_place(lanes, (agent.x_m, agent.y_m), agent.heading_rad)


def _find_ends(agent: TrafficAgent, lanes: LanesAcross) -> tuple[LanePlace, LanePlace]:
    """Return where a walk begins and ends along the lane in its middle."""
    here = (agent.x_m, agent.y_m)
    end = end_of_walk(agent) or here
    # Both ends by one lane: each by its own would have them on different ways. Who starts late
    # does so in the ego's way.
    middle = (here[0] + end[0]) / 2.0, (here[1] + end[1]) / 2.0
    via = None if agent.motion else find_place(lanes, middle).via
    return find_place_along(lanes, via, here), find_place_along(lanes, via, end)


def _crosses(agent: TrafficAgent, lanes: LanesAcross) -> bool:
    """Return whether somebody crosses a lane, or waits to; a worker's step does not."""
    if agent.type is not AgentType.PEDESTRIAN or agent.motion is not None:
        return agent.type is AgentType.PEDESTRIAN
    first, last = _find_ends(agent, lanes)
    walk_m = math.dist(agent.pose.beside(0.0), end_of_walk(agent) or (math.nan, math.nan))
    # From one side of the lane's middle to the other, or begun in it.
    is_over = first.left_m * last.left_m < 0.0 or abs(first.left_m) < _ON_ROAD_M
    return (
        walk_m > SHORT_M and is_over and abs(first.left_m - last.left_m) > _ACROSS_SHARE * walk_m
    )


# The intent


def _wishes(change: Modification, scene: Scene) -> _Wishes:
    cars = [agent for agent in apply(scene, change).agents if agent.is_stopped]
    found = ((agent.id, find_wish(agent, scene, cars)) for agent in change.changed)
    return {name: asked for name, asked in found if asked is not None}


def _requests(change: Modification, lanes: LanesAcross, wishes: _Wishes) -> Iterator[wish.Request]:
    # In order along the ego's way, as a sentence would go through them.
    added = sorted(change.added, key=lambda agent: lanes.route.locate_agent(agent).ahead_m)
    doors = [
        wishes[agent.id] for agent in added if agent.id in wishes and agent.type not in _MOVERS
    ]
    # A door's car needs a name where it is added too; else it is picked from the scene.
    anchors = {car.id for _, car in doors} & {agent.id for agent in added}
    for agent in added:
        motion = _find_motion(agent, wishes)
        if _crosses(agent, lanes):
            yield _walk(agent, lanes, motion)
        elif agent.type in _MOVERS:
            request = _vehicle(agent, lanes, motion)
            yield replace(request, name=agent.id) if agent.id in anchors else request
    for motion, car in doors:
        spot = wish.Spot(anchor=car.id)
        if car.id not in anchors:
            spot = wish.Spot(landmark=_find_pick(car, lanes))
        if spot != wish.Spot():
            yield wish.DoorRequest(spot=spot, motion=motion)


def _moves(
    change: Modification, lanes: LanesAcross, picks: Mapping[str, wish.Pick], wishes: _Wishes
) -> Iterator[wish.Move]:
    before = {agent.id: agent for agent in lanes.route.scene.agents}
    for agent in change.moved:
        who = picks[agent.id]
        motion = _find_motion(agent, wishes)
        if motion is not None and _stays(agent, before[agent.id]):
            yield wish.Move(who=who, motion=motion)
        else:
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
        AgentType.VEHICLE: wish.Sight.PARKED if agent.is_stopped else wish.Sight.MOVING,
        AgentType.BUS: wish.Sight.BUS,
        AgentType.BICYCLE: wish.Sight.BICYCLE,
        AgentType.PEDESTRIAN: wish.Sight.PEDESTRIAN,
    }.get(agent.type)
    for relation in wish.Relation if kind else ():
        assert kind is not None
        alike = find_picked(lanes, wish.Pick(kind=kind, relation=relation, every=True))
        # Ordinals are counted from the ego, up to as many as a document may say.
        if agent in alike[:MOST_OBJECTS]:
            return wish.Pick(kind=kind, relation=relation, ordinal=alike.index(agent) + 1)
    return None


def _lateral(place: LanePlace) -> wish.Lateral:
    sides = wish.LateralTarget
    if abs(place.left_m) < _BESIDE_M:
        return wish.Lateral(target=sides.LANE_CENTRE)
    return wish.Lateral(
        target=sides.LEFT_BOUNDARY if place.left_m > 0.0 else sides.RIGHT_BOUNDARY,
        nearness=wish.Nearness.OUTSIDE if place.off_m > 0.0 else None,
        offset=_length(abs(place.left_m)),
    )


def _spot(place: LanePlace) -> wish.Spot:
    return wish.Spot(
        distance=_length(abs(place.ahead_m)),
        relation=wish.Relation.AHEAD if place.ahead_m >= 0.0 else wish.Relation.BEHIND,
        via=place.via,
        lane=place.lane,
        lateral=_lateral(place) if abs(place.left_m) >= _BESIDE_M else None,
    )


def _length(metres: float) -> wish.Length:
    # To a decimetre: sentences say no more.
    return wish.Length(low_m=round(metres, 1), high_m=round(metres, 1))


def _vehicle(
    agent: TrafficAgent, lanes: LanesAcross, motion: wish.MotionWish | None = None
) -> wish.VehicleRequest:
    place = _find_place(agent, lanes)
    body = wish.Body.of(agent.type)
    if motion is not None and motion.preset is MotionPreset.RED_LIGHT:
        from_left = lanes.route.locate_agent(agent).left_m > 0.0
        comes = replace(motion, side=wish.Side.LEFT if from_left else wish.Side.RIGHT)
        return wish.VehicleRequest(body=body, speed_mps=agent.speed_mps, count=1, motion=comes)
    facing, turn_deg = (None, 0.0) if agent.type in _HEADLESS else _facing(agent, place)
    return wish.VehicleRequest(
        spot=_spot(place),
        body=body,
        facing=facing,
        turn_deg=turn_deg,
        speed_mps=agent.speed_mps,
        count=1,
        motion=motion,
    )


def _facing(agent: TrafficAgent, place: LanePlace) -> tuple[wish.Facing, float]:
    """Return the facing against the lane, and the remaining angle in degrees."""
    turn_deg = math.degrees(difference(agent.heading_rad, place.tangent_rad))
    is_turned = abs(turn_deg) > 90.0
    # What is left against the nearer of the lane's two directions, from -180 up to 180.
    off_deg = round((turn_deg - 180.0 * is_turned + 180.0) % 360.0 - 180.0)
    is_against = is_turned and agent.type not in _FRONTLESS
    facing = wish.Facing.AGAINST_LANE if is_against else wish.Facing.WITH_LANE
    return facing, float(off_deg) if abs(off_deg) >= _STRAIGHT_DEG else 0.0


def _walk(
    agent: TrafficAgent, lanes: LanesAcross, motion: wish.MotionWish | None
) -> wish.WalkRequest:
    start, end = _find_ends(agent, lanes)
    return wish.WalkRequest(
        spot=replace(_spot(start), lane=None, lateral=_lateral(start)),
        start=wish.Side.LEFT if start.left_m > end.left_m else wish.Side.RIGHT,
        count=1,
        speed_mps=agent.speed_mps or None,
        drift_m=round(end.ahead_m - start.ahead_m, 1),
        on_road=abs(start.left_m) < _ON_ROAD_M,
        end=_lateral(end),
        motion=motion,
    )


# The sentence


def _sentence(
    kind: ScenarioType | None,
    change: Modification,
    lanes: LanesAcross | None,
    scene: Scene,
    picks: Mapping[str, wish.Pick],
    wishes: _Wishes,
) -> str:
    """The sentences from which a reader could put the same objects to the same places."""
    added = sorted(change.added, key=lambda agent: (agent.x_m, agent.y_m))
    cones = [agent for agent in added if agent.type is AgentType.TRAFFIC_CONE]
    spots = ", ".join(_where(cone, lanes) for cone in cones)
    what = "a traffic cone " if len(cones) == 1 else f"{len(cones)} traffic cones: "
    parts = [what + spots] if cones else []
    others = [agent for agent in added if agent.type is not AgentType.TRAFFIC_CONE]
    parts += [_thing(other, kind, lanes) + _then(other, wishes) for other in others]
    before = {agent.id: agent for agent in scene.agents}
    for agent in change.moved:
        where = f"move {_who(agent.id, picks)} to {_where(agent, lanes)}"
        where += _course(agent, before[agent.id].speed_mps, lanes)
        if agent.id in wishes and _stays(agent, before[agent.id]):
            where = f"keep {_who(agent.id, picks)} where it is"
        parts.append(where + _then(agent, wishes))
    parts += [f"remove {_who(name, picks)}" for name in change.removed]
    goal = scene.options.goal
    turn = "go straight on" if goal is TurnType.STRAIGHT else f"turn {goal}"
    way = f" The ego is to {turn}." if goal else ""
    lead = "Change the scene" if kind is None else _LEADS[kind]
    if kind is ScenarioType.JAYWALKER and not any(
        agent.id in wishes or (agent.walk_to_m if lanes is None else _crosses(agent, lanes))
        for agent in others
        if agent.type is AgentType.PEDESTRIAN
    ):
        lead = "Change the scene"  # nobody crosses
    return f"{lead}: {'; '.join(parts)}.{way}"


def _then(agent: TrafficAgent, wishes: _Wishes) -> str:
    motion = _find_motion(agent, wishes)
    return f", {', '.join(list_motion_facts(motion))}" if motion else ""


def _who(name: str, picks: Mapping[str, wish.Pick]) -> str:
    pick = picks.get(name)
    if pick is None:
        return name
    place = f"{pick.relation.words} the ego"
    if pick.ordinal == 1:
        return f"the nearest {pick.kind} {place}"
    return f"{pick.kind} number {pick.ordinal} {place}"


def _thing(agent: TrafficAgent, kind: ScenarioType | None, lanes: LanesAcross | None) -> str:
    here = _where(agent, lanes)
    if agent.type is AgentType.PEDESTRIAN:
        if agent.walk_to_m or agent.motion:
            walk = _find_ends(agent, lanes) if lanes else ()
            ends = [_name_place(end, middle="in the middle of") for end in walk]
            ends = ends or [here, _where(_at_end(agent), lanes)]
            return f"a pedestrian who walks from {ends[0]} to {ends[1]}"
        who = "worker" if kind is ScenarioType.CONSTRUCTION_ZONE else "pedestrian"
        return f"a {who} who stands {here}"
    what = agent.type.lower().replace("_", " ")
    if agent.type in (AgentType.VEHICLE, AgentType.BUS) and agent.is_stopped:
        what = f"{'crashed' if kind is ScenarioType.ACCIDENT_SITE else 'parked'} {what}"
    standing_mps = agent.speed_mps if agent.is_stopped else 0.0
    return f"a {what} {here}{_course(agent, standing_mps, lanes)}"


def _course(agent: TrafficAgent, before_mps: float, lanes: LanesAcross | None) -> str:
    """How somebody is turned, its speed where it is another than before, and its walk."""
    base_rad = 0.0 if lanes is None else _find_place(agent, lanes).tangent_rad
    base = "the ego's direction" if lanes is None else "the lane's direction"
    degrees = math.degrees(difference(agent.heading_rad, base_rad))
    turn = f", turned {abs(degrees):.0f} degrees to the {_side(degrees)} of {base}"
    if abs(degrees) < _STRAIGHT_DEG:
        turn = f", in {base}"
    walk = f", walking to {_where(_at_end(agent), lanes)}" if agent.walk_to_m else ""
    verb = "walking" if agent.type is AgentType.PEDESTRIAN else "driving"
    pace = ", standing" if agent.is_stopped else f", {verb} at {agent.speed_mps:.1f} m/s"
    turn = "" if agent.type in _HEADLESS else turn
    return turn + (pace if agent.speed_mps != before_mps else "") + walk


def _at_end(agent: TrafficAgent) -> TrafficAgent:
    x_m, y_m = end_of_walk(agent) or (agent.x_m, agent.y_m)
    return replace(agent, x_m=x_m, y_m=y_m)


def _where(agent: TrafficAgent, lanes: LanesAcross | None) -> str:
    """A place along the lanes; on a map without a lane for the ego, straight ahead of it."""
    if lanes is None:
        side = f" and {abs(agent.y_m):.1f} m to its {_side(agent.y_m)}"
        aside = side if abs(agent.y_m) >= _BESIDE_M else ""
        return f"{_ahead(agent.x_m)} the ego{aside}"
    return _name_place(_find_place(agent, lanes))


def _name_place(place: LanePlace, *, middle: str = "in") -> str:
    way = "its lane" if place.via is None else _name_way(place.route, place.via)
    lane = _LANES[place.lane].format(place.via or "the ego's lane")
    where = f"{_ahead(place.ahead_m)} the ego along {way}"
    if place.route.lane_id == place.via:
        # That way may lead back past the ego: what lies before the point may be ahead.
        back = "along" if place.ahead_m >= 0.0 else "back along"
        where = f"{abs(place.ahead_m):.1f} m {back} {place.via} from its point nearest to the ego"
    if abs(place.left_m) < _BESIDE_M:
        return f"{where}, {middle} {lane}"
    where = f"{where}, {'beside' if place.off_m else 'in'} {lane}"
    # Who comes towards the ego has its left where the ego has its right.
    seen = ", seen as the ego drives" if place.lane is wish.LaneChoice.ONCOMING else ""
    return f"{where}, {abs(place.left_m):.1f} m {_side(place.left_m)} of its centre{seen}"


def _name_way(route: EgoRoute, via: str) -> str:
    names = route.lane_ids
    way = map(route.graph.lane, names[names.index(route.lane_id) : names.index(via) + 1])
    turns = [str(lane.turn_type) for lane in way if isinstance(lane, LaneConnector)]
    turns = [turn for turn in turns if turn != TurnType.STRAIGHT]
    return f"the way to {via}" + (f", which turns {', then '.join(turns)}" if turns else "")


def _ahead(metres: float) -> str:
    return f"{abs(metres):.1f} m {'ahead of' if metres >= 0.0 else 'behind'}"


def _side(left_m: float) -> str:
    return "left" if left_m > 0.0 else "right"
