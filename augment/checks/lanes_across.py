"""The lanes across the ego's route, and where on it what an intent names is.

Lanes are its own, those left and right of it, and the oncoming one. Frames: the scene's, and that
of `EgoRoute`: ahead along the route from the ego, left across it in its direction of travel.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
import shapely

from augment.checks.ground import VEHICLES, Ground
from augment.geometry.frames import difference
from augment.scene import entities
from augment.scene import intent as intents
from augment.scene.ego_route import EgoRoute, RoutePosition
from augment.scene.lane_graph import Beside, LanePosition
from augment.scene.presets import find_crossing

_SAME_LANE_M = 1.0
"""A lane whose centre is nearer than this is the same lane."""
_ALONG_RAD, _AGAINST_RAD = math.radians(45.0), math.radians(135.0)
# So far past its end a lane still counts as beside the route.
_JOINT_M = 1.0
_BESIDE_M = 15.0
"""Who is further from the route is on another road; prompts show as much beside it."""
# Who is left or right of the ego's way is at least so far off it.
_ON_A_SIDE_M = 1.0
_ALIGNED_RAD = math.radians(15.0)
_MOST_BANDS = 20_000
"""So many stations of a scene are kept."""
_MISSED_M = 0.1
"""A place that leads further from its point than this does not tell where the point is."""
_SIGHTS = {
    **dict.fromkeys((intents.Sight.VEHICLE, intents.Sight.PARKED, intents.Sight.MOVING), VEHICLES),
    intents.Sight.BUS: {entities.AgentType.BUS},
    intents.Sight.BICYCLE: {entities.AgentType.BICYCLE},
    intents.Sight.PEDESTRIAN: {entities.AgentType.PEDESTRIAN},
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """A lane at one station: where its centre is, left of the route, and how it runs there."""

    lane_id: str
    left_m: float
    width_m: float
    tangent_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LanePlace:
    """A point by the lane that it lies on or beside.

    Attributes:
        via: The lane of the map to which the way leads; None on the ego's route.
        route: The way.
        lane: A lane of the way, or one beside it.
        ahead_m: From the ego along the way.
        left_m: From the middle of the lane, in the way's direction of travel.
        off_m: From the edge of the lane to the point, 0 on it.
        tangent_rad: The direction of the lane.
    """

    via: str | None
    route: EgoRoute
    lane: intents.LaneChoice
    ahead_m: float
    left_m: float
    off_m: float
    tangent_rad: float


@dataclass(frozen=True, kw_only=True, eq=False)
class LanesAcross:
    """The ego's route, and the lanes that lie beside it at any station."""

    route: EgoRoute
    _over: dict[str, "LanesAcross | None"] = field(default_factory=dict, init=False)
    _bands: dict[tuple[intents.LaneChoice, float], Band | None] = field(
        default_factory=dict, init=False
    )

    @classmethod
    @lru_cache(maxsize=4)
    def of(
        cls, ground: Ground, turn: entities.TurnType = entities.TurnType.STRAIGHT
    ) -> "LanesAcross | None":
        """Return those of the ground's ego, None where the map has no lane for it.

        Args:
            ground: Of the scene.
            turn: Which way the route goes where the lanes part.
        """
        route = ground.route
        if turn is not entities.TurnType.STRAIGHT:
            route = EgoRoute.of(ground.scene, ground.graph, turn=turn)
        return None if route is None else cls(route=route)

    def over(self, via: str | None) -> "LanesAcross | None":
        """Return those across the way to a lane, None where the map has no such lane."""
        if via is None:
            return self
        if via not in self._over:
            route = EgoRoute.of(self.route.scene, self.route.graph, turn=self.route.turn, via=via)
            self._over[via] = None if route is None else LanesAcross(route=route)
        return self._over[via]

    @property
    def kerb(self) -> float:
        """On which side of the ego's lane the kerb is: 1 left, -1 right."""
        return 1.0 if self.route.scene.traffic_side is entities.TrafficSide.LEFT else -1.0

    def band(self, choice: intents.LaneChoice, ahead_m: float) -> Band | None:
        """Return the lane of that choice, None where there is none there."""
        key = choice, ahead_m
        if key not in self._bands and len(self._bands) < _MOST_BANDS:
            self._bands[key] = self._find_band(choice, ahead_m)
        return self._bands[key] if key in self._bands else self._find_band(choice, ahead_m)

    def _find_band(self, choice: intents.LaneChoice, ahead_m: float) -> Band | None:
        tangent_rad = self.route.heading_at(ahead_m)
        if choice is intents.LaneChoice.OWN:
            own = self.route.lane_position(ahead_m)
            if own is None:
                return None
            width_m = self.route.graph.lane(own.lane_id).width_m
            return Band(lane_id=own.lane_id, left_m=0.0, width_m=width_m, tangent_rad=tangent_rad)
        near = self.route.graph.beside(*self.route.position(ahead_m))
        # The nearest, and at a joint the one that has not ended.
        beside = sorted(near, key=lambda lane: (round(abs(lane.d_m), 2), lane.beyond_m))
        bands = (band for lane in beside if (band := _band(lane, tangent_rad, choice)))
        return next(bands, None)

    def place(self, choice: intents.LaneChoice, ahead_m: float) -> LanePosition | None:
        """Return the place on a lane next to one on the ego's own, None where there is none.

        There it is the nearest point of the lane's centre.
        """
        own = self.route.lane_position(ahead_m)
        if own is None or choice is intents.LaneChoice.OWN:
            return own
        band = self.band(choice, ahead_m)
        if band is None:
            return None
        line = self.route.graph.lane(band.lane_id).centerline
        s_m = line.project(own.pose.x_m, own.pose.y_m).s_m
        return self.route.graph.place(band.lane_id, s_m)

    def side_sign(
        self, lateral: intents.Lateral | None, lane: intents.LaneChoice | None = None
    ) -> float:
        """Return 1 for left of the ego's direction, -1 for right, 0 for the lane's centre."""
        # The oncoming lane has its kerb where the ego's has the centre line.
        kerb = -self.kerb if lane is intents.LaneChoice.ONCOMING else self.kerb
        signs = {
            intents.LateralTarget.LEFT_BOUNDARY: 1.0,
            intents.LateralTarget.RIGHT_BOUNDARY: -1.0,
            intents.LateralTarget.KERB: kerb,
            intents.LateralTarget.CENTRE_LINE: -kerb,
        }
        return signs.get(lateral.target, 0.0) if lateral else 0.0


def _band(lane: Beside, tangent_rad: float, choice: intents.LaneChoice) -> Band | None:
    """A lane beside the own one as one of the choice, None where it is not."""
    turn_rad = abs(difference(lane.tangent_rad, tangent_rad))
    is_along, is_against = turn_rad < _ALONG_RAD, turn_rad > _AGAINST_RAD
    # d_m is the route's point seen from the lane: the lane lies on the other side of it, and a
    # lane that runs against the route has its left on the route's right.
    left_m = lane.d_m if is_against else -lane.d_m
    fits = {
        intents.LaneChoice.LEFT: is_along and left_m > 0.0,
        intents.LaneChoice.RIGHT: is_along and left_m < 0.0,
        intents.LaneChoice.ONCOMING: is_against,
    }
    if lane.beyond_m > _JOINT_M or abs(left_m) < _SAME_LANE_M or not fits[choice]:
        return None
    return Band(
        lane_id=lane.lane_id, left_m=left_m, width_m=lane.width_m, tangent_rad=lane.tangent_rad
    )


def find_place(
    lanes: LanesAcross, point: entities.Point, heading_rad: float | None = None
) -> LanePlace:
    """Return where a point lies along the lane that it is on, else along the nearest one.

    The ego's route and the lanes beside it come first, then the way to the lane that fits the
    heading best. A place has to lead back to the point: on the outside of a bend some don't.
    """

    def misfit(lane: Beside) -> tuple[float, float, float]:
        wanted_rad = lane.tangent_rad if heading_rad is None else heading_rad
        turn_rad = difference(lane.tangent_rad, wanted_rad)
        # Whole metres and steps of 15 degrees: less does not outweigh the next key.
        return round(lane.off_m), round(abs(turn_rad) / _ALIGNED_RAD), lane.distance_m

    near = sorted(lanes.route.graph.beside(*point), key=misfit)
    ways = [(None, 0.0), *((lane.lane_id, round(lane.off_m)) for lane in near)]
    places = list[tuple[float, LanePlace]]()
    for via, off_m in ways:
        # Lanes come nearest first: none of the rest can be better than what there is.
        if any(cost <= off_m for cost, _ in places):
            break
        for place, missed_m in _list_places(lanes.over(via), via, point):
            is_missed = missed_m > _MISSED_M
            # What does not lead back to the point counts as if it were on another road.
            places.append((round(place.off_m) + _BESIDE_M * is_missed, place))
    return min(places, key=lambda item: item[0])[1]


def find_place_along(lanes: LanesAcross, via: str | None, point: entities.Point) -> LanePlace:
    """Return where a point lies along a way's own lane, however far beside it."""
    return next(_list_places(lanes.over(via), via, point))[0]


def _list_places(
    lanes: LanesAcross | None, via: str | None, point: entities.Point
) -> Iterator[tuple[LanePlace, float]]:
    """Yield a point's place by each lane of a way, and how far from it that place leads."""
    if lanes is None:
        return
    route = lanes.route
    here = route.locate(*point)
    for choice in intents.LaneChoice:
        band, place = lanes.band(choice, here.ahead_m), lanes.place(choice, here.ahead_m)
        if band is None or place is None:
            continue
        left_m = here.left_m - band.left_m
        side = -1.0 if choice is intents.LaneChoice.ONCOMING else 1.0
        there = route.graph.place(place.lane_id, place.s_m, side * left_m).pose
        spot = LanePlace(
            via=via,
            route=route,
            lane=choice,
            ahead_m=here.ahead_m,
            left_m=left_m,
            off_m=max(0.0, abs(left_m) - band.width_m / 2.0),
            tangent_rad=band.tangent_rad,
        )
        yield spot, math.dist(point, (there.x_m, there.y_m))


def find_picked(lanes: LanesAcross, pick: intents.Pick) -> tuple[entities.TrafficAgent, ...]:
    """Return who is meant: one, or all of `every`; empty where nobody fits."""
    sign = 1.0 if pick.relation is intents.Relation.AHEAD else -1.0
    agents = []
    for agent in lanes.route.scene.agents:
        place = lanes.route.locate_agent(agent)
        if sign * place.ahead_m > 0.0 and _fits(lanes, pick, agent, place):
            agents.append((sign * place.ahead_m, agent.id, agent))
    ordered = tuple(agent for _, _, agent in sorted(agents, key=lambda entry: entry[:2]))
    return ordered if pick.every else ordered[pick.ordinal - 1 : pick.ordinal]


def find_mark(lanes: LanesAcross, mark: intents.MapPlace) -> float | None:
    """Return how far ahead of the ego a place of the map is, None where there is none ahead."""
    if mark is intents.MapPlace.CROSSWALK:
        return next((sum(ends_m) / 2.0 for ends_m in list_crosswalks(lanes)), None)
    route, begins_m = lanes.route, -lanes.route.ego_s_m
    for name, ends_m in zip(route.lane_ids, route.ends_m, strict=True):
        if isinstance(route.graph.lane(name), entities.LaneConnector) and ends_m > 0.0:
            return begins_m if mark is intents.MapPlace.JUNCTION_START else ends_m
        begins_m = ends_m
    return None


def resolve_spots(intent: intents.Intent, lanes: LanesAcross) -> intents.Intent:
    """Return the intent with every distance counted from the ego.

    It is left open where what it is counted from is not there, or open itself.
    """
    named: dict[str, intents.Spot] = {}
    requests: list[intents.Request] = []
    for request in intent.requests:
        spot = request.spot
        if isinstance(request, intents.DoorRequest) and spot.distance is None:
            # Level with its car.
            level = intents.Length(low_m=0.0, high_m=0.0)
            spot = replace(spot, distance=level, relation=intents.Relation.AHEAD)
        spot = resolve_spot(spot, lanes, named)
        named[request.name] = spot
        requests.append(replace(request, spot=spot))
    moves = [
        move
        if move.stays
        else replace(move, spot=_or_anywhere(resolve_spot(move.spot, lanes, named)))
        for move in intent.moves
    ]
    return replace(intent, requests=tuple(requests), moves=tuple(moves))


def resolve_spot(
    spot: intents.Spot, lanes: LanesAcross, named: Mapping[str, intents.Spot]
) -> intents.Spot:
    """Return a spot with its distance counted from the ego; open where that can't be told.

    Args:
        spot: As the intent has it.
        lanes: Of the scene.
        named: The spots of earlier requests by name, counted from the ego.
    """
    own, base = spot.span_m, None
    if spot.anchor is not None:
        anchor = named[spot.anchor]
        base = anchor.span_m
        spot = replace(spot, anchor=None, via=anchor.via)
    elif spot.landmark is not None or spot.mark is not None:
        own = own or (0.0, 0.0)  # without a relation it is level with it
        place_m = find_mark(lanes, spot.mark) if spot.mark else None
        if spot.landmark is not None and (picked := find_picked(lanes, spot.landmark)):
            place_m = lanes.route.locate_agent(picked[0]).ahead_m
        base = None if place_m is None else (place_m, place_m)
        if spot.mark is intents.MapPlace.CROSSWALK and place_m is not None:
            # Before it is before its near edge, past it past its far one; level is on it.
            near_m, far_m = list_crosswalks(lanes)[0]
            edges = {intents.Relation.BEHIND: (near_m, near_m), None: (near_m, far_m)}
            base = edges.get(spot.relation, (far_m, far_m))
    elif lanes.over(spot.via) is not None:
        return spot
    else:
        spot = replace(spot, via=None)
    bare = replace(spot, anchor=None, landmark=None, mark=None, distance=None, relation=None)
    if own is None or base is None:
        return bare
    # Both ranges are open within themselves: their ends add up, without a number to no end.
    low_m, high_m = own[0] + base[0], own[1] + base[1]
    is_ahead = low_m + high_m >= 0.0
    # Behind is counted backwards, so the nearer end is the higher one.
    low_m, high_m = (low_m, high_m) if is_ahead else (-high_m, -low_m)
    return replace(
        bare,
        relation=intents.Relation.AHEAD if is_ahead else intents.Relation.BEHIND,
        distance=intents.Length(low_m=low_m, high_m=high_m),
    )


def _or_anywhere(spot: intents.Spot) -> intents.Spot:
    """Return an open spot as anywhere: of a move it would mean to stay."""
    if spot != intents.Spot():
        return spot
    whole = intents.Length(low_m=-math.inf, high_m=math.inf)
    return intents.Spot(relation=intents.Relation.AHEAD, distance=whole)


def _fits(
    lanes: LanesAcross, pick: intents.Pick, agent: entities.TrafficAgent, place: RoutePosition
) -> bool:
    stands = agent.is_stopped
    if agent.type not in _SIGHTS[pick.kind] or abs(place.left_m) > _BESIDE_M:
        return False
    if stands is not {intents.Sight.PARKED: True, intents.Sight.MOVING: False}.get(
        pick.kind, stands
    ):
        return False
    if pick.side is not None and pick.side.sign * place.left_m <= _ON_A_SIDE_M:
        return False
    if pick.lane is None:
        return True
    # What comes towards the ego is in the oncoming lane.
    turned_rad = abs(difference(agent.heading_rad, place.tangent_rad))
    if pick.lane is intents.LaneChoice.ONCOMING:
        return turned_rad > _AGAINST_RAD
    band = lanes.band(pick.lane, place.ahead_m)
    if band is None or turned_rad > _ALONG_RAD:
        return False
    return abs(place.left_m - band.left_m) <= band.width_m / 2.0


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class Arm:
    """A lane that leads over a junction and the ego's way at red or without a light.

    Attributes:
        turns: It does not lead straight on.
        ahead_m: How far ahead of the ego it crosses the ego's way.
        connector_id, lane_id: What crosses, and the lane before it.
        away_m: From the end of that lane to where it crosses.
    """

    turns: bool
    ahead_m: float
    connector_id: str
    lane_id: str
    away_m: float


def list_arms(lanes: LanesAcross, side: intents.Side | None) -> list[Arm]:
    """Return the arms from a side, or from any, straight and near ones first."""
    route, arms = lanes.route, list[Arm]()
    for connector in route.graph.lanes.values():
        if not isinstance(connector, entities.LaneConnector) or connector.from_lane is None:
            continue
        crossing = find_crossing(connector, route)
        if crossing is None or connector.traffic_light is entities.TrafficLight.GREEN:
            continue
        begin = route.locate(*connector.centerline.position(0.0))
        is_asked = side is None or (begin.left_m > 0.0) is (side is intents.Side.LEFT)
        if connector.from_lane in route.graph.lanes and is_asked:
            arm = Arm(
                turns=connector.turn_type is not entities.TurnType.STRAIGHT,
                ahead_m=route.locate(*crossing).ahead_m,
                connector_id=connector.id,
                lane_id=connector.from_lane,
                away_m=connector.centerline.project(*crossing).s_m,
            )
            arms.append(arm)
    return sorted(arms)


def list_crosswalks(lanes: LanesAcross) -> list[tuple[float, float]]:
    """Return where ahead the route leads over crosswalks, nearest first: the near and far edge."""
    line, ego_s_m, spans_m = lanes.route.line, lanes.route.ego_s_m, []
    way = shapely.LineString(line.between(ego_s_m, line.length_m).points_m)
    for area in lanes.route.scene.areas:
        if area.kind is entities.AreaKind.CROSSWALK:
            part = shapely.intersection(way, shapely.Polygon(area.boundary_m))
            # The way begins at the ego, so stations on it are metres ahead of it.
            points = shapely.points(shapely.get_coordinates(part))
            ends_m = np.asarray(shapely.line_locate_point(way, points))
            spans_m += [(float(ends_m.min()), float(ends_m.max()))] if len(ends_m) else []
    return sorted(spans_m)
