"""What the checks know about a scene before anybody changes it; made once, asked often.

Frame: the scene's. Places relative to the ego go by its pose, wherever that is.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from functools import cached_property

from augment.checks.ground import LaneIndex, Surface
from augment.scene.ego_route import REACH_M, EgoRoute
from augment.scene.entities import AreaKind, Scene
from augment.scene.lane_graph import LaneGraph

_ROAD = (AreaKind.DRIVABLE, AreaKind.CARPARK, AreaKind.INTERSECTION)
_WALKS = (AreaKind.WALKWAY, AreaKind.CROSSWALK)


@dataclass(frozen=True, kw_only=True, eq=False)
class Ground:
    """The lanes and surfaces of one scene, and the ego on them.

    Attributes:
        scene: The scene before the change.
        graph: What follows what.
        lanes: Where every lane and connector lies.
    """

    scene: Scene
    graph: LaneGraph
    lanes: LaneIndex

    @classmethod
    def of(cls, scene: Scene) -> Ground:
        """The ground of a scene; surfaces are laid out when they are first asked for."""
        graph = LaneGraph(scene)
        return cls(scene=scene, graph=graph, lanes=LaneIndex(graph.lanes.values()))

    @cached_property
    def road(self) -> Surface:
        """What vehicles may stand on."""
        areas = (area for area in self.scene.areas if area.kind in _ROAD)
        return Surface.of(self.graph.lanes.values(), areas)

    @cached_property
    def everything(self) -> Surface:
        """Everything that the map shows: the road, walkways and crosswalks."""
        return self.road.with_areas(area for area in self.scene.areas if area.kind in _WALKS)

    @cached_property
    def carparks(self) -> Surface:
        """Where vehicles stand in any direction."""
        return Surface.of(areas=(a for a in self.scene.areas if a.kind is AreaKind.CARPARK))

    @cached_property
    def walkways(self) -> Surface:
        """Where people walk beside the road; empty where the map does not say."""
        return Surface.of(areas=(a for a in self.scene.areas if a.kind is AreaKind.WALKWAY))

    @cached_property
    def route(self) -> EgoRoute | None:
        """The ego's path over lanes, None where the map has no lane for it."""
        return EgoRoute.of(self.scene, self.graph)

    @cached_property
    def starts_m(self) -> tuple[tuple[str, float], ...]:
        """How far ahead of the ego lanes begin, measured along the lanes: id and metres.

        Successors of the ego's lane are followed forwards, predecessors backwards, both up to
        `REACH_M`. On a loop a lane comes twice: once ahead, once behind.
        """
        if self.route is None:
            return ()
        lane_id, begins_m = self.route.lane_id, -self.route.lane_s_m
        ahead = self._reached(lane_id, begins_m, forwards=True)
        behind = self._reached(lane_id, begins_m, forwards=False)
        return (*ahead.items(), *behind.items())

    def _reached(self, lane_id: str, start_m: float, *, forwards: bool) -> dict[str, float]:
        """Dijkstra over whole lanes: the signed distance from the ego to each lane's start."""
        lengths = {name: lane.centerline.length_m for name, lane in self.graph.lanes.items()}
        starts_m: dict[str, float] = {}
        queue = [(abs(start_m), lane_id, start_m)]
        while queue:
            _, here, begins_m = heapq.heappop(queue)
            if here in starts_m:
                continue
            starts_m[here] = begins_m
            following = self.graph.successors(here) if forwards else self.graph.predecessors(here)
            for name in following:
                next_m = begins_m + lengths[here] if forwards else begins_m - lengths[name]
                if name not in starts_m and -REACH_M - lengths[name] < next_m < REACH_M:
                    heapq.heappush(queue, (abs(next_m), name, next_m))
        return starts_m
