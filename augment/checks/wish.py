"""Distance to the wish: how far each object is from the nearest placement that an intent admits.

What a sentence leaves open costs nothing: a range, a side without a number, either reading of an
ambiguous word. What it says counts without a tolerance. Objects of one request are held against
it together, requests in their order, so that what is counted from another object is counted from
where that one belongs. Headings and kinds are for the checks. Points are in the scene's frame.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from statistics import fmean

import numpy as np
import shapely

from augment.checks.ground import VEHICLES, Ground
from augment.checks.lanes_across import LanesAcross, find_picked, list_arms, resolve_spot
from augment.checks.parties import CRASH_M, Role, assign_parties, meets_route
from augment.checks.wish_motion import measure_placed
from augment.checks.wish_patterns import Chain, Link, Pattern, find_step_m
from augment.checks.wish_places import ACROSS_M, Place, Span, find_across, list_stations
from augment.checks.wish_shapes import find_nearest_cones, find_worker_ground
from augment.geometry.polyline import FloatArray
from augment.scene import intent as wish
from augment.scene.entities import Modification, Point, TrafficAgent
from augment.scene.planned_motion import MotionPreset
from augment.scene.presets import find_door_side, find_road_edge_m

ABREAST_M = 3.0
"""From one to the next of those who walk side by side, at most."""
_ASIDE_RAD = math.radians(45.0)
"""In front of, left of: nearer to that direction than to any other."""
BEARINGS_RAD: dict[wish.Bearing | None, float] = {
    wish.Bearing.AHEAD: 0.0,
    wish.Bearing.BEHIND: math.pi,
    wish.Bearing.LEFT: math.pi / 2.0,
    wish.Bearing.RIGHT: -math.pi / 2.0,
}
_DOOR_OFF_M = 0.25
"""How far off its car a closed door stands at most, as a slab beside it."""
_ARM_M, _WAITS_M = 100.0, 12.0
"""How far before a junction somebody comes from another arm; how far at most who waits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WishMatch:
    """One object, and where the nearest admitted placement has it.

    Attributes:
        agent_id: Whose.
        nearest_m: The admitted point.
        distance_m: From there, 0 where it is admitted where it stands.
    """

    agent_id: str
    nearest_m: Point
    distance_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class WishDistance:
    """A modification against its intent.

    Attributes:
        matches: One for each object that answers a request, in the order of the intent: what is
            added, then who is moved.
        missing: How many objects nothing stands for.
        surplus: Ids of added and moved agents that stand for nothing.
    """

    matches: tuple[WishMatch, ...] = ()
    missing: int = 0
    surplus: tuple[str, ...] = ()

    @property
    def distances_m(self) -> tuple[float, ...]:
        """The distance of every object."""
        return tuple(match.distance_m for match in self.matches)


def measure_wish(
    ground: Ground, modification: Modification, intent: wish.Intent
) -> WishDistance | None:
    """Return how far a modification is from what is asked for; None off every lane.

    None as well where the wish is open: a purpose has no place.

    Args:
        ground: Of the scene before the change.
        modification: The change; an empty one for an answer that was unreadable or refused.
        intent: What the instruction asks for.
    """
    lanes = LanesAcross.of(ground, intent.route)
    if lanes is None or intent.purpose is not None:
        return None
    case = assign_parties(ground, modification, intent, lanes)
    fitting, missing, matches = _Fitting(lanes), 0, list[WishMatch]()
    moves = modification.has_motion or any(
        getattr(party.request, "motion", None) for party in case.parties
    )
    motion = ground.motion_after(modification, of_all=False) if moves else None
    for number, party in enumerate(case.parties):
        request = party.request
        if number < len(intent.requests):
            request = fitting.resolve(intent.requests[number], request)
        # As in the displacement a bus stands for a car, but nothing else for another kind.
        stands_for = [
            agent
            for agent, role in party.mistyped
            if agent.type in VEHICLES and role in (Role.CAR, Role.BUS)
        ]
        missing += sum(number for _, number in party.missing)
        missing += len(party.mistyped) - len(stands_for)
        agents = [*party.agents, *stands_for]
        placed = fitting.place(request, agents) if agents else []
        there = {agent.id: point for agent, point in zip(agents, placed, strict=False)}
        there |= fitting.place_workers(request, party.workers, placed)
        matches += [
            WishMatch(
                agent_id=agent.id,
                nearest_m=there[agent.id],
                distance_m=measure_placed(
                    case,
                    motion,
                    request,
                    replace(agent, x_m=there[agent.id][0], y_m=there[agent.id][1]),
                    fitting.find_car(request),
                    fitting.place,
                ),
            )
            for agent in (*agents, *party.workers)
        ]
    named = {match.agent_id for match in matches}
    missing += len(case.to_move - named)
    surplus = tuple(agent.id for agent in modification.changed if agent.id not in named)
    return WishDistance(matches=tuple(matches), missing=missing, surplus=surplus)


class _Fitting:
    """Objects of one modification fitted to an intent, request by request."""

    def __init__(self, lanes: LanesAcross) -> None:
        self._lanes = self._own = lanes
        self._first: dict[str, TrafficAgent] = {}

    def resolve(self, request: wish.Request, counted: wish.Request) -> wish.Request:
        """Return the request with its distance counted from where its anchor belongs.

        Args:
            request: As the intent has it.
            counted: The same, counted from the ego; what it is for an anchor that is missing.
        """
        if isinstance(request, wish.DoorRequest):
            return replace(counted, spot=request.spot)  # its car is named there
        via = counted.spot.via
        anchor = self._first.get(request.spot.anchor or "")
        if anchor is None:
            return counted
        lanes = self._own.over(via) or self._own
        ahead_m = lanes.route.locate_agent(anchor).ahead_m
        there = wish.Spot(
            distance=wish.Length(low_m=abs(ahead_m), high_m=abs(ahead_m)),
            relation=wish.Relation.AHEAD if ahead_m >= 0.0 else wish.Relation.BEHIND,
            via=via,
        )
        spot = resolve_spot(request.spot, self._own, {request.spot.anchor or "": there})
        return replace(counted, spot=spot)

    def place(self, request: wish.Request, agents: Sequence[TrafficAgent]) -> list[Point]:
        """Return where each agent of the main role belongs."""
        self._lanes = self._own.over(request.spot.via) or self._own
        points = [(agent.x_m, agent.y_m) for agent in agents]
        match request:
            case wish.VehicleRequest():
                placed = self._place_vehicles(request, agents)
            case wish.WalkRequest():
                placed = self._place_walkers(request, agents)
            case wish.ConesRequest():
                count = request.count or len(agents)
                cones = find_nearest_cones(request, count, self._lanes, np.array(points))
                placed = [(x_m, y_m) for x_m, y_m in cones.tolist()]
            case wish.CrashRequest():
                placed = self._place_crash(request, agents)
            case wish.DoorRequest():
                placed = [self._place_door(request, point) for point in points]
        moved = (
            replace(agent, x_m=x_m, y_m=y_m)
            for agent, (x_m, y_m) in zip(agents, placed, strict=True)
        )
        if request.name:
            self._first[request.name] = min(moved, key=self._ahead_m)
        return placed

    def place_workers(
        self, request: wish.Request, workers: Sequence[TrafficAgent], cones: Sequence[Point]
    ) -> dict[str, Point]:
        """Return by id where the workers belong beside cones that stand where they belong."""
        if not isinstance(request, wish.ConesRequest) or not cones:
            return {worker.id: (worker.x_m, worker.y_m) for worker in workers}
        ordered = sorted(cones, key=lambda cone: self._lanes.route.locate(*cone).ahead_m)
        ground = find_worker_ground(request, np.array(ordered), self._lanes)
        return {worker.id: _find_nearest(ground, (worker.x_m, worker.y_m)) for worker in workers}

    # Private

    def _ahead_m(self, agent: TrafficAgent) -> float:
        return self._lanes.route.locate_agent(agent).ahead_m

    def _place_vehicles(
        self, request: wish.VehicleRequest, agents: Sequence[TrafficAgent]
    ) -> list[Point]:
        points = [(agent.x_m, agent.y_m) for agent in agents]
        if request.spot == wish.Spot() and request.spacing is None:
            return [self._place_open(request, agent) for agent in agents]
        # The spot is that of the first along the lane.
        first = min(range(len(agents)), key=lambda index: self._ahead_m(agents[index]))
        place = Place.of(request.spot, self._lanes, agents[first].width_m)
        if request.spacing is None or len(agents) == 1:
            there = place.nearest(points[first])
            # The others stand further on, who knows how far.
            begins_m = self._lanes.route.locate(*there).ahead_m
            onwards = replace(place, stations_m=((begins_m, math.inf),))
            others = [onwards.nearest(point) for point in points]
            return [*others[:first], there, *others[first + 1 :]]
        gap_m = request.spacing.span_m
        count, route = request.count or len(agents), self._lanes.route

        # Numbers: the first station and the gap; of each vehicle the two ends across its lane,
        # (count, 2, 2).
        def slots(numbers: FloatArray, is_straight: bool) -> FloatArray:
            ahead_m, step_m = numbers.tolist()
            ends = []
            for _ in range(count):
                span_m = place.across(ahead_m) or (-ACROSS_M, ACROSS_M)
                ends.append([route.position(ahead_m, left_m) for left_m in span_m])
                middle = partial(route.position, left_m=fmean(span_m))
                if is_straight:
                    step_m = find_step_m(middle, middle(ahead_m), ahead_m, float(numbers[1]))
                ahead_m += step_m
            return np.array(ends)

        guess = (self._ahead_m(agents[first]), fmean(gap_m))
        tries = [
            # Both readings of a gap: along the lane, and from centre to centre.
            Pattern(
                ranges=(stations_m, gap_m), slots=partial(slots, is_straight=is_straight)
            ).nearest(np.array(points), guess)
            for stations_m in place.stations_m
            for is_straight in (False, True)
        ]
        best = min(tries, key=lambda tried: float(np.hypot(*(tried - points).T).sum()))
        return [(x_m, y_m) for x_m, y_m in best.tolist()]

    def _place_open(self, request: wish.VehicleRequest, agent: TrafficAgent) -> Point:
        """Return where one belongs of whom no place is said: where he is or was, or an arm."""
        before = {before.id: before for before in self._lanes.route.scene.agents}
        stands, motion = before.get(agent.id, agent), request.motion
        here = stands.x_m, stands.y_m
        if agent.id in before or motion is None or motion.preset is not MotionPreset.RED_LIGHT:
            return here
        graph, reach_m = self._lanes.route.graph, _WAITS_M if request.speed_mps == 0.0 else _ARM_M
        pieces = []
        for arm in list_arms(self._lanes, motion.side):
            lane = graph.lane(arm.lane_id)
            places = (
                graph.along(arm.lane_id, lane.centerline.length_m, -before_m)
                # Back along the lanes from the junction, a point a metre.
                for before_m in np.arange(0.0, reach_m, 1.0).tolist()
            )
            line = [place.pose.beside(0.0) for place in places if place is not None]
            ground = shapely.LineString(line).buffer(lane.width_m / 2.0, cap_style="flat")
            pieces.append(ground)
        return _find_nearest(shapely.union_all(pieces), here) if pieces else here

    def _place_walkers(
        self, request: wish.WalkRequest, agents: Sequence[TrafficAgent]
    ) -> list[Point]:
        """Return where they belong: they begin at the spot, or meet the ego's way there."""
        lanes, points = self._lanes, [(agent.x_m, agent.y_m) for agent in agents]
        ends = sorted((0.0, request.start.sign)) if request.start else (-1.0, 1.0)

        def beside(ahead_m: float) -> Span:
            lateral, band = request.spot.lateral, lanes.band(wish.LaneChoice.OWN, ahead_m)
            if band is not None and (request.on_road or lateral is not None):
                return find_across(lateral, lanes.side_sign(lateral), band.width_m, 0.0)
            side = request.start
            if side is None or request.motion is None:
                return ends[0] * ACROSS_M, ends[-1] * ACROSS_M
            # There he waits; a side road has no edge on it, so anywhere on that side.
            edge_m = find_road_edge_m(lanes.route, ahead_m, side.sign) % ACROSS_M
            low_m, high_m = sorted((side.sign * edge_m, side.sign * (edge_m + ACROSS_M)))
            return low_m, high_m

        stations_m = list_stations(request.spot, lanes)
        begins = Place(lanes=lanes, stations_m=stations_m, across=beside)
        tries = [self._chain(request, agents, begins, points)]
        meetings = [meets_route(lanes.route, agent) for agent in agents]
        if all(meetings):
            meets = Place(lanes=lanes, stations_m=stations_m, across=lambda _: (0.0, 0.0))
            met = [point for point in meetings if point is not None]
            there = self._chain(request, agents, meets, met)
            tries.append(
                [
                    # A walk is moved as a whole, by as much as its meeting is off.
                    (x + to[0] - at[0], y + to[1] - at[1])
                    for (x, y), at, to in zip(points, met, there, strict=True)
                ]
            )
        return min(tries, key=lambda tried: sum(map(math.dist, tried, points)))

    def _chain(
        self,
        request: wish.WalkRequest,
        agents: Sequence[TrafficAgent],
        first: Place,
        points: Sequence[Point],
    ) -> list[Point]:
        lane_rad = self._lanes.route.heading_at(self._lanes.route.locate(*points[0]).ahead_m)
        behind = request.behind if request.is_file else ()
        side = request.start
        links = [
            Link(
                base=0,
                gap_m=gap.span_m,
                # In file they stand further towards the side that they come from.
                toward_rad=lane_rad + (side.sign if side else 0.0) * math.pi / 2.0,
                aside_rad=_ASIDE_RAD if side else math.pi,
            )
            for gap in behind[: len(agents) - 1]
        ]
        abreast = range(len(links), len(agents) - 1)
        links += [Link(base=index, gap_m=(0.0, ABREAST_M)) for index in abreast]
        return Chain(first=first.nearest, links=tuple(links)).nearest(points)

    def _place_crash(
        self, request: wish.CrashRequest, agents: Sequence[TrafficAgent]
    ) -> list[Point]:
        place = Place.of(request.spot, self._lanes, agents[0].width_m)
        said = [*request.others, *[wish.CrashedCar()] * len(agents)][: len(agents) - 1]
        touching_m = max(CRASH_M, *(agent.length_m for agent in agents))
        lane_rad = self._lanes.route.heading_at(min(map(self._ahead_m, agents)))
        links = tuple(
            Link(
                base=index,
                gap_m=other.gap.span_m if other.gap else (0.0, touching_m),
                toward_rad=lane_rad + BEARINGS_RAD.get(other.bearing, 0.0),
                aside_rad=_ASIDE_RAD if other.bearing else math.pi,
            )
            for index, other in enumerate(said)
        )
        points = [(agent.x_m, agent.y_m) for agent in agents]
        return Chain(first=place.nearest, links=links).nearest(points)

    def find_car(self, request: wish.Request) -> TrafficAgent | None:
        """Return the car of a door where it belongs; None where there is none."""
        spot = request.spot
        if not isinstance(request, wish.DoorRequest):
            return None
        if spot.landmark is None:
            return self._first.get(spot.anchor or "")
        return next(iter(find_picked(self._lanes, spot.landmark)), None)

    def _place_door(self, request: wish.DoorRequest, point: Point) -> Point:
        """Return where a door belongs: along its car, on the side where the ego comes past."""
        car = self.find_car(request)
        if car is None:
            return point
        side = find_door_side(car, self._lanes.route.locate_agent(car))
        near_m, far_m = car.width_m / 2.0, car.width_m / 2.0 + _DOOR_OFF_M
        half_m = car.length_m / 2.0
        # Ahead and out of that side, in the car's frame.
        corners = [(-half_m, near_m), (half_m, near_m), (half_m, far_m), (-half_m, far_m)]
        ground = car.pose.to_parent(np.array([(x_m, side * y_m) for x_m, y_m in corners]))
        return _find_nearest(shapely.Polygon(ground), point)


def _find_nearest(ground: shapely.Geometry, point: Point) -> Point:
    """Return the nearest point of a piece of ground, the same where it lies on it."""
    if shapely.is_empty(ground) or shapely.covers(ground, shapely.Point(point)):
        return point
    way = shapely.shortest_line(ground, shapely.Point(point))
    (x_m, y_m), _ = shapely.get_coordinates(way).tolist()
    return x_m, y_m
