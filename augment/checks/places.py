"""Where changed agents are, on which ground, and where they look; no intent is asked for."""

import math
from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity, ahead_of, find, side_of
from augment.checks.ground import Beside
from augment.checks.situation import VEHICLES, ChangedScene, is_stopped
from augment.geometry.frames import difference
from augment.scene.entities import AgentType, TrafficAgent

FAR_M = 15.0
"""Further than this beside the ego's lanes a distance along them says nothing."""
NAMED_WITHIN_M = 0.5
"""Beyond the lane's edge: whoever stands on the line may name either side."""
ALONG_BELOW_DEG = 30.0
OPPOSITE_ABOVE_DEG = 150.0
ROADSIDE_M = 3.0
"""Up to here off a lane a vehicle is parked beside it; further out no lane gives a direction."""
BACKWARDS_ABOVE_DEG = 90.0
SHORT_M = 1.5
"""A step of a worker who stands has no direction that anybody would have to face."""
NOWHERE_M = 0.001
"""Below a millimetre the direction of a walk is rounding."""
EXACT_RAD = 6e-4
"""How well a heading with three decimals meets the one that a wrapped number of degrees gives."""
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
OUTSIDE_M = 2.0

_STEERED = frozenset({AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE})
_DIRECTED = _STEERED | {AgentType.PEDESTRIAN}
_EDGE = frozenset({AgentType.TRAFFIC_CONE, AgentType.BARRIER})
_ROUND = tuple(deg for deg in range(-355, 361, 5) if deg and abs(math.sin(deg)) > EXACT_RAD)
"""Round degrees, without 355: as radians that is 113 half turns, and half a turn is what facing
back means."""


def ego_offset(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed agent, centre to centre, along and across the ego's heading."""
    ego = situation.ground.scene.ego.pose
    for agent in situation.changed:
        seen = ego.pose_to_local(agent.pose)
        yield find(
            FindingKind.EGO_OFFSET,
            Severity.FACT,
            [agent],
            "{agents[0]} is {straight_m:.1f} m from the ego in a straight line: "
            f"{{ahead_m:.1f}} m {ahead_of(seen.x_m)} it and {{left_m:.1f}} m to its "
            f"{side_of(seen.y_m)}.",
            straight_m=math.hypot(seen.x_m, seen.y_m),
            ahead_m=seen.x_m,
            left_m=seen.y_m,
        )


def lane(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed agent: the lane under it, or how far it is off the nearest."""
    for agent in situation.changed:
        under = situation.under(agent)
        place = under or situation.nearest(agent)
        if place is None:
            continue
        on_line = "on its centre line"
        if abs(place.d_m) >= 0.005:
            on_line = f"{{left_m:.2f}} m to the {side_of(place.d_m)} of its centre line"
        words = (
            f"{{agents[0]}} is on {{lanes[0]}}, {{along_m:.1f}} m along it and {on_line}; the "
            "lane is {lane_width_m:.1f} m wide."
        )
        if under is None:
            words = (
                "{agents[0]} is {off_m:.1f} m off every lane; the nearest lane is {lanes[0]} at "
                "{along_m:.1f} m along it."
            )
        yield find(
            FindingKind.LANE,
            Severity.FACT,
            [agent],
            words,
            lanes=(place.lane_id,),
            along_m=place.s_m,
            left_m=place.d_m,
            lane_width_m=place.width_m,
            off_m=place.off_m if under is None else 0.0,
        )


def lane_distance(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed agent on a map that has a lane for the ego.

    `along_lanes_m` is None where no chain of successors leads from the ego to the agent's lane
    or back (then it would be negative); `level_m` and `beside_m` then tell where the agent is
    beside the lanes that can be reached, on the oncoming lane for example.
    """
    if situation.ground.route is None:
        return
    for agent in situation.changed:
        place, along_m = _reached(agent, situation)
        words, on_lane_m = "No lane leads from the ego to the place of {agents[0]}", None
        side = ahead_of(along_m or 0.0)
        if place is None:
            words += "."
        elif place.covers:
            words = f"{{agents[0]}} is {{along_lanes_m:.1f}} m {side} the ego along the lanes."
            on_lane_m = along_m
        else:
            words += (
                f": it is level with a point {{level_m:.1f}} m {side} the ego along the lanes, "
                f"{{beside_m:.1f}} m to the {side_of(place.d_m)} of the centre of {{lanes[0]}}."
            )
        yield find(
            FindingKind.LANE_DISTANCE,
            Severity.FACT,
            [agent],
            words,
            lanes=() if place is None else (place.lane_id,),
            along_lanes_m=on_lane_m,
            level_m=along_m,
            beside_m=None if place is None else place.d_m,
        )


def _reached(
    agent: TrafficAgent, situation: ChangedScene
) -> tuple[Beside, float] | tuple[None, None]:
    """The nearest lane that the ego reaches or came from, and how far along it the agent is."""
    places = {place.lane_id: place for place in situation.beside[agent.id]}
    candidates = [
        (place, start_m + place.s_m)
        for lane_id, start_m in situation.ground.starts_m
        if (place := places.get(lane_id)) and (place.covers or place.distance_m <= FAR_M)
    ]
    if not candidates:
        return None, None
    return min(candidates, key=lambda one: (round(one[0].distance_m, 4), round(abs(one[1]), 4)))


def lane_named(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful where an agent names a lane that it is not on, wrong where there is none such."""
    for agent in situation.changed:
        named = agent.lane_id
        if named is None:
            continue
        lane = situation.ground.graph.lanes.get(named)
        if lane is None:
            words = "{agents[0]} names {lanes[0]} as its lane, which the map does not have."
            yield find(FindingKind.LANE_NAMED, Severity.WRONG, [agent], words, lanes=(named,))
            continue
        far_m = lane.centerline.project(agent.x_m, agent.y_m).distance_m - lane.width_m / 2.0
        near = [one.off_m for one in situation.beside[agent.id] if one.lane_id == named]
        off_m = near[0] if near else far_m
        if off_m <= NAMED_WITHIN_M:
            continue
        under = situation.under(agent)
        yield find(
            FindingKind.LANE_NAMED,
            Severity.DOUBTFUL,
            [agent],
            "{agents[0]} names {lanes[0]} as its lane but is {off_named_lane_m:.1f} m off it, "
            + ("on no lane." if under is None else "on {lanes[1]}."),
            lanes=(named,) if under is None else (named, under.lane_id),
            off_named_lane_m=off_m,
        )


def heading(situation: ChangedScene) -> Iterator[Finding]:
    """The turn of every changed vehicle and bicycle against its lane, left positive.

    A fact up to 30 degrees, within an accident, on a car park and for a bicycle that stands;
    doubtful above. Against the traffic it is wrong for a vehicle that moves.
    """
    for agent in situation.changed:
        place = situation.under(agent) or situation.nearest(agent)
        if agent.type not in _STEERED or place is None or place.off_m > ROADSIDE_M:
            continue
        turn_deg = math.degrees(difference(agent.heading_rad, place.tangent_rad))
        words = f"{{turn_deg:.0f}} degrees to the {side_of(turn_deg)} of the direction of "
        words += "{lanes[0]}"
        if abs(turn_deg) > OPPOSITE_ABOVE_DEG:
            words = "against the direction of {lanes[0]} (turned by {turn_deg:.0f} degrees)"
        elif abs(turn_deg) < 0.5:
            words = "along {lanes[0]}"
        severity = _heading_severity(agent, abs(turn_deg), situation)
        if severity is not Severity.FACT:
            minus = "-" if place.tangent_rad < 0.0 else ""
            words += f", which is {minus}{{lane_heading_rad:.3f}} rad there"
        yield find(
            FindingKind.HEADING,
            severity,
            [agent],
            f"{{agents[0]}} faces {words}.",
            lanes=(place.lane_id,),
            turn_deg=turn_deg,
            lane_heading_rad=place.tangent_rad,
        )


def _heading_severity(agent: TrafficAgent, turn_deg: float, situation: ChangedScene) -> Severity:
    if turn_deg <= ALONG_BELOW_DEG or agent.id in situation.crashed:
        return Severity.FACT
    is_bicycle = agent.type is AgentType.BICYCLE
    carparks = situation.ground.carparks
    if is_stopped(agent) and (is_bicycle or carparks.distance_m(agent.x_m, agent.y_m) == 0.0):
        return Severity.FACT
    is_against = turn_deg > OPPOSITE_ABOVE_DEG and not is_bicycle
    return Severity.WRONG if is_against and not is_stopped(agent) else Severity.DOUBTFUL


def walk_heading(situation: ChangedScene) -> Iterator[Finding]:
    """The turn of every changed agent with a walk against it: doubtful above 30 degrees.

    Above 90 degrees, walking backwards, it is wrong.
    """
    for agent in situation.changed:
        if agent.walk_to_m is None:
            continue
        dx, dy = agent.walk_to_m[0] - agent.x_m, agent.walk_to_m[1] - agent.y_m
        walk_m = math.hypot(dx, dy)
        severity, turn_deg = Severity.FACT, None
        words = "that ends where it starts"
        if walk_m >= NOWHERE_M:
            turn_deg = math.degrees(difference(agent.heading_rad, math.atan2(dy, dx)))
            turned = f"{{turn_deg:.0f}} degrees to the {side_of(turn_deg)} of it"
            words = "along it" if abs(turn_deg) < 0.5 else turned
            if walk_m > SHORT_M and abs(turn_deg) > ALONG_BELOW_DEG:
                backwards = abs(turn_deg) > BACKWARDS_ABOVE_DEG
                severity = Severity.WRONG if backwards else Severity.DOUBTFUL
            words = f"of {{walk_m:.1f}} m and faces {words}"
        template = f"{{agents[0]}} has a walk {words}."
        kind = FindingKind.WALK_HEADING
        yield find(kind, severity, [agent], template, turn_deg=turn_deg, walk_m=walk_m)


def degrees(situation: ChangedScene) -> Iterator[Finding]:
    """Wrong beyond a full turn; doubtful where round degrees, wrapped as radians, fit exactly.

    The second asks for more than the number: read as degrees the heading must follow the lane or
    the walk, read as radians it must not. What has no direction of its own is left alone.
    """
    for agent in situation.changed:
        heading_rad = agent.heading_rad
        if abs(heading_rad) > 2.0 * math.pi + 1e-3:
            minus = "" if heading_rad >= 0.0 else "-"
            words = (
                f"{{agents[0]}} has a heading of {minus}{{heading_rad:.3g}}, more than a full "
                "turn: it looks like degrees, radians are meant."
            )
            yield find(
                FindingKind.DEGREES, Severity.WRONG, [agent], words, heading_rad=heading_rad
            )
            continue
        wanted = _wanted_rad(agent, situation) if agent.type in _DIRECTED else []
        fitting = [
            degrees
            for degrees in _ROUND
            if abs(difference(heading_rad, float(degrees))) < EXACT_RAD
            and any(_is_meant(heading_rad, degrees, wanted_rad) for wanted_rad in wanted)
        ]
        if fitting:
            read_as = min(fitting, key=abs)
            words = (
                f"The heading of {{agents[0]}} looks like {'-' if read_as < 0 else ''}"
                "{read_as_deg:.0f} degrees that were given as radians: read as degrees it would "
                "fit."
            )
            numbers = {"heading_rad": heading_rad, "read_as_deg": float(read_as)}
            yield find(FindingKind.DEGREES, Severity.DOUBTFUL, [agent], words, measured=numbers)


def _is_meant(heading_rad: float, degrees: int, wanted_rad: float) -> bool:
    """Whether a heading fits what is wanted as degrees, and does not as radians."""
    return abs(difference(math.radians(degrees), wanted_rad)) < math.radians(10.0) and abs(
        difference(heading_rad, wanted_rad)
    ) > math.radians(20.0)


def _wanted_rad(agent: TrafficAgent, situation: ChangedScene) -> list[float]:
    """The directions that an agent would have: of its walk, or of the lanes under it."""
    if agent.type is not AgentType.PEDESTRIAN:
        return [one.tangent_rad for one in situation.beside[agent.id] if one.covers]
    if agent.walk_to_m is None:
        return []
    x_m, y_m = agent.walk_to_m
    return [math.atan2(y_m - agent.y_m, x_m - agent.x_m)]


def off_road(situation: ChangedScene) -> Iterator[Finding]:
    """Changed agents off their ground; nothing for who stands where its kind belongs.

    Vehicles belong on the road: a fact up to a share that no map resolves, doubtful up to half
    of the box (half on the kerb), wrong above. Cones and barriers belong on the road or within a
    metre of it. All others may also be on walkways and crosswalks and on a verge beside them; on
    a map without walkways it is unknown whether they are, so off it is a fact.
    """
    ground = situation.ground
    if ground.road.is_empty:
        return
    for agent in situation.changed:
        surface = ground.road if agent.type in VEHICLES | _EDGE else ground.everything
        share = surface.share_outside(situation.boxes[agent.id].corners_m)
        gap_m = surface.distance_m(agent.x_m, agent.y_m)
        if agent.type in VEHICLES:
            limits = (SEEN_SHARE, KERB_SHARE, MOST_SHARE)
            off = share
            place = "{gap_m:.1f} m off it" if gap_m > 0.0 else "on it"
            words = "{outside_share:.0%} of {agents[0]} is outside the drivable area; its centre "
            words += f"is {place}."
        elif agent.type in _EDGE:
            limits, off, share = (EDGE_M, EDGE_M, NEAR_ROAD_M), gap_m, 1.0
            words = "{agents[0]} is {gap_m:.1f} m off the road and its edge."
        else:
            limits, off = (0.0, VERGE_M, FAR_FROM_PATHS_M), gap_m
            if ground.walkways.is_empty:
                limits = (0.0, math.inf, math.inf)
            words = "{agents[0]} is {gap_m:.1f} m off everything that the map shows."
        belongs, is_fact, is_doubtful = (off <= limit for limit in limits)
        if not belongs:
            doubt = Severity.DOUBTFUL if is_doubtful else Severity.WRONG
            severity = Severity.FACT if is_fact else doubt
            numbers = {"outside_share": share, "gap_m": gap_m}
            yield find(FindingKind.OFF_ROAD, severity, [agent], words, measured=numbers)


def outside_map(situation: ChangedScene) -> Iterator[Finding]:
    """Wrong for a changed agent outside the convex region around all that the map shows."""
    ground = situation.ground.everything
    for agent in () if ground.is_empty else situation.changed:
        outside_m = ground.distance_to_hull_m(agent.x_m, agent.y_m)
        if outside_m > OUTSIDE_M:
            words = "{agents[0]} is {outside_m:.1f} m outside the mapped region."
            yield find(
                FindingKind.OUTSIDE_MAP, Severity.WRONG, [agent], words, outside_m=outside_m
            )
