"""Places of changed agents, their ground and heading; no intent is needed."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from augment.checks.finding import Finding, FindingKind, Severity, find
from augment.checks.ground import VEHICLES, ChangedScene, Ground
from augment.checks.lanes_across import LanesAcross, find_place
from augment.geometry.frames import Box, difference
from augment.scene.entities import STEERED, AgentType, TrafficAgent

NAMED_WITHIN_M = 0.5
"""Beyond the lane's edge: whoever stands on the line may name either side."""
ALONG_BELOW_DEG = 30.0
OPPOSITE_ABOVE_DEG = 150.0
ROADSIDE_M = 3.0
"""Up to here off a lane a vehicle is parked beside it; further out no lane gives a direction."""
# Of a heading against the walk: beyond it somebody walks backwards.
BACKWARDS_ABOVE_DEG = 90.0
SHORT_M = 1.5
"""A step of a worker who stands has no direction that anybody would have to face."""
# Shares of a vehicle's box off the road, from one that no map resolves on.
SEEN_SHARE = 0.02
KERB_SHARE = 0.15
"""A third of a metre of a car's width: maps and placements are no better."""
MOST_SHARE = 0.5
EDGE_M = 1.0
"""Cones stand on the road or as far beside it as this."""
NEAR_ROAD_M = 3.0
_BRANCH_M = 5.0
"""Further off the ego's route a lane is another way's, or a further one beside it."""
VERGE_M = 2.0
"""Beside everything that a map shows people stand on verges that it does not show."""
FAR_FROM_PATHS_M = 10.0

Check = Callable[[ChangedScene], Iterator[Finding]]
"""A check yields what it measured, and nothing where there is nothing to measure."""

_EDGE = frozenset({AgentType.TRAFFIC_CONE, AgentType.BARRIER})


def lane(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed agent: how far along the ego's lanes it is, and on which lane."""
    route = situation.ground.route
    if route is None:
        return
    for agent in situation.changed:
        place, under = route.locate_agent(agent), situation.under[agent.id]
        words, lanes = "off every lane", tuple[str, ...]() if under is None else (under.lane_id,)
        way = "its lanes and {left_m:.1f} m left of them"
        if under is not None:
            words = f"on {{lanes[0]}}, {under.d_m:.2f} m left of its centre line"
            # Far beside the route its metres ahead say little: the way to that lane says more.
            if abs(place.left_m) > _BRANCH_M:
                there = find_place(
                    LanesAcross(route=route), (agent.x_m, agent.y_m), agent.heading_rad
                )
                if there.via is not None:
                    place, lanes = there.route.locate_agent(agent), (under.lane_id, there.via)
                    way = "the way to {lanes[1]} and {left_m:.1f} m left of it"
        yield find(
            FindingKind.LANE,
            Severity.FACT,
            [agent],
            f"{{agents[0]}} is {{ahead_m:.1f}} m ahead of the ego along {way}, {words}.",
            lanes=lanes,
            ahead_m=place.ahead_m,
            left_m=place.left_m,
        )


def lane_named(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful where an agent names a lane that it is not on, wrong where there is none such."""
    for agent in situation.changed:
        if agent.lane_id is None:
            continue
        lane = situation.ground.graph.lanes.get(agent.lane_id)
        severity, off_m = Severity.WRONG, math.inf
        words = "{agents[0]} names {lanes[0]} as its lane, which the map does not have."
        if lane is not None:
            # From the lane's edge, negative on it.
            off_m = lane.centerline.project(agent.x_m, agent.y_m).distance_m - lane.width_m / 2.0
            severity = Severity.DOUBTFUL
            words = f"{{agents[0]}} names {{lanes[0]}} as its lane but is {off_m:.1f} m off it."
        if off_m > NAMED_WITHIN_M:
            names = (agent.lane_id,)
            yield find(FindingKind.LANE_NAMED, severity, [agent], words, lanes=names)


def heading(situation: ChangedScene) -> Iterator[Finding]:
    """The turn of every changed vehicle and bicycle against its lane.

    A fact up to 30 degrees, within an accident, on a car park and for a bicycle that stands;
    doubtful above. Against the traffic it is wrong for a vehicle that moves.
    """
    for agent in situation.changed:
        place = situation.under[agent.id] or situation.nearest[agent.id]
        if agent.type not in STEERED or place is None or place.off_m > ROADSIDE_M:
            continue
        # Positive to the left of the lane, from -180 to 180.
        turn_deg = math.degrees(difference(agent.heading_rad, place.tangent_rad))
        yield find(
            FindingKind.HEADING,
            _heading_severity(agent, abs(turn_deg), situation),
            [agent],
            "{agents[0]} is turned by {turn_deg:.0f} degrees to the left of the direction of "
            "{lanes[0]}, which is {lane_heading_rad:.3f} rad there.",
            lanes=(place.lane_id,),
            turn_deg=turn_deg,
            lane_heading_rad=place.tangent_rad,
        )


def _heading_severity(agent: TrafficAgent, turn_deg: float, situation: ChangedScene) -> Severity:
    is_bicycle, stands = agent.type is AgentType.BICYCLE, agent.is_stopped
    if turn_deg <= ALONG_BELOW_DEG or agent.id in situation.crashed or (is_bicycle and stands):
        return Severity.FACT
    if stands and situation.ground.carparks.distance_m(agent.x_m, agent.y_m) == 0.0:
        return Severity.FACT
    is_against = turn_deg > OPPOSITE_ABOVE_DEG and not is_bicycle and not stands
    return Severity.WRONG if is_against else Severity.DOUBTFUL


def walk_heading(situation: ChangedScene) -> Iterator[Finding]:
    """The turn of every changed agent with a walk against it: doubtful above 30 degrees.

    Above 90 degrees, walking backwards, it is wrong.
    """
    for agent in situation.changed:
        if agent.walk_to_m is None:
            continue
        dx, dy = agent.walk_to_m[0] - agent.x_m, agent.walk_to_m[1] - agent.y_m
        walk_m, severity = math.hypot(dx, dy), Severity.FACT
        turn_deg = math.degrees(difference(agent.heading_rad, math.atan2(dy, dx)))
        if walk_m > SHORT_M and abs(turn_deg) > ALONG_BELOW_DEG:
            backwards = abs(turn_deg) > BACKWARDS_ABOVE_DEG
            severity = Severity.WRONG if backwards else Severity.DOUBTFUL
        yield find(
            FindingKind.WALK_HEADING,
            severity,
            [agent],
            "{agents[0]} is turned by {turn_deg:.0f} degrees to the left of its walk of "
            "{walk_m:.1f} m.",
            turn_deg=turn_deg,
            walk_m=walk_m,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Stray:
    """Distance of a box from the ground of its class.

    Attributes:
        over: How many of the kind's limits are passed: 1 is a fact, 2 doubtful, 3 wrong.
        off: What the limits are of, a share or metres.
    """

    over: int
    off: float
    outside_share: float
    gap_m: float

    @property
    def severity(self) -> Severity:
        """Severity beyond a limit."""
        return (Severity.FACT, Severity.DOUBTFUL, Severity.WRONG)[self.over - 1]


def stray(ground: Ground, kind: AgentType, box: Box) -> Stray:
    """Measure a box against the limits of its kind, as `off_road` has them."""
    # People and things may be wherever the map shows anything.
    surface = ground.road if kind in VEHICLES | _EDGE else ground.everything
    share = surface.share_outside(box.corners_m)
    gap_m = surface.distance_m(box.pose.x_m, box.pose.y_m)
    off, limits = gap_m, (0.0, VERGE_M, FAR_FROM_PATHS_M)
    if kind in VEHICLES:
        off, limits = share, (SEEN_SHARE, KERB_SHARE, MOST_SHARE)
    elif kind in _EDGE:
        limits = (EDGE_M, EDGE_M, NEAR_ROAD_M)
    elif ground.walkways.is_empty:
        limits = (0.0, math.inf, math.inf)
    # Limits rise from a fact over doubtful to wrong: those that are passed name the severity.
    over = sum(off > limit for limit in limits)
    return Stray(over=over, off=off, outside_share=share, gap_m=gap_m)


def name_stray(kind: AgentType) -> str:
    """Return the words for a `Stray` of a kind."""
    if kind in VEHICLES:
        return (
            "{outside_share:.0%} of {agents[0]} is outside the drivable area; its centre is "
            "{gap_m:.1f} m off it."
        )
    if kind in _EDGE:
        return "{agents[0]} is {gap_m:.1f} m off the road and its edge."
    return "{agents[0]} is {gap_m:.1f} m off everything that the map shows."


def off_road(situation: ChangedScene) -> Iterator[Finding]:
    """Changed agents off their ground; nothing for who stands where its kind belongs.

    Vehicles belong on the road: a fact up to a share that no map resolves, doubtful up to half
    of the box (half on the kerb), wrong above. Cones and barriers belong on the road or within a
    metre of it. All others may also be on walkways and crosswalks and on a verge beside them; on
    a map without walkways it is unknown whether they are, so off it is a fact.
    """
    ground = situation.ground
    for agent in () if ground.road.is_empty else situation.changed:
        place = stray(ground, agent.type, situation.boxes[agent.id])
        if place.over:
            yield find(
                FindingKind.OFF_ROAD,
                place.severity,
                [agent],
                name_stray(agent.type),
                outside_share=place.outside_share,
                gap_m=place.gap_m,
            )
