"""Ground and motion of a scene before and after a change, as the checks need them.

Frame: the scene's. Places relative to the ego go by its pose, wherever that is.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray

from augment.geometry.frames import Box
from augment.geometry.polyline import FloatArray
from augment.scene import entities
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AnyLane
from augment.scene.lane_graph import Beside, LaneGraph, best_aligned
from augment.scene.motion import Expectation, Motion, Movement, find_motion, with_movers_alone

SEAM_M = 0.3
"""A gap between two pieces of ground up to this long is a seam of the map, not an edge."""
VEHICLES = frozenset(
    {entities.AgentType.VEHICLE, entities.AgentType.BUS, entities.AgentType.EGO_VEHICLE}
)
CRASH_GAP_M = 1.5
"""Between cars of one accident; those placed by hand for interPlan are up to 1.43 m apart."""
# Least length and width of a box.
_SMALLEST_M = 0.01
_WALKS = (entities.AreaKind.WALKWAY, entities.AreaKind.CROSSWALK)


class Surface:
    """The union of polygons, which are joined only where somebody asks.

    Lanes go by their boundaries where the map has both, else by their width. An area that
    crosses itself is taken as the ground that it encloses.
    """

    def __init__(self, lanes: Iterable[AnyLane] = (), areas: Iterable[entities.Area] = ()) -> None:
        pieces = np.concatenate([strips(list(lanes)), rings(list(areas))])
        self._pieces = pieces[~shapely.is_empty(pieces)]
        self._tree = shapely.STRtree(self._pieces)
        self.is_empty = len(self._pieces) == 0

    def share_outside(self, corners_m: FloatArray) -> float:
        """Return the part, 0 to 1, of a box with the corners (4, 2) that lies off the surface."""
        box = shapely.Polygon(corners_m)
        near = self._pieces[self._tree.query(box, predicate="intersects")]
        if any(piece.covers(box) for piece in near):
            return 0.0
        # Joined first: where pieces overlap, their shares would count twice.
        left = float(shapely.difference(box, shapely.union_all(near)).area) / float(box.area)
        return min(1.0, max(0.0, left))

    def distance_m(self, x_m: float, y_m: float) -> float:
        """Return the way from a point to the surface, 0 on it; infinite where there is none."""
        if self.is_empty:
            return math.inf
        point = shapely.Point(x_m, y_m)
        _, distances = self._tree.query_nearest(point, return_distance=True, all_matches=False)
        return float(distances[0])

    def within(self, area: shapely.Geometry) -> shapely.Geometry:
        """Return the part of the surface in an area, without seams between its pieces."""
        return shapely.intersection(self._joined, area)

    def edge_m(self, x_m: float, y_m: float) -> float | None:
        """Return the way from a point to the edge, negative off the surface; None without one."""
        if self.is_empty:
            return None
        point = shapely.Point(x_m, y_m)
        apart_m = float(shapely.distance(shapely.boundary(self._joined), point))
        return apart_m if shapely.covers(self._joined, point) else -apart_m

    @cached_property
    def _joined(self) -> shapely.Geometry:
        """All pieces as one, without the seams between them."""
        half_m = SEAM_M / 2.0
        # Grown by half a seam and shrunk again: gaps up to a seam close, edges stay.
        grown = shapely.buffer(self._pieces, half_m, quad_segs=2)
        return shapely.buffer(shapely.union_all(grown), -half_m, quad_segs=2)

    def reach_m(self, x_m: float, y_m: float, heading_rad: float, most_m: float) -> float | None:
        """Return how far the surface goes on from a point in a direction, up to `most_m`.

        Neighbouring pieces seldom meet exactly: gaps up to `SEAM_M` are passed over. None where
        the point is not on the surface, or the surface ends nowhere within `most_m`.
        """
        reached_m = 0.0
        is_on = False
        # In order of their beginning: the first gap wider than a seam ends the surface.
        for low_m, high_m in self._spans_m(x_m, y_m, heading_rad, most_m):
            if low_m > reached_m + SEAM_M:
                break
            is_on = is_on or high_m >= 0.0
            reached_m = max(reached_m, high_m)
        return reached_m if is_on and reached_m < most_m - SEAM_M else None

    def begins_m(self, x_m: float, y_m: float, heading_rad: float, most_m: float) -> float | None:
        """Return how far off a point the surface begins in a direction, 0 on it.

        None where it begins nowhere within `most_m`.
        """
        spans = self._spans_m(x_m, y_m, heading_rad, most_m)
        return next((max(0.0, low_m) for low_m, high_m in spans if high_m > 0.0), None)

    def _spans_m(
        self, x_m: float, y_m: float, heading_rad: float, most_m: float
    ) -> list[tuple[float, float]]:
        """From where to where each piece lies under a ray; it begins a seam behind its point."""
        step = np.array([math.cos(heading_rad), math.sin(heading_rad)])
        start = np.array([x_m, y_m])
        # A seam further back, for a point that stands on one.
        ray = shapely.LineString([start - SEAM_M * step, start + most_m * step])
        near = self._pieces[self._tree.query(ray, predicate="intersects")]
        parts = shapely.get_parts(shapely.intersection(near, ray))
        # What only touches the ray leaves a point.
        parts = parts[shapely.get_type_id(parts) == shapely.GeometryType.LINESTRING]
        # Metres along the ray, (p - start) . step, negative behind the start.
        spans = (((shapely.get_coordinates(part) - start) @ step).tolist() for part in parts)
        return sorted((min(span), max(span)) for span in spans)


def strips(lanes: Sequence[AnyLane]) -> NDArray[np.object_]:
    """Return one polygon a lane."""
    made = np.full(len(lanes), None, dtype=object)
    for index, lane in enumerate(lanes):
        left, right = lane.left_boundary, lane.right_boundary
        if left is not None and right is not None:
            made[index] = shapely.Polygon(np.concatenate([left.points_m, right.points_m[::-1]]))
    # Those without an outline, and those whose outline crosses itself.
    for index in np.flatnonzero(~shapely.is_valid(made)).tolist():
        line = shapely.LineString(lanes[index].centerline.points_m)
        half_m = lanes[index].width_m / 2.0
        made[index] = line.buffer(half_m, cap_style="flat", quad_segs=4)
    return made


def rings(areas: Sequence[entities.Area]) -> NDArray[np.object_]:
    """Return one geometry an area."""
    made = np.empty(len(areas), dtype=object)
    made[:] = [shapely.Polygon(area.boundary_m) for area in areas]
    crossing = ~shapely.is_valid(made)
    # A buffer of nothing keeps the polygons and drops the lines that mending may leave.
    made[crossing] = shapely.buffer(shapely.make_valid(made[crossing]), 0.0)
    return made


@dataclass(frozen=True, kw_only=True, eq=False)
class Ground:
    """The lanes and surfaces of one scene, laid out when they are first asked for.

    Attributes:
        scene: The scene before the change.
        graph: Its lanes and connectors.
        expect: Returns what is expected after t0; asked only where something moves.
    """

    scene: entities.Scene
    graph: LaneGraph
    expect: Expectation

    @classmethod
    def of(
        cls, scene: entities.Scene, expect: Expectation = lambda scene, modification: None
    ) -> "Ground":
        """Return the ground of a scene, by default one without a recording."""
        return cls(scene=scene, graph=LaneGraph(scene), expect=expect)

    def motion_after(self, modification: entities.Modification, *, of_all: bool = True) -> Motion:
        """Return everybody's motion after a change, including agents recorded later.

        Args:
            modification: The change.
            of_all: False for the ego, who is changed, who has a motion and whom those wait for.

        Raises:
            InvalidModification: The modification does not fit the scene.
        """
        after = entities.apply(self.scene, modification)
        if not of_all:
            after = with_movers_alone(after, {agent.id for agent in modification.changed})
        recording = self.expect(self.scene, modification)
        return find_motion(after, recording=recording, with_later=of_all)

    def _areas(self, *kinds: entities.AreaKind) -> list[entities.Area]:
        return [area for area in self.scene.areas if area.kind in kinds]

    @cached_property
    def road(self) -> Surface:
        """Surface on which vehicles may stand."""
        return Surface(self.graph.lanes.values(), self._areas(*entities.DRIVEN_ON))

    @cached_property
    def everything(self) -> Surface:
        """Everything that the map shows: the road, walkways and crosswalks."""
        return Surface(self.graph.lanes.values(), self._areas(*entities.DRIVEN_ON, *_WALKS))

    @cached_property
    def carparks(self) -> Surface:
        """Surface on which vehicles stand in any direction."""
        return Surface(areas=self._areas(entities.AreaKind.CARPARK))

    @cached_property
    def walkways(self) -> Surface:
        """Surface beside the road for pedestrians; empty if the map has none."""
        return Surface(areas=self._areas(entities.AreaKind.WALKWAY))

    @cached_property
    def route(self) -> EgoRoute | None:
        """The ego's path over lanes, None where the map has no lane for it."""
        return EgoRoute.of(self.scene, self.graph)


@dataclass(frozen=True, kw_only=True, eq=False)
class ChangedScene:
    """A scene after its change, with what several checks need worked out once.

    Attributes:
        ground: The scene before the change.
        modification: The change.
        everyone: All agents after the change, the ego first.
    """

    ground: Ground
    modification: entities.Modification
    everyone: tuple[entities.TrafficAgent, ...]

    @classmethod
    def of(cls, ground: Ground, modification: entities.Modification) -> "ChangedScene":
        """Return the modification on its ground.

        Raises:
            InvalidModification: It does not fit the scene.
        """
        after = entities.apply(ground.scene, modification)
        return cls(ground=ground, modification=modification, everyone=after.everyone)

    @property
    def changed(self) -> tuple[entities.TrafficAgent, ...]:
        """The added and the moved agents, which the findings are about."""
        return self.modification.changed

    @cached_property
    def motion(self) -> Motion:
        """Everybody's motion after the change."""
        return self.ground.motion_after(self.modification)

    @cached_property
    def planned(self) -> dict[str, Movement]:
        """The changed agents with a motion, by id; without one nobody's is worked out."""
        names = [agent.id for agent in self.changed if agent.motion is not None]
        by_id = {movement.agent.id: movement for movement in self.motion.others} if names else {}
        return {name: by_id[name] for name in names}

    @cached_property
    def boxes(self) -> dict[str, Box]:
        """Everybody's box, by id; none is so small that it has no area to be shared."""
        return {
            agent.id: replace(
                agent.box,
                length_m=max(agent.length_m, _SMALLEST_M),
                width_m=max(agent.width_m, _SMALLEST_M),
            )
            for agent in self.everyone
        }

    @cached_property
    def under(self) -> dict[str, Beside | None]:
        """The lane under each changed agent, by id; of several the one that fits its heading."""
        return {
            agent.id: best_aligned(
                [place for place in self._beside[agent.id] if place.covers], agent.heading_rad
            )
            for agent in self.changed
        }

    @cached_property
    def nearest(self) -> dict[str, Beside | None]:
        """The lane whose edge is nearest to each changed agent, by id; None without lanes."""
        return {
            name: min(
                places,
                key=lambda place: (round(place.off_m, 4), round(place.distance_m, 4)),
                default=None,
            )
            for name, places in self._beside.items()
        }

    @cached_property
    def _beside(self) -> dict[str, tuple[Beside, ...]]:
        graph = self.ground.graph
        return {agent.id: graph.beside(agent.x_m, agent.y_m) for agent in self.changed}

    def new_pairs(self) -> Iterator[tuple[entities.TrafficAgent, entities.TrafficAgent]]:
        """Yield every pair with a changed agent in it, that one first, each once."""
        done: set[str] = set()
        for agent in self.changed:
            done.add(agent.id)
            yield from ((agent, other) for other in self.everyone if other.id not in done)

    def measure_gaps(
        self, agents: Sequence[entities.TrafficAgent], others: Sequence[entities.TrafficAgent]
    ) -> FloatArray:
        """Return metres between boxes, (agents, others); infinite from one to itself."""
        boxes, other_boxes = (
            np.array([shapely.Polygon(self.boxes[agent.id].corners_m) for agent in some])
            for some in (agents, others)
        )
        gaps_m = np.asarray(shapely.distance(boxes[:, None], other_boxes), dtype=np.float64)
        names, other_names = (np.array([agent.id for agent in some]) for some in (agents, others))
        return np.where(names[:, None] == other_names, np.inf, gaps_m)

    @cached_property
    def crashed(self) -> frozenset[str]:
        """Changed vehicles that stand so close to another changed one that they look crashed."""
        cars = [agent for agent in self.changed if agent.type in VEHICLES and agent.is_stopped]
        if len(cars) < 2:
            return frozenset()
        near = self.measure_gaps(cars, cars).min(axis=1) <= CRASH_GAP_M
        return frozenset(car.id for car, is_near in zip(cars, near, strict=True) if is_near)
