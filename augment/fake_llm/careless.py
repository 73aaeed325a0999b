"""The typical mistakes of weak models, made on purpose and the same every time.

A right placement is bent in the frame of the lane ahead of the ego: s along it, d to its left.
Which mistake is made depends on nothing but the prompt. Frame otherwise: ego frame.
"""

import hashlib
import math
import random
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

from augment.geometry.frames import wrap
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent
from augment.scene.planned_motion import (
    AtTime,
    LanePath,
    NearEgo,
    PlannedMotion,
    PointPath,
    Trigger,
)

SPARED_BY_TOOL = frozenset({"straight-line", "ego-heading"})
"""Mistakes that nobody makes who asks a function for poses on lanes."""

_UNREADABLE_SHARE = 0.1
_RIGHT_SHARE = 0.25
_NOTICEABLE_M, _NOTICEABLE_RAD = 1.0, 0.15

Agents = tuple[TrafficAgent, ...]
_Mistake = Callable[[Agents, EgoRoute, random.Random], Agents]
_MotionMistake = Callable[[TrafficAgent, PlannedMotion, EgoRoute, random.Random], PlannedMotion]


def dice(prompt: str) -> random.Random:
    """Return dice that fall the same for the same prompt, on every computer."""
    return random.Random(int.from_bytes(hashlib.sha256(prompt.encode()).digest()[:8], "big"))


def is_unreadable(rng: random.Random) -> bool:
    """Return whether this is one of the answers that nobody can read."""
    return rng.random() < _UNREADABLE_SHARE


def too_far(scene: Scene, right: Modification) -> Modification:
    """Return the right modification, 8 m too far along the lanes."""
    route = EgoRoute.of(scene)
    return right if route is None else replace(right, added=_shift(right.added, route, 8.0))


def bend(
    scene: Scene, right: Modification, rng: random.Random, spared: frozenset[str] = frozenset()
) -> tuple[Modification, str]:
    """Return the modification with a small inaccuracy and, mostly, a mistake, and its name.

    Of the mistakes only those are drawn that make a difference here: a straight line is no
    mistake on a straight road.

    Args:
        scene: What the task shows.
        right: What was asked for.
        rng: The dice.
        spared: Mistakes that are not made.
    """
    route = EgoRoute.of(scene)
    if route is None or not right.changed:
        return right, "none"
    shaky = _shift(right.changed, route, rng.uniform(-1.5, 1.5))
    outcomes = {
        name: mistake(shaky, route, rng)
        for name, mistake in MISTAKES.items()
        if name not in spared
    }
    outcomes = {name: agents for name, agents in outcomes.items() if _differs(agents, shaky)}
    for name, motion_mistake in MOTION_MISTAKES.items():
        agents = _moving_otherwise(shaky, motion_mistake, route, rng)
        outcomes |= {name: agents} if agents != shaky else {}
    possible = sorted(outcomes)
    if not possible or rng.random() < _RIGHT_SHARE:
        return right.with_changed(shaky), "none"
    name = rng.choice(possible)
    return right.with_changed(outcomes[name]), name


def straight_line(agents: Agents, route: EgoRoute, rng: random.Random) -> Agents:
    """Lay the distance out straight ahead of the ego instead of along the lane."""
    places = [route.locate_agent(agent) for agent in agents]
    return tuple(
        move_to(agent, place.ahead_m, place.left_m)
        for agent, place in zip(agents, places, strict=True)
    )


def ego_heading(agents: Agents, route: EgoRoute, rng: random.Random) -> Agents:
    """Ignore in the heading how the lane runs."""
    return tuple(
        replace(agent, heading_rad=wrap(agent.heading_rad - route.locate_agent(agent).tangent_rad))
        for agent in agents
    )


def neighbour_lane(agents: Agents, route: EgoRoute, rng: random.Random) -> Agents:
    """Put everything one lane beside where it belongs."""
    nearest = route.graph.nearest(agents[0].x_m, agents[0].y_m)
    width_m = route.graph.lanes[nearest[0]].width_m if nearest else 3.5
    return _shift(agents, route, 0.0, rng.choice([-1.0, 1.0]) * width_m)


def wrong_side(agents: Agents, route: EgoRoute, rng: random.Random) -> Agents:
    """Take the offset from the lane's centreline to the other side."""
    bent = []
    for agent in agents:
        nearest = route.graph.nearest(agent.x_m, agent.y_m)
        if nearest is not None and abs(nearest[1].d_m) <= 2.0:
            line = route.graph.lanes[nearest[0]].centerline
            agent = move_to(agent, *line.position(nearest[1].s_m, -nearest[1].d_m))
        bent.append(agent)
    return tuple(bent)


def distance(agents: Agents, route: EgoRoute, rng: random.Random) -> Agents:
    """Put everything 5 to 12 m too near or too far."""
    far = rng.choice([-1.0, 1.0])
    return _shift(agents, route, far * rng.uniform(5.0, 12.0))


def heap(agents: Agents, route: EgoRoute, rng: random.Random) -> Agents:
    """Put all vehicles on top of the first."""
    cars = [agent for agent in agents if agent.type in (AgentType.VEHICLE, AgentType.BUS)]
    heaped = [
        move_to(agent, cars[0].x_m + 0.2 * number, cars[0].y_m)
        for number, agent in enumerate(agents)
        if agent in cars
    ]
    return (*heaped, *(agent for agent in agents if agent not in cars))


def facing_away(agents: Agents, route: EgoRoute, rng: random.Random) -> Agents:
    """Turn pedestrians away from the road that they are to cross, and let them go nowhere."""
    return tuple(
        replace(agent, heading_rad=wrap(agent.heading_rad + math.pi), walk_to_m=None, motion=None)
        if agent.type is AgentType.PEDESTRIAN
        else agent
        for agent in agents
    )


MISTAKES: dict[str, _Mistake] = {
    "straight-line": straight_line,
    "ego-heading": ego_heading,
    "neighbour-lane": neighbour_lane,
    "wrong-side": wrong_side,
    "distance": distance,
    "heap": heap,
    "facing-away": facing_away,
}


def wrong_trigger(
    agent: TrafficAgent, motion: PlannedMotion, route: EgoRoute, rng: random.Random
) -> PlannedMotion:
    """Let it begin at a moment instead of by somebody's place, or the other way round."""
    is_timed, start = isinstance(motion.start, AtTime), AtTime(after_s=rng.uniform(0.0, 1.0))
    other: Trigger = NearEgo(within_m=rng.uniform(5.0, 10.0)) if is_timed else start
    return replace(motion, start=other)


def late_start(
    agent: TrafficAgent, motion: PlannedMotion, route: EgoRoute, rng: random.Random
) -> PlannedMotion:
    """Let it begin by the right event, some seconds late."""
    start = motion.start
    if isinstance(start, AtTime):
        return replace(motion, start=AtTime(after_s=start.after_s + rng.uniform(2.0, 4.0)))
    if isinstance(start, NearEgo):
        return replace(motion, start=NearEgo(within_m=start.within_m * rng.uniform(0.3, 0.5)))
    further_m = route.locate(start.x_m, start.y_m).ahead_m + rng.uniform(15.0, 30.0)
    x_m, y_m = route.position(further_m)
    return replace(motion, start=replace(start, x_m=x_m, y_m=y_m))


def wrong_speed(
    agent: TrafficAgent, motion: PlannedMotion, route: EgoRoute, rng: random.Random
) -> PlannedMotion:
    """Take half of its speeds, or much more."""
    factor, speeds = rng.choice([0.5, 1.6]), motion.speeds or ((0.0, agent.speed_mps),)
    return replace(motion, speeds=tuple((s, factor * mps) for s, mps in speeds))


def wrong_deceleration(
    agent: TrafficAgent, motion: PlannedMotion, route: EgoRoute, rng: random.Random
) -> PlannedMotion:
    """Let it come to its speeds much later or sooner."""
    factor = rng.choice([0.4, 2.5])
    return replace(motion, speeds=tuple((factor * s, mps) for s, mps in motion.speeds))


def wrong_way(
    agent: TrafficAgent, motion: PlannedMotion, route: EgoRoute, rng: random.Random
) -> PlannedMotion:
    """Stay in the lane, turn where the lanes part otherwise, or go a lane beside the points."""
    path = motion.path
    if isinstance(path, PointPath):
        (x_m, y_m), aside_m = path.points_m[-1], rng.choice([-3.5, 3.5])
        way_rad = math.atan2(y_m - agent.y_m, x_m - agent.x_m)
        step_m = (-aside_m * math.sin(way_rad), aside_m * math.cos(way_rad))
        return replace(motion, path=_shift_path(path, step_m))
    for number, (before, after) in enumerate(pairwise(path.lane_ids if path else ()), start=1):
        assert isinstance(path, LanePath)
        following = route.graph.successors(before)
        others = () if after not in following else [s for s in following if s != after][:1]
        if others or after not in following:
            return replace(motion, path=replace(path, lane_ids=(*path.lane_ids[:number], *others)))
    return motion


MOTION_MISTAKES: dict[str, _MotionMistake] = {
    "wrong-trigger": wrong_trigger,
    "late-start": late_start,
    "wrong-speed": wrong_speed,
    "wrong-deceleration": wrong_deceleration,
    "wrong-way": wrong_way,
}


# Private


def _moving_otherwise(
    agents: Agents, mistake: _MotionMistake, route: EgoRoute, rng: random.Random
) -> Agents:
    """Make a mistake in every motion; without any the dice stay where they are."""
    return tuple(
        replace(agent, motion=mistake(agent, agent.motion, route, rng)) if agent.motion else agent
        for agent in agents
    )


def _shift_path(path: PointPath, step_m: tuple[float, float]) -> PointPath:
    points_m = tuple((x_m + step_m[0], y_m + step_m[1]) for x_m, y_m in path.points_m)
    return replace(path, points_m=points_m)


def _shift(agents: Agents, route: EgoRoute, along_m: float, left_m: float = 0.0) -> Agents:
    """Move everybody along and across the lane ahead."""
    return tuple(shift_agent(agent, route, along_m, left_m) for agent in agents)


def shift_agent(
    agent: TrafficAgent, route: EgoRoute, along_m: float, left_m: float = 0.0
) -> TrafficAgent:
    """Move the agent along and across the lane ahead, turned as it turns."""
    place = route.locate_agent(agent)
    ahead_m = place.ahead_m + along_m
    turn = route.heading_at(ahead_m) - place.tangent_rad
    x_m, y_m = route.position(ahead_m, place.left_m + left_m)
    return move_to(agent, x_m, y_m, wrap(agent.heading_rad + turn))


def move_to(
    agent: TrafficAgent, x_m: float, y_m: float, heading_rad: float | None = None
) -> TrafficAgent:
    """Put the agent in another place; its walk and the points of its motion go along."""
    walk, motion, step_m = agent.walk_to_m, agent.motion, (x_m - agent.x_m, y_m - agent.y_m)
    if walk is not None:
        walk = (walk[0] + step_m[0], walk[1] + step_m[1])
    if motion is not None and isinstance(motion.path, PointPath):
        motion = replace(motion, path=_shift_path(motion.path, step_m))
    heading = agent.heading_rad if heading_rad is None else heading_rad
    return replace(agent, x_m=x_m, y_m=y_m, heading_rad=heading, walk_to_m=walk, motion=motion)


def _differs(agents: Agents, others: Agents) -> bool:
    pairs = zip(*(sorted(side, key=lambda a: a.id) for side in (agents, others)), strict=True)
    return any(
        math.hypot(a.x_m - b.x_m, a.y_m - b.y_m) > _NOTICEABLE_M
        or abs(wrap(a.heading_rad - b.heading_rad)) > _NOTICEABLE_RAD
        for a, b in pairs
    )
