"""Where changed agents are: seen from the ego, along the lanes, and on which lane."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.ground import Beside
from augment.checks.situation import VEHICLES, ChangedScene, is_stopped
from augment.geometry.frames import difference
from augment.scene.entities import AgentType, TrafficAgent


def ego_offset(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed agent, centre to centre, along and across the ego's heading."""
    ego = situation.ground.scene.ego.pose
    for agent in situation.changed:
        seen = ego.pose_to_local(agent.pose)
        along = "ahead of" if seen.x_m >= 0.0 else "behind"
        side = "left" if seen.y_m >= 0.0 else "right"
        yield Finding(
            kind=FindingKind.EGO_OFFSET,
            severity=Severity.FACT,
            agents=(agent.id,),
            measured={
                "straight_m": math.hypot(seen.x_m, seen.y_m),
                "ahead_m": seen.x_m,
                "left_m": seen.y_m,
            },
            template=(
                "{agents[0]} is {straight_m:.1f} m from the ego in a straight line: "
                f"{{ahead_m:.1f}} m {along} it and {{left_m:.1f}} m to its {side}."
            ),
        )


def lane(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed agent: the lane under it, or how far it is off the nearest."""
    for agent in situation.changed:
        under = situation.under(agent)
        nearest = situation.nearest(agent)
        if under is not None:
            yield _on_lane(agent.id, under)
        elif nearest is not None:
            yield _off_lane(agent.id, nearest)


def _on_lane(agent_id: str, place: Beside) -> Finding:
    if abs(place.d_m) < 0.005:
        words = (
            "{agents[0]} is on {lanes[0]}, {along_m:.1f} m along it and on its centre line; the "
            "lane is {lane_width_m:.1f} m wide."
        )
    else:
        side = "left" if place.d_m >= 0.0 else "right"
        words = (
            "{agents[0]} is on {lanes[0]}, {along_m:.1f} m along it and {left_m:.2f} m to the "
            f"{side} of its centre line; the lane is {{lane_width_m:.1f}} m wide."
        )
    return _lane_fact(agent_id, place, 0.0, words)


def _off_lane(agent_id: str, place: Beside) -> Finding:
    return _lane_fact(
        agent_id,
        place,
        place.off_m,
        (
            "{agents[0]} is {off_m:.1f} m off every lane; the nearest lane is {lanes[0]} at "
            "{along_m:.1f} m along it."
        ),
    )


def _lane_fact(agent_id: str, place: Beside, off_m: float, template: str) -> Finding:
    return Finding(
        kind=FindingKind.LANE,
        severity=Severity.FACT,
        agents=(agent_id,),
        lanes=(place.lane_id,),
        measured={
            "along_m": place.s_m,
            "left_m": place.d_m,
            "lane_width_m": place.width_m,
            "off_m": off_m,
        },
        template=template,
    )


FAR_M = 15.0
"""Further than this beside the ego's lanes a distance along them says nothing."""


def lane_distance(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed agent on a map that has a lane for the ego.

    `along_lanes_m` is None where no chain of successors leads from the ego to the agent's lane
    or back (then it would be negative); `level_m` and `beside_m` then tell where the agent is
    beside the lanes that can be reached, on the oncoming lane for example.
    """
    if situation.ground.route is None:
        return
    for agent in situation.changed:
        yield _distance_finding(agent, situation)


def _distance_finding(agent: TrafficAgent, situation: ChangedScene) -> Finding:
    reached = _reached(agent, situation)
    if reached is None:
        return Finding(
            kind=FindingKind.LANE_DISTANCE,
            severity=Severity.FACT,
            agents=(agent.id,),
            measured={"along_lanes_m": None, "level_m": None, "beside_m": None},
            template="No lane leads from the ego to the place of {agents[0]}.",
        )
    place, along_m = reached
    side = "ahead of" if along_m >= 0.0 else "behind"
    if place.covers:
        words = f"{{agents[0]}} is {{along_lanes_m:.1f}} m {side} the ego along the lanes."
    else:
        hand = "left" if place.d_m >= 0.0 else "right"
        words = (
            "No lane leads from the ego to the place of {agents[0]}: it is level with a point "
            f"{{level_m:.1f}} m {side} the ego along the lanes, {{beside_m:.1f}} m to the {hand} "
            "of the centre of {lanes[0]}."
        )
    return Finding(
        kind=FindingKind.LANE_DISTANCE,
        severity=Severity.FACT,
        agents=(agent.id,),
        lanes=(place.lane_id,),
        measured={
            "along_lanes_m": along_m if place.covers else None,
            "level_m": along_m,
            "beside_m": place.d_m,
        },
        template=words,
    )


def _reached(agent: TrafficAgent, situation: ChangedScene) -> tuple[Beside, float] | None:
    """The nearest lane that the ego reaches or came from, and how far along it the agent is."""
    places = {place.lane_id: place for place in situation.beside[agent.id]}
    candidates = [
        (place, start_m + place.s_m)
        for lane_id, start_m in situation.ground.starts_m
        if (place := places.get(lane_id)) and (place.covers or place.distance_m <= FAR_M)
    ]
    return min(
        candidates,
        key=lambda one: (round(one[0].distance_m, 4), round(abs(one[1]), 4)),
        default=None,
    )


NAMED_WITHIN_M = 0.5
"""Beyond the lane's edge: whoever stands on the line may name either side."""


def lane_named(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful where an agent names a lane that it is not on, wrong where there is none such."""
    for agent in situation.changed:
        if agent.lane_id is not None:
            yield from _named_finding(agent, agent.lane_id, situation)


def _named_finding(agent: TrafficAgent, named: str, situation: ChangedScene) -> Iterator[Finding]:
    lane = situation.ground.graph.lanes.get(named)
    if lane is None:
        yield Finding(
            kind=FindingKind.LANE_NAMED,
            severity=Severity.WRONG,
            agents=(agent.id,),
            lanes=(named,),
            template="{agents[0]} names {lanes[0]} as its lane, which the map does not have.",
        )
        return
    near = [one.off_m for one in situation.beside[agent.id] if one.lane_id == named]
    far_m = lane.centerline.project(agent.x_m, agent.y_m).distance_m - lane.width_m / 2.0
    off_m = near[0] if near else far_m
    if off_m <= NAMED_WITHIN_M:
        return
    under = situation.under(agent)
    really = "on no lane" if under is None else "on {lanes[1]}"
    yield Finding(
        kind=FindingKind.LANE_NAMED,
        severity=Severity.DOUBTFUL,
        agents=(agent.id,),
        lanes=(named,) if under is None else (named, under.lane_id),
        measured={"off_named_lane_m": off_m},
        template=(
            "{agents[0]} names {lanes[0]} as its lane but is {off_named_lane_m:.1f} m off it, "
            f"{really}."
        ),
    )


ALONG_BELOW_DEG = 30.0
OPPOSITE_ABOVE_DEG = 150.0
ROADSIDE_M = 3.0
"""Up to here off a lane a vehicle is parked beside it; further out no lane gives a direction."""

_STEERED = frozenset({AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE})


def heading(situation: ChangedScene) -> Iterator[Finding]:
    """The turn of every changed vehicle and bicycle against its lane, left positive.

    A fact up to 30 degrees, within an accident, on a car park and for a bicycle that stands;
    doubtful above. Against the traffic it is wrong for a vehicle that moves.
    """
    for agent in situation.changed:
        place = situation.under(agent) or situation.nearest(agent)
        if agent.type in _STEERED and place is not None and place.off_m <= ROADSIDE_M:
            yield _heading_finding(agent, place, situation)


def _heading_finding(agent: TrafficAgent, place: Beside, situation: ChangedScene) -> Finding:
    turn_deg = math.degrees(difference(agent.heading_rad, place.tangent_rad))
    if abs(turn_deg) > OPPOSITE_ABOVE_DEG:
        words = "against the direction of {lanes[0]} (turned by {turn_deg:.0f} degrees)"
    elif abs(turn_deg) < 0.5:
        words = "along {lanes[0]}"
    else:
        side = "left" if turn_deg >= 0.0 else "right"
        words = f"{{turn_deg:.0f}} degrees to the {side} of the direction of {{lanes[0]}}"
    severity = _heading_severity(agent, abs(turn_deg), situation)
    there = ""
    if severity is not Severity.FACT:
        minus = "-" if place.tangent_rad < 0.0 else ""
        there = f", which is {minus}{{lane_heading_rad:.3f}} rad there"
    return Finding(
        kind=FindingKind.HEADING,
        severity=severity,
        agents=(agent.id,),
        lanes=(place.lane_id,),
        measured={"turn_deg": turn_deg, "lane_heading_rad": place.tangent_rad},
        template=f"{{agents[0]}} faces {words}{there}.",
    )


def _heading_severity(agent: TrafficAgent, turn_deg: float, situation: ChangedScene) -> Severity:
    if turn_deg <= ALONG_BELOW_DEG or agent.id in situation.crashed:
        return Severity.FACT
    if is_stopped(agent) and _may_stand_askew(agent, situation):
        return Severity.FACT
    against = turn_deg > OPPOSITE_ABOVE_DEG and agent.type is not AgentType.BICYCLE
    return Severity.WRONG if against and not is_stopped(agent) else Severity.DOUBTFUL


def _may_stand_askew(agent: TrafficAgent, situation: ChangedScene) -> bool:
    in_carpark = situation.ground.carparks.distance_m(agent.x_m, agent.y_m) == 0.0
    return agent.type is AgentType.BICYCLE or in_carpark


WALKS_ALONG_BELOW_DEG = 30.0
BACKWARDS_ABOVE_DEG = 90.0
SHORT_M = 1.5
"""A step of a worker who stands has no direction that anybody would have to face."""

NOWHERE_M = 0.001
"""Below a millimetre the direction of a walk is rounding."""


def walk_heading(situation: ChangedScene) -> Iterator[Finding]:
    """The turn of every changed agent with a walk against it: doubtful above 30 degrees.

    Above 90 degrees, walking backwards, it is wrong.
    """
    for agent in situation.changed:
        if agent.walk_to_m is not None:
            yield _walk_finding(agent, *agent.walk_to_m)


def _walk_finding(agent: TrafficAgent, to_x_m: float, to_y_m: float) -> Finding:
    dx, dy = to_x_m - agent.x_m, to_y_m - agent.y_m
    walk_m = math.hypot(dx, dy)
    if walk_m < NOWHERE_M:
        return Finding(
            kind=FindingKind.WALK_HEADING,
            severity=Severity.FACT,
            agents=(agent.id,),
            measured={"turn_deg": None, "walk_m": walk_m},
            template="{agents[0]} has a walk that ends where it starts.",
        )
    turn_deg = math.degrees(difference(agent.heading_rad, math.atan2(dy, dx)))
    severity = Severity.FACT
    if walk_m > SHORT_M and abs(turn_deg) > WALKS_ALONG_BELOW_DEG:
        backwards = abs(turn_deg) > BACKWARDS_ABOVE_DEG
        severity = Severity.WRONG if backwards else Severity.DOUBTFUL
    side = "left" if turn_deg >= 0.0 else "right"
    turned = f"{{turn_deg:.0f}} degrees to the {side} of it"
    words = "along it" if abs(turn_deg) < 0.5 else turned
    return Finding(
        kind=FindingKind.WALK_HEADING,
        severity=severity,
        agents=(agent.id,),
        measured={"turn_deg": turn_deg, "walk_m": walk_m},
        template=f"{{agents[0]}} has a walk of {{walk_m:.1f}} m and faces {words}.",
    )


ROUND_DEG = 5
EXACT_RAD = 6e-4
"""How well a heading with three decimals meets the one that a wrapped number of degrees gives."""

_DIRECTED = frozenset({AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE, AgentType.PEDESTRIAN})
_ROUND = tuple(
    deg for deg in range(-360 + ROUND_DEG, 361, ROUND_DEG) if abs(math.sin(deg)) > EXACT_RAD
)
"""Without 355: as radians that is 113 half turns, and half a turn is what facing back means."""


def degrees(situation: ChangedScene) -> Iterator[Finding]:
    """Wrong beyond a full turn; doubtful where round degrees, wrapped as radians, fit exactly.

    The second asks for more than the number: read as degrees the heading must follow the lane or
    the walk, read as radians it must not. What has no direction of its own is left alone.
    """
    for agent in situation.changed:
        if abs(agent.heading_rad) > 2.0 * math.pi + 1e-3:
            yield _beyond(agent)
        elif agent.type in _DIRECTED:
            meant = [deg for deg in _ROUND if _is(agent.heading_rad, deg)]
            fitting = [deg for deg in meant if _fits_better(agent, deg, situation)]
            if fitting:
                yield _suspicious(agent, min(fitting, key=abs))


def _is(heading_rad: float, degrees: int) -> bool:
    return degrees != 0 and abs(difference(heading_rad, float(degrees))) < EXACT_RAD


def _fits_better(agent: TrafficAgent, degrees: int, situation: ChangedScene) -> bool:
    wanted = _wanted_rad(agent, situation)
    return any(
        abs(difference(math.radians(degrees), one)) < math.radians(10.0)
        and abs(difference(agent.heading_rad, one)) > math.radians(20.0)
        for one in wanted
    )


def _wanted_rad(agent: TrafficAgent, situation: ChangedScene) -> list[float]:
    """The directions that an agent would have: of its walk, or of the lanes under it."""
    if agent.type is AgentType.PEDESTRIAN:
        if agent.walk_to_m is None:
            return []
        x_m, y_m = agent.walk_to_m
        return [math.atan2(y_m - agent.y_m, x_m - agent.x_m)]
    return [one.tangent_rad for one in situation.beside[agent.id] if one.covers]


def _beyond(agent: TrafficAgent) -> Finding:
    minus = "" if agent.heading_rad >= 0.0 else "-"
    return Finding(
        kind=FindingKind.DEGREES,
        severity=Severity.WRONG,
        agents=(agent.id,),
        measured={"heading_rad": agent.heading_rad},
        template=(
            f"{{agents[0]}} has a heading of {minus}{{heading_rad:.3g}}, more than a full turn: "
            "it looks like degrees, radians are meant."
        ),
    )


def _suspicious(agent: TrafficAgent, degrees: int) -> Finding:
    minus = "-" if degrees < 0 else ""
    return Finding(
        kind=FindingKind.DEGREES,
        severity=Severity.DOUBTFUL,
        agents=(agent.id,),
        measured={"heading_rad": agent.heading_rad, "read_as_deg": float(degrees)},
        template=(
            f"The heading of {{agents[0]}} looks like {minus}{{read_as_deg:.0f}} degrees that "
            "were given as radians: read as degrees it would fit."
        ),
    )


SEEN_SHARE = 0.02
KERB_SHARE = 0.15
"""A third of a metre of a car's width: maps and placements are no better."""
MOST_SHARE = 0.5
EDGE_M = 1.0
"""Cones stand on the road or as far beside it as this."""
NEAR_ROAD_M = 3.0
VERGE_M = 2.0
"""Beside everything that a map shows people stand on verges that it does not show."""
FAR_FROM_PATHS_M = 10.0

_EDGE = frozenset({AgentType.TRAFFIC_CONE, AgentType.BARRIER})


def off_road(situation: ChangedScene) -> Iterator[Finding]:
    """Changed agents off their ground; nothing for who stands where its kind belongs.

    Vehicles belong on the road: a fact up to a share that no map resolves, doubtful up to half
    of the box (half on the kerb), wrong above. Cones and barriers belong on the road or within a
    metre of it. All others may also be on walkways and crosswalks and on a verge beside them; on
    a map without walkways it is unknown whether they are, so off it is a fact.
    """
    if situation.ground.road.is_empty:
        return
    for agent in situation.changed:
        if agent.type in VEHICLES:
            finding = _vehicle(agent, situation)
        elif agent.type in _EDGE:
            finding = _cone(agent, situation)
        else:
            finding = _on_foot(agent, situation)
        if finding is not None:
            yield finding


def _vehicle(agent: TrafficAgent, situation: ChangedScene) -> Finding | None:
    share = situation.ground.road.share_outside(situation.boxes[agent.id].corners_m)
    if share <= SEEN_SHARE:
        return None
    severity = Severity.FACT
    if share > KERB_SHARE:
        severity = Severity.DOUBTFUL if share <= MOST_SHARE else Severity.WRONG
    gap_m = situation.ground.road.distance_m(agent.x_m, agent.y_m)
    place = "{gap_m:.1f} m off it" if gap_m > 0.0 else "on it"
    return Finding(
        kind=FindingKind.OFF_ROAD,
        severity=severity,
        agents=(agent.id,),
        measured={"outside_share": share, "gap_m": gap_m},
        template=(
            "{outside_share:.0%} of {agents[0]} is outside the drivable area; its centre is "
            f"{place}."
        ),
    )


def _cone(agent: TrafficAgent, situation: ChangedScene) -> Finding | None:
    gap_m = situation.ground.road.distance_m(agent.x_m, agent.y_m)
    if gap_m <= EDGE_M:
        return None
    return Finding(
        kind=FindingKind.OFF_ROAD,
        severity=Severity.DOUBTFUL if gap_m <= NEAR_ROAD_M else Severity.WRONG,
        agents=(agent.id,),
        measured={"outside_share": 1.0, "gap_m": gap_m},
        template="{agents[0]} is {gap_m:.1f} m off the road and its edge.",
    )


def _on_foot(agent: TrafficAgent, situation: ChangedScene) -> Finding | None:
    ground = situation.ground.everything
    gap_m = ground.distance_m(agent.x_m, agent.y_m)
    if gap_m == 0.0:
        return None
    severity = Severity.FACT
    if not situation.ground.walkways.is_empty and gap_m > VERGE_M:
        severity = Severity.DOUBTFUL if gap_m <= FAR_FROM_PATHS_M else Severity.WRONG
    share = ground.share_outside(situation.boxes[agent.id].corners_m)
    return Finding(
        kind=FindingKind.OFF_ROAD,
        severity=severity,
        agents=(agent.id,),
        measured={"outside_share": share, "gap_m": gap_m},
        template="{agents[0]} is {gap_m:.1f} m off everything that the map shows.",
    )


OUTSIDE_M = 2.0


def outside_map(situation: ChangedScene) -> Iterator[Finding]:
    """Wrong for a changed agent outside the convex region around all that the map shows."""
    ground = situation.ground.everything
    if ground.is_empty:
        return
    for agent in situation.changed:
        outside_m = ground.distance_to_hull_m(agent.x_m, agent.y_m)
        if outside_m > OUTSIDE_M:
            yield Finding(
                kind=FindingKind.OUTSIDE_MAP,
                severity=Severity.WRONG,
                agents=(agent.id,),
                measured={"outside_m": outside_m},
                template="{agents[0]} is {outside_m:.1f} m outside the mapped region.",
            )
