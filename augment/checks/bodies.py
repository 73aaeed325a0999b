"""Checks of bodies: shared ground, unusual sizes and speeds, blocked walks."""

import math
from collections.abc import Iterator

import numpy as np
import shapely

from augment.checks.finding import Finding, FindingKind, Severity, find
from augment.checks.ground import VEHICLES, ChangedScene
from augment.geometry import frames
from augment.scene.entities import STEERED, STOPPED_BELOW_MPS, AgentType, Point, TrafficAgent
from augment.scene.planned_motion import PointPath

TOUCH_M = 0.02
"""Depths below this are rounding: prompts have places and sizes to the centimetre."""
CRASH_SHARE = 0.10
"""Crashed cars that people placed for interPlan overlap by up to 5.6 % of a box."""
GROSS_CRASH_SHARE = 0.20
CROWD_SHARE = 0.5
"""People stand close, and a pedestrian's box is wider than a pedestrian."""
SLIGHT_SHARE = 0.05
FAR_OFF = 1.7
"""By this factor outside its range a size or speed is no longer unusual but wrong."""
OVER_LIMIT = 1.5
"""By this factor above the limit of its lane a vehicle is too fast to be normal traffic."""
ASSUMED_WALK_M = 30.0
"""How far a pedestrian without an end point is followed; the longest known walk is 28.8 m."""
GRAZED_M = 0.1
"""Whoever walks through less than this of a box passes its corner."""

USUAL_SIZES_M: dict[AgentType, tuple[float, float, float, float]] = {
    AgentType.VEHICLE: (2.4, 13.0, 1.2, 3.5),  # from a microcar to a rigid truck
    AgentType.BUS: (5.0, 20.0, 1.8, 3.5),
    AgentType.BICYCLE: (1.0, 2.8, 0.3, 1.3),
    AgentType.PEDESTRIAN: (0.3, 1.5, 0.3, 1.5),
    AgentType.TRAFFIC_CONE: (0.15, 1.0, 0.15, 1.0),
    AgentType.BARRIER: (0.2, 6.0, 0.1, 3.0),
    AgentType.CONSTRUCTION_SIGN: (0.1, 4.0, 0.1, 3.0),
    AgentType.GENERIC_OBJECT: (0.1, 8.0, 0.1, 4.0),
}
"""Shortest, longest, narrowest and widest of the real ones."""
USUAL_MPS: dict[AgentType, float] = {
    AgentType.VEHICLE: 36.0,
    AgentType.BUS: 28.0,
    AgentType.BICYCLE: 12.0,
    AgentType.PEDESTRIAN: 4.0,
}
"""The fastest that still looks normal; what is not listed stands."""
_MOVED_MPS = USUAL_MPS | {AgentType.GENERIC_OBJECT: 4.0}
"""With a motion: also doors, balls and animals."""
RIDERS = frozenset({AgentType.PEDESTRIAN, AgentType.BICYCLE})


def name_type(kind: AgentType) -> str:
    """Return one of a type in words, with its article."""
    words = kind.value.lower().replace("_", " ")
    return f"an {words}" if words[0] in "aeiou" else f"a {words}"


def overlap(situation: ChangedScene) -> Iterator[Finding]:
    """Every pair with a changed agent in it whose boxes overlap, by the share of the smaller one.

    With the ego always wrong. Two stopped vehicles: contact up to 10 % is a fact, up to 20 %
    doubtful. People among themselves, also on bicycles: doubtful up to half. All others:
    doubtful up to 5 %. Above, wrong. A door in its car is a fact.
    """
    ego_id = situation.ground.scene.ego.id
    for agent, other in situation.new_pairs():
        shared = frames.overlap(situation.boxes[agent.id], situation.boxes[other.id])
        if shared.depth_m <= TOUCH_M:
            continue
        is_ego = other.id == ego_id
        yield find(
            FindingKind.OVERLAP,
            Severity.WRONG if is_ego else _overlap_severity(agent, other, shared.share),
            [agent, other],
            "{agents[0]} and {agents[1]} overlap by {share_of_smaller:.0%} of the smaller box, "
            "{depth_m:.2f} m deep.",
            share_of_smaller=shared.share,
            depth_m=shared.depth_m,
        )


def _overlap_severity(body: TrafficAgent, other: TrafficAgent, share: float) -> Severity:
    # Shares of the smaller box: up to the first a fact, up to the second doubtful.
    fine, doubtful = 0.0, SLIGHT_SHARE
    if any(_is_door(a) and b.type in VEHICLES for a, b in ((body, other), (other, body))):
        fine = 1.0
    elif all(agent.type in VEHICLES and agent.is_stopped for agent in (body, other)):
        fine, doubtful = CRASH_SHARE, GROSS_CRASH_SHARE
    elif body.type in RIDERS and other.type in RIDERS:
        doubtful = CROWD_SHARE
    if share <= fine:
        return Severity.FACT
    return Severity.DOUBTFUL if share <= doubtful else Severity.WRONG


def _is_door(agent: TrafficAgent) -> bool:
    path = None if agent.motion is None else agent.motion.path
    is_slide = isinstance(path, PointPath) and path.keeps_heading
    return is_slide and agent.type is AgentType.GENERIC_OBJECT


def size(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful outside the usual range of the type, wrong far outside or with sides swapped."""
    for agent in situation.changed:
        length_m, width_m = agent.length_m, agent.width_m
        shortest, longest, narrowest, widest = USUAL_SIZES_M[agent.type]
        # By how much each side is below its least or above its most; 1 is at the limit.
        factors = (
            *(shortest / max(length_m, 1e-3), length_m / longest),
            *(narrowest / max(width_m, 1e-3), width_m / widest),
        )
        is_swapped, words = agent.type in STEERED and width_m > length_m, "wider than long"
        if not is_swapped:
            words = f"unusual for {name_type(agent.type)}"
        if is_swapped or max(factors) > 1.0:
            is_wrong = is_swapped or max(factors) > FAR_OFF
            yield find(
                FindingKind.SIZE,
                Severity.WRONG if is_wrong else Severity.DOUBTFUL,
                [agent],
                f"{{agents[0]}} is {{length_m:.2f}} m long and {{width_m:.2f}} m wide: {words}.",
                length_m=length_m,
                width_m=width_m,
            )


def speed(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful above what is usual for the type or on its lane; wrong far above.

    Of who has a motion the highest one counts. A thing that can't move and does is wrong.
    """
    for agent in situation.changed:
        speeds, speed_mps = USUAL_MPS, agent.speed_mps
        if agent.id in situation.planned:
            speeds = _MOVED_MPS
            # (T,) speeds, NaN past the map.
            speed_mps = float(np.nanmax(situation.planned[agent.id].states[:, 3]))
        usual_mps = speeds.get(agent.type, STOPPED_BELOW_MPS)
        most_mps, under = usual_mps, situation.under[agent.id]
        if under is not None and agent.type in (AgentType.VEHICLE, AgentType.BUS):
            limit_mps = situation.ground.graph.lanes[under.lane_id].speed_limit_mps
            # A fast limit makes nothing usual that its kind does not drive.
            most_mps = min(usual_mps, OVER_LIMIT * limit_mps) if limit_mps else usual_mps
        if speed_mps <= most_mps:
            continue
        is_wrong = agent.type not in speeds or speed_mps > FAR_OFF * usual_mps
        yield find(
            FindingKind.SPEED,
            Severity.WRONG if is_wrong else Severity.DOUBTFUL,
            [agent],
            f"{{agents[0]}} moves at {{speed_mps:.1f}} m/s; up to {most_mps:.1f} m/s are usual "
            f"for {name_type(agent.type)} there.",
            speed_mps=speed_mps,
        )


def end_of_walk(agent: TrafficAgent) -> Point | None:
    """Return where a walk ends: as the agent says, else straight on; None for who stands."""
    if agent.motion is not None and isinstance(agent.motion.path, PointPath):
        return agent.motion.path.points_m[-1]
    if agent.walk_to_m is not None or agent.is_stopped:
        return agent.walk_to_m
    return (
        agent.x_m + ASSUMED_WALK_M * math.cos(agent.heading_rad),
        agent.y_m + ASSUMED_WALK_M * math.sin(agent.heading_rad),
    )


def walk_blocked(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful for every changed pedestrian whose walk leads through something that stands.

    People are no obstacle to each other: they step aside. A motion is not a walk.
    """
    for agent in situation.changed:
        end = None if agent.motion is not None else end_of_walk(agent)
        if agent.type is not AgentType.PEDESTRIAN or end is None:
            continue
        walk = shapely.LineString([(agent.x_m, agent.y_m), end])
        for other in situation.everyone:
            if not other.is_stopped or other.type is AgentType.PEDESTRIAN:
                continue
            box = shapely.Polygon(situation.boxes[other.id].corners_m)
            # Along the walk, so that who only passes a corner goes through little of it.
            inside_m = float(shapely.intersection(walk, box).length)
            if inside_m > GRAZED_M:
                words = "The walk of {agents[0]} leads {inside_m:.1f} m through {agents[1]}."
                pair = [agent, other]
                kind = FindingKind.WALK_BLOCKED
                yield find(kind, Severity.DOUBTFUL, pair, words, inside_m=inside_m)
