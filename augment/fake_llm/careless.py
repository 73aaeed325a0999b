"""The typical mistakes of weak models, made on purpose and the same every time.

A right placement is bent in the frame of the lane ahead of the ego: s along it, d to its left.
Which mistake is made depends on nothing but the prompt. Frame otherwise: ego frame.
"""

from __future__ import annotations

import hashlib
import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace

from augment.geometry.frames import wrap
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent, TurnType
from augment.scene.intent import Body, Intent, LaneChoice, Length, Relation, Spot, VehicleRequest
from augment.scene.lane_graph import LaneGraph

SPARED_BY_TOOL = frozenset({"straight-line", "ego-heading"})
"""Mistakes that nobody makes who asks a function for poses on lanes."""

_UNREADABLE_SHARE = 0.1
_RIGHT_SHARE = 0.25
_REAL_TURN_RAD = math.radians(30.0)
"""From the ego's heading to the lane's; no place of the paper set lies past so much."""
_NOTICEABLE_M = 1.0
_NOTICEABLE_RAD = 0.15

Agents = tuple[TrafficAgent, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Bent:
    """A placement gone wrong.

    Attributes:
        mistake: Its name, "none" where it stayed about right.
    """

    modification: Modification
    mistake: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _Setting:
    """What a mistake looks at: the ego's route and the dice."""

    route: EgoRoute
    rng: random.Random

    @property
    def graph(self) -> LaneGraph:
        """The map."""
        return self.route.graph


def dice(prompt: str) -> random.Random:
    """Dice that fall the same for the same prompt, on every computer."""
    return random.Random(int.from_bytes(hashlib.sha256(prompt.encode()).digest()[:8], "big"))


def is_unreadable(rng: random.Random) -> bool:
    """Whether this is one of the answers that nobody can read."""
    return rng.random() < _UNREADABLE_SHARE


def too_far(scene: Scene, right: Modification) -> Modification:
    """The right modification, 8 m too far along the lanes."""
    setting = _setting(scene, random.Random(0))
    if setting is None:
        moved = tuple(_at(a, a.x_m + 8.0, a.y_m, a.heading_rad) for a in right.added)
    else:
        moved = _shifted(right.added, setting, 8.0)
    return replace(right, added=moved)


def bend(
    scene: Scene, right: Modification, rng: random.Random, spared: frozenset[str] = frozenset()
) -> Bent:
    """The right modification with a small inaccuracy and, mostly, one mistake.

    Of the mistakes only those are drawn that make a difference here: a straight line is no
    mistake on a straight road.

    Args:
        scene: What the task shows.
        right: What was asked for.
        rng: The dice.
        spared: Mistakes that are not made.
    """
    setting = _setting(scene, rng)
    if setting is None or not right.changed:
        return Bent(modification=right, mistake="none")
    shaky = _shifted(right.changed, setting, rng.uniform(-1.5, 1.5))
    outcomes = {n: mistake(shaky, setting) for n, mistake in MISTAKES.items() if n not in spared}
    possible = sorted(name for name, agents in outcomes.items() if _differs(agents, shaky))
    if not possible or rng.random() < _RIGHT_SHARE:
        return Bent(modification=_with(right, shaky), mistake="none")
    name = rng.choice(possible)
    return Bent(modification=_with(right, outcomes[name]), mistake=name)


def _with(right: Modification, agents: Agents) -> Modification:
    """The modification with its added and moved agents as they are now."""
    moved = {agent.id for agent in right.moved}
    return replace(
        right,
        added=tuple(agent for agent in agents if agent.id not in moved),
        moved=tuple(agent for agent in agents if agent.id in moved),
    )


def straight_line(agents: Agents, setting: _Setting) -> Agents:
    """The distance is laid out straight ahead of the ego instead of along the lane."""
    bent = []
    for agent in agents:
        place = setting.route.locate_agent(agent)
        bent.append(_at(agent, place.ahead_m, place.left_m, agent.heading_rad))
    return tuple(bent)


def ego_heading(agents: Agents, setting: _Setting) -> Agents:
    """The heading ignores how the lane runs."""
    return tuple(
        replace(agent, heading_rad=wrap(agent.heading_rad - place.tangent_rad))
        for agent in agents
        for place in [setting.route.locate_agent(agent)]
    )


def lay_straight(scene: Scene, right: Modification) -> Modification:
    """Whatever lies past a real turn of the lane is laid out straight ahead of the ego."""
    setting = _setting(scene, random.Random(0))
    if setting is None:
        return right
    laid = (
        straight_line((agent,), setting)[0] if _is_past_turn(agent, setting.route) else agent
        for agent in right.changed
    )
    return _with(right, tuple(laid))


def neighbour_lane(agents: Agents, setting: _Setting) -> Agents:
    """Everything lands one lane beside where it belongs."""
    nearest = setting.graph.nearest(agents[0].x_m, agents[0].y_m)
    width_m = setting.graph.lanes[nearest[0]].width_m if nearest else 3.5
    return _shifted(agents, setting, 0.0, setting.rng.choice([-1.0, 1.0]) * width_m)


def wrong_side(agents: Agents, setting: _Setting) -> Agents:
    """The offset from the lane's centreline is taken to the other side."""
    bent = []
    for agent in agents:
        nearest = setting.graph.nearest(agent.x_m, agent.y_m)
        if nearest is None or abs(nearest[1].d_m) > 2.0:
            bent.append(agent)
            continue
        line = setting.graph.lanes[nearest[0]].centerline
        bent.append(_at(agent, *line.position(nearest[1].s_m, -nearest[1].d_m), agent.heading_rad))
    return tuple(bent)


def distance(agents: Agents, setting: _Setting) -> Agents:
    """5 to 12 m too near or too far."""
    far = setting.rng.choice([-1.0, 1.0])
    return _shifted(agents, setting, far * setting.rng.uniform(5.0, 12.0))


def heap(agents: Agents, setting: _Setting) -> Agents:
    """All vehicles lie on top of the first."""
    cars = [agent for agent in agents if agent.type in (AgentType.VEHICLE, AgentType.BUS)]
    return tuple(
        _at(agent, cars[0].x_m + 0.2 * n, cars[0].y_m, agent.heading_rad)
        for n, agent in enumerate(agents)
        if agent in cars
    ) + tuple(agent for agent in agents if agent not in cars)


def facing_away(agents: Agents, setting: _Setting) -> Agents:
    """Pedestrians look away from the road that they are to cross, and go nowhere."""
    return tuple(
        replace(agent, heading_rad=wrap(agent.heading_rad + math.pi), walk_to_m=None)
        if agent.type is AgentType.PEDESTRIAN
        else agent
        for agent in agents
    )


MISTAKES: dict[str, Callable[[Agents, _Setting], Agents]] = {
    "straight-line": straight_line,
    "ego-heading": ego_heading,
    "neighbour-lane": neighbour_lane,
    "wrong-side": wrong_side,
    "distance": distance,
    "heap": heap,
    "facing-away": facing_away,
}


def _setting(scene: Scene, rng: random.Random) -> _Setting | None:
    """None where the ego is on no lane: then there is nothing to measure along."""
    route = EgoRoute.of(scene)
    return None if route is None else _Setting(route=route, rng=rng)


def _shifted(agents: Agents, setting: _Setting, along_m: float, left_m: float = 0.0) -> Agents:
    """Everybody moved along and across the lane ahead, turned as it turns."""
    moved = []
    for agent in agents:
        place = setting.route.locate_agent(agent)
        ahead_m = place.ahead_m + along_m
        turn = setting.route.heading_at(ahead_m) - place.tangent_rad
        x_m, y_m = setting.route.position(ahead_m, place.left_m + left_m)
        moved.append(_at(agent, x_m, y_m, wrap(agent.heading_rad + turn)))
    return tuple(moved)


def _at(agent: TrafficAgent, x_m: float, y_m: float, heading_rad: float) -> TrafficAgent:
    """The agent in another place; its walk goes along."""
    walk = agent.walk_to_m
    if walk is not None:
        walk = (walk[0] + x_m - agent.x_m, walk[1] + y_m - agent.y_m)
    return replace(agent, x_m=x_m, y_m=y_m, heading_rad=heading_rad, walk_to_m=walk)


def _is_past_turn(agent: TrafficAgent, route: EgoRoute) -> bool:
    return abs(wrap(route.locate_agent(agent).tangent_rad)) > _REAL_TURN_RAD


def _differs(agents: Agents, others: Agents) -> bool:
    return any(
        math.hypot(a.x_m - b.x_m, a.y_m - b.y_m) > _NOTICEABLE_M
        or abs(wrap(a.heading_rad - b.heading_rad)) > _NOTICEABLE_RAD
        for a, b in zip(sorted(agents, key=_by_id), sorted(others, key=_by_id), strict=True)
    )


def _by_id(agent: TrafficAgent) -> str:
    return agent.id


_ATTEMPT_SHARE = 0.6
"""So many of the wishes that can't be met are carried out somehow."""
_ATTEMPT_M = 20.0
_LEVEL_M = 8.0
"""What stands for no distance at all."""


def misread(intent: Intent, rng: random.Random) -> Intent:
    """The intent as a careless reader has it: with one mistake wherever one can be made."""
    possible = [misreading for slip in SLIPS if (misreading := slip(intent)) is not None]
    if not possible or (intent.unmet and rng.random() > _ATTEMPT_SHARE):
        return intent
    return rng.choice(possible)


def try_anyway(intent: Intent) -> Intent | None:
    """What can't be met is done somehow: a car stands ahead."""
    if not intent.unmet:
        return None
    ahead = Length(low_m=_ATTEMPT_M, high_m=_ATTEMPT_M)
    spot = Spot(distance=ahead, relation=Relation.AHEAD, lane=LaneChoice.OWN)
    return Intent(requests=(VehicleRequest(spot=spot, body=Body.CAR, speed_mps=0.0, count=1),))


def go_straight(intent: Intent) -> Intent | None:
    """The turn is passed over; distances run straight on."""
    if intent.route is TurnType.STRAIGHT:
        return None
    return replace(intent, route=TurnType.STRAIGHT)


def turn_the_other_way(intent: Intent) -> Intent | None:
    """Left is taken for right, or right for left."""
    others = {TurnType.LEFT: TurnType.RIGHT, TurnType.RIGHT: TurnType.LEFT}
    other = others.get(intent.route)
    return None if other is None else replace(intent, route=other)


def count_from_ego(intent: Intent) -> Intent | None:
    """Whatever a distance runs from, it is taken from the ego."""
    if not any(_is_relative(one.spot) for one in (*intent.requests, *intent.moves)):
        return None
    return replace(
        intent,
        requests=tuple(replace(one, spot=_from_ego(one.spot)) for one in intent.requests),
        moves=tuple(replace(one, spot=_from_ego(one.spot)) for one in intent.moves),
    )


def take_first(intent: Intent) -> Intent | None:
    """The first road user of its kind is taken for a later one."""
    picks = [one.spot.landmark for one in intent.requests]
    if not any(pick is not None and pick.ordinal > 1 for pick in picks):
        return None
    return replace(
        intent,
        requests=tuple(
            one
            if one.spot.landmark is None
            else replace(
                one, spot=replace(one.spot, landmark=replace(one.spot.landmark, ordinal=1))
            )
            for one in intent.requests
        ),
    )


SLIPS: tuple[Callable[[Intent], Intent | None], ...] = (
    try_anyway,
    go_straight,
    turn_the_other_way,
    count_from_ego,
    take_first,
)


# Private


def _is_relative(spot: Spot) -> bool:
    return spot.landmark is not None or spot.mark is not None or spot.anchor is not None


def _from_ego(spot: Spot) -> Spot:
    if not _is_relative(spot):
        return spot
    near = Length(low_m=_LEVEL_M, high_m=_LEVEL_M)
    bare = replace(spot, anchor=None, landmark=None, mark=None, settings=())
    return replace(bare, distance=spot.distance or near, relation=Relation.AHEAD)
