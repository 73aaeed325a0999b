"""Critical motions by name, from a scene and an agent to the agent that moves so.

Frame: the scene's. Distances between road users run from centre to centre.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from augment.errors import CannotPlace, InvalidDocument
from augment.geometry.frames import Pose, difference
from augment.scene import entities, planned_mover
from augment.scene import planned_motion as planned
from augment.scene.ego_route import EgoRoute, RoutePosition
from augment.scene.lane_graph import ONCOMING_ABOVE_RAD
from augment.scene.planned_motion import AtTime, LanePath, MotionPreset, NearEgo, PointPath

DOOR_LENGTH_M, DOOR_WIDTH_M, DOOR_REACH_M = 1.1, 0.15, 0.9
"""A door as a slab beside its car, and how far out it slides."""
TURN_RADIUS_M = 4.5
"""On which a car turns round; that of its centre."""

_NUMBERS = ("braking_mps2", "speed_mps", "duration_s")
_SPEEDING_UP_MPS2 = 3.0
_STARTS_WALKING_S = 0.5
_KERB_M = 1.0
"""So far past the last lane a walk ends."""
# How far across the edge of a road is looked for, by which steps, over which gaps.
_ACROSS_M, _ACROSS_STEP_M, _GAP_M = 30.0, 0.25, 1.5
_DOOR_WITHIN_M, _DOOR_AHEAD_M, _DOOR_GAP_M = 8.0, 0.3, 0.05
_PULLS_OUT_WITHIN_M = 10.0
_BEND_OVER_M, _BEND_RAD, _STRAIGHT_RAD = 30.0, math.radians(25.0), math.radians(5.0)
_HIDDEN_M = 5.0
"""So far past the end of a bend somebody stands who can't be seen before it."""
_LATEST_S = 15.0
_ARC_RAD, _ROUND_M, _ONWARDS_M = math.radians(15.0), 15.0, 60.0
_OFF_ROAD_M = 0.3
_JUNCTION_WITHIN_M, _CROSSES_ABOVE_RAD = 100.0, math.radians(30.0)
_SLOWEST_EGO_MPS = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PresetNumbers:
    """Free numbers of a preset; None for the usual one.

    Attributes:
        start: When it sets out.
        speed_mps: That it comes to; a U-turn is driven at it.
        braking_mps2: How hard it brakes, positive.
        duration_s: How long a lane change takes, or the opening of a door.
    """

    start: planned.Trigger | None = None
    speed_mps: float | None = None
    braking_mps2: float | None = None
    duration_s: float | None = None


USUAL = {
    MotionPreset.CUT_IN: PresetNumbers(
        start=NearEgo(within_m=15.0), speed_mps=0.0, duration_s=3.0
    ),
    MotionPreset.HARD_BRAKING: PresetNumbers(
        start=AtTime(after_s=1.0), speed_mps=0.0, braking_mps2=6.0
    ),
    MotionPreset.LATE_PEDESTRIAN: PresetNumbers(start=NearEgo(within_m=20.0), speed_mps=2.0),
    MotionPreset.DOOR_OPENING: PresetNumbers(start=NearEgo(within_m=15.0), duration_s=1.0),
    MotionPreset.U_TURN: PresetNumbers(start=NearEgo(within_m=30.0), speed_mps=4.0),
    MotionPreset.RED_LIGHT: PresetNumbers(speed_mps=8.0),
    MotionPreset.EMERGENCY_STOP: PresetNumbers(braking_mps2=8.0),
    MotionPreset.PULL_OUT: PresetNumbers(start=NearEgo(within_m=25.0), speed_mps=8.0),
}
"""The numbers of each where nobody says, the start apart of those that find it out.

Who drives and changes lanes or runs a red light keeps its own speed.
"""


def with_preset(
    preset: MotionPreset,
    scene: entities.Scene,
    agent: entities.TrafficAgent,
    numbers: PresetNumbers = PresetNumbers(),
) -> entities.TrafficAgent:
    """Return the agent with the preset's motion; for a door the door, a new agent without an id.

    Args:
        preset: What it does.
        scene: Before it; the agent may be one of it or one that is to be added.
        agent: As it is at t0; for a door the parked car.
        numbers: What is to be as somebody says.

    Raises:
        CannotPlace: The scene has not what it needs, or a number is none of the preset's or
            makes a motion that is beyond what can be written.
    """
    route = EgoRoute.of(scene)
    if route is None:
        raise CannotPlace("The ego stands on no lane of the map.")
    own = preset_numbers(preset)
    for name in _NUMBERS:
        if getattr(numbers, name) is not None and name not in own:
            raise CannotPlace(f"{preset.label}: {name} is none of its numbers: {', '.join(own)}.")
    lane_id = agent.lane_id
    if lane_id not in route.graph.lanes:
        lane_id = route.graph.under(agent.x_m, agent.y_m, agent.heading_rad)
        agent = replace(agent, lane_id=lane_id)  # who drives holds it until the start
    place = route.locate_agent(agent)
    mover = _MAKERS[preset](_Case(preset, route, agent, lane_id, place, numbers))
    assert mover.motion is not None
    try:
        planned.MOTION.from_parts(planned.MOTION.dump(mover.motion))
    except InvalidDocument as fault:
        raise CannotPlace(f"{preset.label}: {fault}") from None
    return mover


def preset_numbers(preset: MotionPreset) -> tuple[str, ...]:
    """Return the fields of `PresetNumbers` that it leaves to choose, the main one first."""
    return tuple(name for name in _NUMBERS if getattr(USUAL[preset], name) is not None)


def find_crossing(connector: entities.LaneConnector, route: EgoRoute) -> entities.Point | None:
    """Return where a connector crosses the ego's way ahead, None where it doesn't."""
    ahead = route.line.between(route.ego_s_m, route.line.length_m)
    line = connector.centerline
    met = shapely.LineString(line.points_m).intersection(shapely.LineString(ahead.points_m))
    for x_m, y_m in shapely.get_coordinates(met).tolist():
        heading_rad, ego_rad = (line_of.project(x_m, y_m).heading_rad for line_of in (line, ahead))
        turn_rad = abs(difference(heading_rad, ego_rad))
        if _CROSSES_ABOVE_RAD < turn_rad < math.pi - _CROSSES_ABOVE_RAD:
            return _round((x_m, y_m))
    return None


def find_bend_end(route: EgoRoute) -> float | None:
    """Return how far ahead of the ego the first bend of its way ends, None without one."""
    stations = np.arange(0.0, route.ends_m[-1] - _BEND_OVER_M, 1.0).tolist()

    def turns_rad(ahead_m: float, over_m: float) -> float:
        return abs(difference(route.heading_at(ahead_m + over_m), route.heading_at(ahead_m)))

    begins = next((s for s in stations if turns_rad(s, _BEND_OVER_M) >= _BEND_RAD), None)
    if begins is None:
        return None
    after = (s for s in stations if s > begins + _BEND_OVER_M / 2.0)
    return next((s for s in after if turns_rad(s, _BEND_OVER_M / 2.0) < _STRAIGHT_RAD), None)


def find_door_side(car: entities.TrafficAgent, place: RoutePosition) -> float:
    """Return the side of a car on which the ego comes past, 1 left, -1 right."""
    toward_rad = place.tangent_rad - math.copysign(math.pi / 2.0, place.left_m)
    return math.copysign(1.0, difference(toward_rad, car.heading_rad))


def ego_pace_mps(scene: entities.Scene) -> float:
    """Return how fast the ego comes, for timing; one that stands sets out some time."""
    return max(scene.ego.speed_mps, _SLOWEST_EGO_MPS)


# Private


@dataclass(frozen=True, slots=True)
class _Case:
    """One preset of one agent: what is known of it, and what is found out."""

    preset: MotionPreset
    route: EgoRoute
    agent: entities.TrafficAgent
    lane_id: str | None
    place: RoutePosition
    numbers: PresetNumbers

    def refusal(self, words: str) -> CannotPlace:
        return CannotPlace(f"{self.preset.label}: {words}")

    def moving(
        self,
        path: planned.Path | None,
        speeds: tuple[tuple[float, float], ...],
        start: planned.Trigger | None = None,
    ) -> entities.TrafficAgent:
        motion = planned.PlannedMotion(
            path=path,
            speeds=speeds,
            start=start or self.numbers.start or USUAL[self.preset].start or AtTime(),
        )
        return replace(self.agent, motion=motion)

    def number(self, name: str) -> float:
        """One that was said, else the usual one."""
        stated = getattr(self.numbers, name)
        return float(getattr(USUAL[self.preset], name) if stated is None else stated)

    @property
    def reached_mps(self) -> float:
        holds = self.numbers.speed_mps is None and not self.agent.is_stopped
        return self.agent.speed_mps if holds else self.number("speed_mps")

    def require(self, *, ahead: bool = True, drives: bool | None = None) -> None:
        walks = self.preset is MotionPreset.LATE_PEDESTRIAN
        if self.agent.type not in (
            (entities.AgentType.PEDESTRIAN,) if walks else entities.STEERED
        ):
            kind = self.agent.type.lower().replace("_", " ")
            raise self.refusal(f"it is not what a {kind} does.")
        if ahead and self.place.ahead_m <= 0.0:
            raise self.refusal("it has to be ahead of the ego.")
        if drives is not None and drives is self.agent.is_stopped:
            raise self.refusal("it has to drive." if drives else "it has to stand.")

    def own_lane(self) -> str:
        """The lane of the ego's route beside the agent."""
        there = self.route.lane_position(self.place.ahead_m)
        if there is None:
            raise self.refusal("the ego's lane ends before it.")
        return there.lane_id

    def is_in_ego_lane(self) -> bool:
        width_m = self.route.graph.lane(self.own_lane()).width_m
        return abs(self.place.left_m) <= width_m / 2.0


def _cut_in(case: _Case) -> entities.TrafficAgent:
    case.require(drives=True)
    own = case.own_lane()
    if case.is_in_ego_lane():
        raise case.refusal("it is in the ego's lane already.")
    mean_mps = (case.agent.speed_mps + case.reached_mps) / 2.0
    least_m = planned.CHANGE_M if case.numbers.duration_s is None else 1.0
    change_m = round(min(max(least_m, mean_mps * case.number("duration_s")), 200.0), 1)
    if case.lane_id is None or not planned_mover.run_beside(case.route.graph, case.lane_id, own):
        raise case.refusal("it has to be in a lane beside the ego's, in the same direction.")
    path = LanePath(lane_ids=(case.lane_id, own), change_m=change_m)
    return case.moving(path, _ramp(case.agent.speed_mps, case.reached_mps))


def _hard_braking(case: _Case) -> entities.TrafficAgent:
    case.require(drives=True)
    if not case.is_in_ego_lane():
        raise case.refusal("it has to be in the ego's lane.")
    to_mps = case.number("speed_mps")
    if to_mps >= case.agent.speed_mps:
        raise case.refusal(
            f"it drives at {case.agent.speed_mps:g} m/s, so not down to {to_mps:g}."
        )
    speeds = _ramp(case.agent.speed_mps, to_mps, case.number("braking_mps2"))
    return case.moving(None, speeds)


def _late_pedestrian(case: _Case) -> entities.TrafficAgent:
    case.require()
    if case.is_in_ego_lane():
        raise case.refusal("who starts late stands beside the ego's lane before.")
    side = math.copysign(1.0, case.place.left_m)
    edge_m = find_road_edge_m(case.route, case.place.ahead_m, -side)
    end = case.route.position(case.place.ahead_m, -side * (edge_m + _KERB_M))
    east, north = end[0] - case.agent.x_m, end[1] - case.agent.y_m
    waiting = replace(
        case.agent, speed_mps=0.0, walk_to_m=None, heading_rad=math.atan2(north, east)
    )
    speed_mps = case.number("speed_mps")
    path = PointPath(points_m=(_round(end),))
    return replace(case, agent=waiting).moving(path, ((_STARTS_WALKING_S, speed_mps),))


def _door_opening(case: _Case) -> entities.TrafficAgent:
    case.require(drives=False)
    car, left_m = case.agent, case.place.left_m
    if case.is_in_ego_lane() or abs(left_m) > _DOOR_WITHIN_M:
        raise case.refusal(
            "the car has to stand beside the ego's lane, within "
            f"{_DOOR_WITHIN_M:g} m of its centre."
        )
    side = find_door_side(car, case.place)
    if abs(math.cos(difference(case.place.tangent_rad, car.heading_rad))) < math.cos(_BEND_RAD):
        raise case.refusal("the car has to stand along the ego's lane.")
    closed_m = car.width_m / 2.0 + DOOR_WIDTH_M / 2.0 + _DOOR_GAP_M
    local = [(_DOOR_AHEAD_M, side * across) for across in (closed_m, closed_m + DOOR_REACH_M)]
    closed, opened = map(_round, car.pose.to_parent(np.array(local)).tolist())
    door = entities.TrafficAgent.at(
        entities.AgentType.GENERIC_OBJECT,
        Pose(x_m=closed[0], y_m=closed[1], heading_rad=car.heading_rad),
        (DOOR_LENGTH_M, DOOR_WIDTH_M),
        lane_id=case.route.graph.under(*closed),
    )
    half_s = case.number("duration_s") / 2.0
    path = PointPath(points_m=(opened,), keeps_heading=True)
    speeds = ((half_s, round(DOOR_REACH_M / half_s, 3)), (2.0 * half_s, 0.0))
    return replace(case, agent=door).moving(path, speeds)


def _u_turn(case: _Case) -> entities.TrafficAgent:
    case.require()
    agent, turn_mps = case.agent, case.number("speed_mps")
    start, gone_m = case.numbers.start, 0.0
    if not case.agent.is_stopped:
        # Where it is when the ego comes near, nobody knows before.
        start = start or AtTime()
        if not isinstance(start, AtTime):
            raise case.refusal("of somebody who drives it begins at a moment.")
        gone_m = agent.speed_mps * start.after_s
        # From v to w by an even a: (v^2 - w^2) / (2 a).
        gone_m += max(agent.speed_mps**2 - turn_mps**2, 0.0) / (2.0 * _SPEEDING_UP_MPS2)
    here = planned_mover.HeldCourse(agent, case.route.graph).pose_at(gone_m)
    if here is None:
        raise case.refusal("the lanes end before it begins.")
    points = [here[:2]] if gone_m else []
    points += _turn_points(case, Pose(x_m=here[0], y_m=here[1], heading_rad=here[2]))
    path = PointPath(points_m=tuple(map(_round, points)))
    return case.moving(path, _ramp(agent.speed_mps, turn_mps), start)


def _turn_points(case: _Case, begin: Pose) -> list[entities.Point]:
    """Half a circle to the oncoming lane, back to its centre if it was too narrow, and on."""
    graph, scene = case.route.graph, case.route.scene
    side = -1.0 if scene.traffic_side is entities.TrafficSide.LEFT else 1.0
    oncoming = [
        (side * lane.d_m, lane.lane_id)
        for lane in graph.beside(begin.x_m, begin.y_m)
        if abs(difference(lane.tangent_rad, begin.heading_rad)) > ONCOMING_ABOVE_RAD
        and side * lane.d_m > lane.width_m / 2.0
        and lane.beyond_m == 0.0
    ]
    if not oncoming:
        raise case.refusal("there is no oncoming lane beside it.")
    across_m, target = min(oncoming)
    radius_m = max(TURN_RADIUS_M, across_m / 2.0)
    angles = np.linspace(0.0, math.pi, round(math.pi / _ARC_RAD) + 1)[1:]
    # (K, 2) ahead and to the side: half a circle that begins along the heading.
    arc = np.column_stack((np.sin(angles), side * (1.0 - np.cos(angles)))) * radius_m
    points = [(x, y) for x, y in begin.to_parent(arc).tolist()]
    there = graph.lane(target).centerline.project(*points[-1])
    for gone_m in np.arange(3.0, _ONWARDS_M, 3.0).tolist():
        left_m = there.d_m * (1.0 - planned_mover.smooth_share(min(gone_m / _ROUND_M, 1.0)))
        place = graph.along(target, there.s_m, gone_m, left_m)
        if place is None:
            break
        points.append((place.pose.x_m, place.pose.y_m))
    driven = shapely.LineString([(begin.x_m, begin.y_m), *points])
    width_m = case.agent.width_m
    if not shapely.covers(_road(case.route), driven.buffer(width_m / 2.0)):
        raise case.refusal(
            f"a turn of {2.0 * radius_m:.1f} m and the car's width of {width_m:.1f} m leave the "
            "road there."
        )
    return points


def _red_light(case: _Case) -> entities.TrafficAgent:
    case.require(ahead=False)
    for lane_ids in _ways(case):
        connector = case.route.graph.lane(lane_ids[-1])
        assert isinstance(connector, entities.LaneConnector)
        crossing = find_crossing(connector, case.route)
        if crossing is None:
            continue
        if connector.traffic_light is entities.TrafficLight.GREEN:
            raise case.refusal(f"its light at {connector.id} is green.")
        path = LanePath(lane_ids=(*lane_ids, *case.route.graph.successors(connector.id)[:1]))
        own_mps = case.agent.speed_mps
        speeds = _ramp(own_mps, case.reached_mps)
        line = planned_mover.lane_line(case.route.graph, path, (case.agent.x_m, case.agent.y_m))
        needs_m = line.project(*crossing).s_m if line is not None else 0.0
        if needs_m == 0.0:
            continue  # it is past the crossing
        times_s = np.arange(0.0, 60.0, 0.1)
        gone_m = [
            planned_mover.way_and_speed(speeds, own_mps, time_s)[0] for time_s in times_s.tolist()
        ]
        arrives_s = float(times_s[np.searchsorted(gone_m, needs_m) - 1])
        # So far the ego is from the crossing when both have the same time to it.
        within_m = round(max(ego_pace_mps(case.route.scene) * arrives_s, 2.0), 1)
        meets = planned.AtPlace(x_m=crossing[0], y_m=crossing[1], within_m=within_m)
        start = case.numbers.start or (meets if case.agent.is_stopped else AtTime())
        return case.moving(path, speeds, start)
    raise case.refusal("no way from its lane over a junction crosses the ego's.")


def _ways(case: _Case) -> Iterator[tuple[str, ...]]:
    """Lanes from the agent's up to each connector that it may come to, the nearest first."""
    if case.lane_id is None:
        return
    graph = case.route.graph
    at_m = graph.lane(case.lane_id).centerline.project(case.agent.x_m, case.agent.y_m).s_m
    ways: list[tuple[tuple[str, ...], float]] = [((case.lane_id,), -at_m)]
    for way, before_m in ways:
        if isinstance(graph.lane(way[-1]), entities.LaneConnector):
            yield way
        ends_m = before_m + graph.lane(way[-1]).centerline.length_m
        if ends_m <= _JUNCTION_WITHIN_M and len(way) < 10:
            ways += [((*way, name), ends_m) for name in graph.successors(way[-1])]


def _emergency_stop(case: _Case) -> entities.TrafficAgent:
    case.require(drives=True)
    if not case.is_in_ego_lane():
        raise case.refusal("it has to be in the ego's lane.")
    bend_m = find_bend_end(case.route)
    if bend_m is None:
        raise case.refusal("the ego's way has no bend ahead.")
    own_mps = case.agent.speed_mps
    # v^2 / (2 b), so that it stands just past the bend.
    brakes_m = own_mps**2 / (2.0 * case.number("braking_mps2"))
    until_s = max(bend_m + _HIDDEN_M - brakes_m - case.place.ahead_m, 0.0) / own_mps
    if case.numbers.start is None and until_s > _LATEST_S:
        raise case.refusal(f"it would be behind the bend only after {until_s:.0f} s.")
    start = case.numbers.start or AtTime(after_s=round(until_s, 2))
    speeds = _ramp(own_mps, 0.0, case.number("braking_mps2"))
    return case.moving(None, speeds, start)


def _pull_out(case: _Case) -> entities.TrafficAgent:
    case.require(drives=False)
    own = case.own_lane()
    turned_rad = abs(difference(case.agent.heading_rad, case.place.tangent_rad))
    half_m = case.route.graph.lane(own).width_m / 4.0
    if not half_m < abs(case.place.left_m) <= _PULLS_OUT_WITHIN_M or turned_rad > math.pi / 4.0:
        raise case.refusal(
            "it has to stand beside the ego's lane and look along it, within "
            f"{_PULLS_OUT_WITHIN_M:g} m of its centre."
        )
    return case.moving(LanePath(lane_ids=(own,)), _ramp(case.agent.speed_mps, case.reached_mps))


_MAKERS = {
    MotionPreset.CUT_IN: _cut_in,
    MotionPreset.HARD_BRAKING: _hard_braking,
    MotionPreset.LATE_PEDESTRIAN: _late_pedestrian,
    MotionPreset.DOOR_OPENING: _door_opening,
    MotionPreset.U_TURN: _u_turn,
    MotionPreset.RED_LIGHT: _red_light,
    MotionPreset.EMERGENCY_STOP: _emergency_stop,
    MotionPreset.PULL_OUT: _pull_out,
}


def _ramp(
    from_mps: float, to_mps: float, mps2: float = _SPEEDING_UP_MPS2
) -> tuple[tuple[float, float], ...]:
    takes_s = round(abs(to_mps - from_mps) / mps2, 2)
    return ((takes_s, to_mps),) if takes_s > 0.0 else ()


def find_road_edge_m(route: EgoRoute, ahead_m: float, side: float) -> float:
    """Return the distance in m from the ego's way, straight across, to its road's far edge."""
    end_m = across_m = 0.0
    while across_m - end_m < _GAP_M and across_m < _ACROSS_M:
        across_m += _ACROSS_STEP_M
        point = route.position(ahead_m, side * across_m)
        if any(lane.covers for lane in route.graph.beside(*point)):
            end_m = across_m
    return end_m


def _road(route: EgoRoute) -> shapely.Geometry:
    """The ground that one may drive on, and a hand's breadth beside it."""
    lanes = [
        shapely.LineString(lane.centerline.points_m).buffer(lane.width_m / 2.0 + _OFF_ROAD_M)
        for lane in route.graph.lanes.values()
    ]
    areas = [
        shapely.Polygon(a.boundary_m) for a in route.scene.areas if a.kind in entities.DRIVEN_ON
    ]
    return shapely.union_all([*lanes, *(shapely.make_valid(a).buffer(_OFF_ROAD_M) for a in areas)])


def _round(point: Sequence[float]) -> entities.Point:
    return round(point[0], 3) + 0.0, round(point[1], 3) + 0.0
