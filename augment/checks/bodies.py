"""Boxes: whether they share ground, and whether their sizes and speeds are those of their kind."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import STOPPED_BELOW_MPS, VEHICLES, ChangedScene, is_stopped
from augment.geometry import frames
from augment.geometry.frames import Box
from augment.geometry.polyline import Polyline
from augment.scene.entities import AgentType, Point, TrafficAgent

TOUCH_M = 0.01
"""Depths below this are rounding."""
CRASH_SHARE = 0.10
"""Crashed cars that people placed for interPlan overlap by up to 5.6 % of a box."""
GROSS_CRASH_SHARE = 0.20
CROWD_SHARE = 0.5
"""People stand close, and a pedestrian's box is wider than a pedestrian."""
SLIGHT_SHARE = 0.05

_RIDER = frozenset({AgentType.PEDESTRIAN, AgentType.BICYCLE})


def overlap(situation: ChangedScene) -> Iterator[Finding]:
    """Every pair with a changed agent in it whose boxes overlap, by the share of the smaller one.

    With the ego always wrong. Two stopped vehicles: contact up to 10 % is a fact, up to 20 %
    doubtful. People among themselves, also on bicycles: doubtful up to half. All others:
    doubtful up to 5 %. Above, wrong.
    """
    done: set[str] = set()
    for agent in situation.changed:
        done.add(agent.id)
        for other in situation.everyone:
            if other.id not in done and _may_meet(agent, other):
                yield from _pair(agent, other, situation)


def _may_meet(one: TrafficAgent, other: TrafficAgent) -> bool:
    reach_m = math.hypot(one.length_m, one.width_m) + math.hypot(other.length_m, other.width_m)
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m) <= reach_m / 2.0 + TOUCH_M


def _pair(agent: TrafficAgent, other: TrafficAgent, situation: ChangedScene) -> Iterator[Finding]:
    shared = frames.overlap(situation.boxes[agent.id], situation.boxes[other.id])
    if shared.depth_m <= TOUCH_M:
        return
    share = max(shared.share_of_first, shared.share_of_second)
    is_ego = other.id == situation.ground.scene.ego.id
    yield Finding(
        kind=FindingKind.OVERLAP,
        severity=Severity.WRONG if is_ego else _overlap_severity(agent, other, share),
        agents=(agent.id, other.id),
        measured={"share_of_smaller": share, "area_m2": shared.area_m2, "depth_m": shared.depth_m},
        template=_WITH_EGO if is_ego else _WITH_OTHER,
    )


def _overlap_severity(one: TrafficAgent, other: TrafficAgent, share: float) -> Severity:
    fine, doubtful = 0.0, SLIGHT_SHARE
    if one.type in VEHICLES and other.type in VEHICLES and is_stopped(one) and is_stopped(other):
        fine, doubtful = CRASH_SHARE, GROSS_CRASH_SHARE
    elif one.type in _RIDER and other.type in _RIDER:
        doubtful = CROWD_SHARE
    if share <= fine:
        return Severity.FACT
    return Severity.DOUBTFUL if share <= doubtful else Severity.WRONG


_WITH_EGO = (
    "{agents[0]} and the ego overlap by {share_of_smaller:.0%} of the smaller box, {depth_m:.2f} "
    "m deep."
)
_WITH_OTHER = (
    "{agents[0]} and {agents[1]} overlap by {share_of_smaller:.0%} of the smaller box, "
    "{depth_m:.2f} m deep."
)


SAME_SPOT_SHARE = 0.1
"""Of the longer box: centres nearer than half a metre for cars, five centimetres for cones."""


def duplicate(situation: ChangedScene) -> Iterator[Finding]:
    """Wrong for a changed agent whose centre is on that of another agent of its type."""
    done: set[str] = set()
    for agent in situation.changed:
        done.add(agent.id)
        for other in situation.everyone:
            if other.id in done or other.type is not agent.type:
                continue
            apart_m = math.hypot(agent.x_m - other.x_m, agent.y_m - other.y_m)
            if apart_m < SAME_SPOT_SHARE * max(agent.length_m, other.length_m):
                yield Finding(
                    kind=FindingKind.DUPLICATE,
                    severity=Severity.WRONG,
                    agents=(agent.id, other.id),
                    measured={"apart_m": apart_m},
                    template=(
                        "{agents[0]} and {agents[1]} are on the same spot, {apart_m:.2f} m apart."
                    ),
                )


class Range(NamedTuple):
    """Length and width (m) that real ones have, from the smallest to the largest."""

    length_m: tuple[float, float]
    width_m: tuple[float, float]


USUAL_SIZES: dict[AgentType, Range] = {
    AgentType.VEHICLE: Range((2.4, 13.0), (1.2, 3.5)),  # from a microcar to a rigid truck
    AgentType.BUS: Range((5.0, 20.0), (1.8, 3.5)),
    AgentType.BICYCLE: Range((1.0, 2.8), (0.3, 1.3)),
    AgentType.PEDESTRIAN: Range((0.3, 1.5), (0.3, 1.5)),
    AgentType.TRAFFIC_CONE: Range((0.15, 1.0), (0.15, 1.0)),
    AgentType.BARRIER: Range((0.2, 6.0), (0.1, 3.0)),
    AgentType.CONSTRUCTION_SIGN: Range((0.1, 4.0), (0.1, 3.0)),
    AgentType.GENERIC_OBJECT: Range((0.1, 8.0), (0.1, 4.0)),
}
FAR_OFF = 1.7
"""By this factor outside its range a size or speed is no longer unusual but wrong."""

_LONG = frozenset({AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE})


def size(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful outside the usual range of the type, wrong far outside or with sides swapped."""
    for agent in situation.changed:
        usual = USUAL_SIZES[agent.type]
        off = max(_factor(agent.length_m, usual.length_m), _factor(agent.width_m, usual.width_m))
        swapped = agent.type in _LONG and agent.width_m > agent.length_m
        if off > 1.0 or swapped:
            yield _size_finding(agent, off, swapped=swapped)


def _factor(value_m: float, usual_m: tuple[float, float]) -> float:
    """How many times too small or too large a value is; at most 1 within the range."""
    low, high = usual_m
    return max(low / max(value_m, 1e-3), value_m / high)


def _size_finding(agent: TrafficAgent, off: float, *, swapped: bool) -> Finding:
    words = unusual_words(agent.type)
    if swapped:
        words = "wider than long: its length and width look swapped."
    return Finding(
        kind=FindingKind.SIZE,
        severity=Severity.WRONG if swapped or off > FAR_OFF else Severity.DOUBTFUL,
        agents=(agent.id,),
        measured={"length_m": agent.length_m, "width_m": agent.width_m},
        template=f"{{agents[0]}} is {{length_m:.2f}} m long and {{width_m:.2f}} m wide, {words}",
    )


def unusual_words(kind: AgentType) -> str:
    """That something is unusual for its type."""
    return f"which is unusual for {name_type(kind)}."


def name_type(kind: AgentType) -> str:
    """One of a type, with its article."""
    return _NAMES[kind]


_NAMES = {
    AgentType.EGO_VEHICLE: "an ego vehicle",
    AgentType.VEHICLE: "a vehicle",
    AgentType.BUS: "a bus",
    AgentType.BICYCLE: "a bicycle",
    AgentType.PEDESTRIAN: "a pedestrian",
    AgentType.TRAFFIC_CONE: "a traffic cone",
    AgentType.BARRIER: "a barrier",
    AgentType.CONSTRUCTION_SIGN: "a construction sign",
    AgentType.GENERIC_OBJECT: "a generic object",
}


USUAL_MPS: dict[AgentType, float] = {
    AgentType.VEHICLE: 36.0,
    AgentType.BUS: 28.0,
    AgentType.BICYCLE: 12.0,
    AgentType.PEDESTRIAN: 4.0,
}
"""The fastest that still looks normal; what is not listed stands."""
OVER_LIMIT = 1.5
"""By this factor above the limit of its lane a vehicle is too fast to be normal traffic."""


def speed(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful above what is usual for the type or on its lane, or backwards; wrong far above.

    A thing that can't move and does is wrong.
    """
    for agent in situation.changed:
        usual_mps = USUAL_MPS.get(agent.type, STOPPED_BELOW_MPS)
        limit_mps = _limit_mps(agent, situation)
        off = abs(agent.speed_mps) / usual_mps
        if off > 1.0:
            is_wrong = off > FAR_OFF or agent.type not in USUAL_MPS
            yield _speed_finding(agent, unusual_words(agent.type), is_wrong=is_wrong)
        elif limit_mps is not None and agent.speed_mps > OVER_LIMIT * limit_mps:
            words = f"where the limit is {limit_mps:.1f} m/s."
            yield _speed_finding(agent, words, is_wrong=False)
        elif agent.speed_mps < -STOPPED_BELOW_MPS:
            yield _speed_finding(agent, "backwards.", is_wrong=False)


def _limit_mps(agent: TrafficAgent, situation: ChangedScene) -> float | None:
    under = situation.under(agent)
    if under is None or agent.type not in (AgentType.VEHICLE, AgentType.BUS):
        return None
    return situation.ground.graph.lanes[under.lane_id].speed_limit_mps


def _speed_finding(agent: TrafficAgent, words: str, *, is_wrong: bool) -> Finding:
    return Finding(
        kind=FindingKind.SPEED,
        severity=Severity.WRONG if is_wrong else Severity.DOUBTFUL,
        agents=(agent.id,),
        measured={"speed_mps": agent.speed_mps},
        template=f"{{agents[0]}} moves at {{speed_mps:.1f}} m/s, {words}",
    )


CORRIDOR_M = 150.0
"""How far ahead of the ego a walk is held against its lane."""
ASSUMED_WALK_M = 30.0
"""How far a pedestrian without an end point is followed; the longest known walk is 28.8 m."""


def walk_crossing(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed pedestrian who walks: where it crosses the ego's route, if it does.

    Looked at is the route from the ego on.
    """
    route = situation.ground.route
    corridor = None if route is None else route.corridor(CORRIDOR_M)
    if corridor is None:
        return
    line, width_m = corridor
    for agent in situation.changed:
        end = end_of_walk(agent)
        if agent.type is AgentType.PEDESTRIAN and end is not None:
            yield _crossing_finding(agent, end, line, width_m)


def end_of_walk(agent: TrafficAgent) -> Point | None:
    """Where a walk ends: as the agent says, else straight on; None for who stands."""
    if agent.walk_to_m is not None or is_stopped(agent):
        return agent.walk_to_m
    return (
        agent.x_m + ASSUMED_WALK_M * math.cos(agent.heading_rad),
        agent.y_m + ASSUMED_WALK_M * math.sin(agent.heading_rad),
    )


def _crossing_finding(agent: TrafficAgent, end: Point, line: Polyline, width_m: float) -> Finding:
    start = (agent.x_m, agent.y_m)
    crosses_at_m = _meeting(np.array(start), np.array(end), line)
    first, last = line.project(*start), line.project(*end)
    steps_into = min(first.distance_m, last.distance_m) <= width_m / 2.0
    assumed = "" if agent.walk_to_m is not None else ", keeping its heading,"
    if crosses_at_m is not None:
        hands = ("left", "right")
        if first.d_m <= last.d_m:
            hands = hands[::-1]
        words = (
            f"crosses the ego's lane from {hands[0]} to {hands[1]}, {{crosses_at_m:.1f}} m ahead "
            "of the ego along the lanes."
        )
    elif steps_into:
        words = "starts or ends in the ego's lane and does not cross its middle."
    else:
        words = "does not cross the ego's lane."
    return Finding(
        kind=FindingKind.WALK_CROSSING,
        severity=Severity.FACT,
        agents=(agent.id,),
        measured={"crosses_at_m": crosses_at_m, "start_left_m": first.d_m, "end_left_m": last.d_m},
        template=f"The walk of {{agents[0]}}{assumed} {words}",
    )


def _meeting(start: NDArray[np.float64], end: NDArray[np.float64], line: Polyline) -> float | None:
    """The first arc length at which the walk from start to end, each (2,), meets the line."""
    begins = line.points_m[:-1]
    steps, walk = np.diff(line.points_m, axis=0), end - start
    turn = steps[:, 0] * walk[1] - steps[:, 1] * walk[0]
    offset = start - begins
    with np.errstate(divide="ignore", invalid="ignore"):  # a walk along a segment never meets it
        along = (offset[:, 0] * walk[1] - offset[:, 1] * walk[0]) / turn
        walked = (offset[:, 0] * steps[:, 1] - offset[:, 1] * steps[:, 0]) / turn
    meets = (along >= 0.0) & (along <= 1.0) & (walked >= 0.0) & (walked <= 1.0)
    if not meets.any():
        return None
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    return float((line.stations_m[:-1] + along * lengths)[meets].min())


GRAZED_M = 0.1
"""Whoever walks through less than this of a box passes its corner."""


def walk_blocked(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful for every changed pedestrian whose walk leads through something that stands.

    People are no obstacle to each other: they step aside.
    """
    for agent in situation.changed:
        end = end_of_walk(agent)
        if agent.type is not AgentType.PEDESTRIAN or end is None:
            continue
        for other in situation.everyone:
            if _is_in_the_way(other):
                inside_m = _inside_m((agent.x_m, agent.y_m), end, situation.boxes[other.id])
                if inside_m > GRAZED_M:
                    yield _blocked_finding(agent, other, inside_m)


def _is_in_the_way(other: TrafficAgent) -> bool:
    return is_stopped(other) and other.type is not AgentType.PEDESTRIAN


def _inside_m(start: Point, end: Point, box: Box) -> float:
    """How much of the straight way from start to end lies in a box."""
    begin, stop = box.pose.to_local(np.array([start, end]))
    half = np.array([box.length_m, box.width_m]) / 2.0
    step = stop - begin
    with np.errstate(divide="ignore", invalid="ignore"):  # a way along a side never crosses it
        shares = np.sort(np.array([(-half - begin) / step, (half - begin) / step]), axis=0)
    is_still = step == 0.0
    if (is_still & (np.abs(begin) > half)).any():
        return 0.0
    first, last = shares[0][~is_still].max(initial=0.0), shares[1][~is_still].min(initial=1.0)
    return max(0.0, float(last - first)) * float(np.hypot(*step))


def _blocked_finding(agent: TrafficAgent, other: TrafficAgent, inside_m: float) -> Finding:
    return Finding(
        kind=FindingKind.WALK_BLOCKED,
        severity=Severity.DOUBTFUL,
        agents=(agent.id, other.id),
        measured={"inside_m": inside_m},
        template="The walk of {agents[0]} leads {inside_m:.1f} m through {agents[1]}.",
    )
