"""The ego's path over lanes: what leads to its lane, that lane, and what follows it straightest.

In: a scene. Out: positions counted as instructions count them, ahead from the ego's centre along
the lanes and left across them.
Frame: the scene's.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

from augment.geometry.polyline import Polyline
from augment.scene.entities import Point, Scene, TrafficAgent, TurnType
from augment.scene.lane_graph import LaneGraph, LanePosition

# Stations that differ by no more are the same.
_ROUNDED_M = 1e-6
_ROUND_M = 100.0
"""A longer way to a lane near the ego leads round the block."""
REACH_M = 300.0
"""How far ahead of the ego and behind it the lanes are followed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoutePosition:
    """Along the route (negative behind the ego), left of it, and the route's direction there."""

    ahead_m: float
    left_m: float
    tangent_rad: float


@dataclass(frozen=True, kw_only=True, eq=False)
class EgoRoute:
    """The path as one line.

    Attributes:
        scene: Whose ego it is.
        lane_id: The lane or connector of the ego.
        lane_s_m: Where on its centreline the ego is.
        lane_ids: All lanes and connectors of the path, in the direction of travel.
        ends_m: How far ahead of the ego each of them ends; negative behind it.
        line: Their centrelines in one.
        ego_s_m: Where on the line the ego is.
        turn: Which way it goes at every junction that has such a turn, else straight on.
    """

    scene: Scene
    graph: LaneGraph
    lane_id: str
    lane_s_m: float
    lane_ids: tuple[str, ...]
    ends_m: tuple[float, ...]
    line: Polyline
    ego_s_m: float
    turn: TurnType = TurnType.STRAIGHT

    @classmethod
    def of(
        cls,
        scene: Scene,
        graph: LaneGraph | None = None,
        *,
        turn: TurnType | None = None,
        via: str | None = None,
    ) -> EgoRoute | None:
        """The route of a scene's ego, None where the map has no lane for it or no `via`.

        Args:
            scene: Whose ego.
            graph: Of the scene, where there is one already.
            turn: Where the lanes part; None for the scenario's goal, else straight on.
            via: A lane or connector that it leads over, from the ego's lane or one abreast. A
                lane that neither leads to or from is a route of its own, from its point nearest
                to the ego on.
        """
        turn = turn or scene.options.goal or TurnType.STRAIGHT
        graph = LaneGraph(scene) if graph is None else graph
        own = find_ego_lane(scene, graph)
        if own is None or via not in (None, *graph.lanes):
            return None
        way, abreast = [own], graph.abreast(own)
        if via is not None:
            # From a lane abreast to it; else, as its way may lead here, from it to a lane abreast.
            way = graph.find_way(abreast, [via], _ROUND_M) or [via]
            if way == [via]:
                way = graph.find_way([via], abreast, _ROUND_M) or way
        own = next((name for name in abreast if name in way), way[0])
        lane_s_m = graph.lane(own).centerline.project(scene.ego.x_m, scene.ego.y_m).s_m
        before = _list_before(graph, way[0])
        after = graph.route(way[-1], lane_s_m + REACH_M, turn=turn)
        lane_ids = (*before, *way[:-1], *after)
        lines = [graph.lane(name).centerline for name in lane_ids]
        to_own = lines[: len(before) + way.index(own)]
        # Counted lane by lane: a projection may find another stretch of a winding route.
        ego_s_m = sum(line.length_m for line in to_own) + lane_s_m
        line = Polyline([point for line in lines for point in line.points_m.tolist()])
        if way == [via]:
            ego_s_m = line.project(scene.ego.x_m, scene.ego.y_m).s_m
        return cls(
            scene=scene,
            graph=graph,
            lane_id=own,
            lane_s_m=lane_s_m,
            lane_ids=lane_ids,
            # From the ego, as instructions count; negative behind it.
            ends_m=tuple(end - ego_s_m for end in accumulate(line.length_m for line in lines)),
            line=line,
            ego_s_m=ego_s_m,
            turn=turn,
        )

    def locate(self, x_m: float, y_m: float) -> RoutePosition:
        """Return the position of a point relative to the route."""
        beside = self.line.project(x_m, y_m)
        return RoutePosition(
            ahead_m=beside.s_m - self.ego_s_m,
            left_m=beside.d_m,
            tangent_rad=self.line.heading_at(beside.s_m),
        )

    def locate_agent(self, agent: TrafficAgent) -> RoutePosition:
        """Return the position of an agent's centre relative to the route."""
        return self.locate(agent.x_m, agent.y_m)

    def position(self, ahead_m: float, left_m: float = 0.0) -> Point:
        """The point so far ahead of the ego and left of the route."""
        return self.line.position(self.ego_s_m + ahead_m, left_m)

    def heading_at(self, ahead_m: float) -> float:
        """The direction of travel so far ahead of the ego, in radians."""
        return self.line.heading_at(self.ego_s_m + ahead_m)

    def lane_position(self, ahead_m: float) -> LanePosition | None:
        """The position on the lane that is so far ahead, None past the end of the lanes."""
        # The first lane that does not end before; at a joint that is the one before it.
        number = bisect_left(self.ends_m, ahead_m - _ROUNDED_M)
        if number == len(self.ends_m) or ahead_m < -self.ego_s_m - _ROUNDED_M:
            return None
        name = self.lane_ids[number]
        s_m = self.graph.lane(name).centerline.length_m - (self.ends_m[number] - ahead_m)
        return self.graph.place(name, s_m)


def find_ego_lane(scene: Scene, graph: LaneGraph) -> str | None:
    """The lane or connector that the ego names, else the one under it; None off every lane."""
    ego = scene.ego
    if ego.lane_id in graph.lanes:
        return ego.lane_id
    return graph.under(ego.x_m, ego.y_m, ego.heading_rad)


# Private


def _list_before(graph: LaneGraph, lane_id: str) -> Sequence[str]:
    """Ids of what leads to a lane, straightest, in the direction of travel, up to the reach."""
    names, total_m = [lane_id], 0.0
    while total_m < REACH_M:
        leading = [name for name in graph.predecessors(names[0]) if name not in names]
        if not leading:
            break
        names.insert(0, leading[0])
        total_m += graph.lane(leading[0]).centerline.length_m
    return names[:-1]
