"""The road as the simulated contestants see it, and placements that are right but not exact.

s runs along the ego's lane and what follows it straightest, from the ego's centre; d is left of
it. Frame otherwise: ego frame. Nothing here looks at the checks.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from augment.geometry.angles import wrap
from augment.geometry.boxes import Box, overlap
from augment.geometry.polyline import Polyline
from augment.scene.entities import LaneConnector, Scene, TrafficAgent
from augment.scene.lane_graph import LaneGraph
from augment.scene.modification import Modification

Agents = tuple[TrafficAgent, ...]

ALONG_M = 1.5
"""How far along the lane a right placement may be off its reference."""
ACROSS_M = 0.3
TURN_DEG = 5.0
OWN_M = 0.1
"""How far one of several objects may be off the others, either way."""

_REACH_M = 200.0
_TRIES = 20
_TOUCH_M = 0.01


@dataclass(frozen=True, kw_only=True, eq=False)
class RouteMap:
    """The ego's way as one line, and the map around it."""

    scene: Scene
    graph: LaneGraph
    line: Polyline
    ego_s_m: float
    width_m: float

    @classmethod
    def of(cls, scene: Scene) -> RouteMap | None:
        """None where the map has no lane under the ego."""
        graph = LaneGraph(scene)
        way = graph.under(scene.ego.x_m, scene.ego.y_m, scene.ego.heading_rad)
        if way is None:
            return None
        names = graph.route(way, _REACH_M)
        line = Polyline(np.vstack([graph.ways[name].centerline.points_m for name in names]))
        return cls(
            scene=scene,
            graph=graph,
            line=line,
            ego_s_m=line.project(scene.ego.x_m, scene.ego.y_m).s_m,
            width_m=graph.ways[way].width_m,
        )

    def place(self, agent: TrafficAgent) -> tuple[float, float]:
        """(s, d) of an agent."""
        found = self.line.project(agent.x_m, agent.y_m)
        return found.s_m - self.ego_s_m, found.d_m

    def heading_at(self, agent: TrafficAgent) -> float:
        """The direction of the ego's way level with an agent."""
        return self.line.heading_at(self.line.project(agent.x_m, agent.y_m).s_m)

    def moved(self, agent: TrafficAgent, along_m: float, left_m: float = 0.0) -> TrafficAgent:
        """The agent elsewhere in the frame of the way, turned as the way turns, its walk too."""
        s_m, d_m = self.place(agent)
        start, end = self.ego_s_m + s_m, self.ego_s_m + s_m + along_m
        turn = self.line.heading_at(end) - self.line.heading_at(start)
        x_m, y_m = self.line.position(end, d_m + left_m)
        walk = agent.walk_to_m
        if walk is not None:
            dx, dy = walk[0] - agent.x_m, walk[1] - agent.y_m
            cos, sin = math.cos(turn), math.sin(turn)
            walk = (x_m + cos * dx - sin * dy, y_m + sin * dx + cos * dy)
        elsewhere = replace(
            agent, x_m=x_m, y_m=y_m, heading_rad=wrap(agent.heading_rad + turn), walk_to_m=walk
        )
        return self.renamed(elsewhere)

    def renamed(self, agent: TrafficAgent) -> TrafficAgent:
        """The agent with the lane under it, if it named one at all."""
        if agent.lane_id is None:
            return agent
        return replace(agent, lane_id=self.graph.under(agent.x_m, agent.y_m, agent.heading_rad))

    def junction_ends_m(self) -> list[float]:
        """Where on the way ahead an intersection ends, as s."""
        way = self.graph.under(self.scene.ego.x_m, self.scene.ego.y_m, self.scene.ego.heading_rad)
        assert way is not None  # it made this road
        ends, total_m = [], -self.ego_s_m
        for name in self.graph.route(way, _REACH_M):
            total_m += self.graph.ways[name].centerline.length_m
            if isinstance(self.graph.ways[name], LaneConnector):
                ends.append(total_m)
        return ends


def jitter(road: RouteMap, reference: Modification, rng: random.Random) -> Modification:
    """A right placement that is not exact: all shifted together, each a little on its own.

    What did not touch before does not touch now; where chance finds no such place, the shift
    shrinks until it is the reference again.
    """
    for number in range(_TRIES):
        scale = 1.0 - number / _TRIES
        along, left = rng.uniform(-ALONG_M, ALONG_M), rng.uniform(-ACROSS_M, ACROSS_M)
        moved = tuple(
            _shaken(road.moved(agent, scale * along, scale * left), scale, rng)
            for agent in reference.added
        )
        if not new_contacts(road.scene, reference.added, moved):
            return replace(reference, added=moved)
    return reference


def new_contacts(scene: Scene, before: Agents, after: Agents) -> bool:
    """Whether boxes overlap after that did not before."""
    return len(_contacts(scene, after)) > len(_contacts(scene, before))


def change_each(
    agents: Iterable[TrafficAgent], change: Callable[[TrafficAgent], TrafficAgent]
) -> Agents:
    """Every agent changed."""
    return tuple(change(agent) for agent in agents)


# Private


def _shaken(agent: TrafficAgent, scale: float, rng: random.Random) -> TrafficAgent:
    """On its own: a hand's breadth in place and a few degrees, the end of a walk half a metre."""
    turn = math.radians(scale * rng.uniform(-TURN_DEG, TURN_DEG))
    dx, dy = (scale * rng.uniform(-OWN_M, OWN_M) for _ in range(2))
    walk = agent.walk_to_m
    if walk is not None:
        walk = (walk[0] + dx + scale * rng.uniform(-0.5, 0.5), walk[1] + dy)
    return replace(
        agent,
        x_m=agent.x_m + dx,
        y_m=agent.y_m + dy,
        heading_rad=wrap(agent.heading_rad + turn),
        walk_to_m=walk,
    )


def _contacts(scene: Scene, agents: Agents) -> list[tuple[int, int]]:
    boxes = [_box(agent) for agent in (*agents, *scene.everyone)]
    return [
        (n, m)
        for n in range(len(agents))
        for m in range(n + 1, len(boxes))
        if _near(boxes[n], boxes[m]) and overlap(boxes[n], boxes[m]).depth_m > _TOUCH_M
    ]


def _near(one: Box, other: Box) -> bool:
    reach = math.hypot(one.length_m, one.width_m) + math.hypot(other.length_m, other.width_m)
    return math.hypot(one.pose.x_m - other.pose.x_m, one.pose.y_m - other.pose.y_m) < reach / 2.0


def _box(agent: TrafficAgent) -> Box:
    return Box(pose=agent.pose, length_m=agent.length_m, width_m=agent.width_m)
