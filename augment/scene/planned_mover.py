"""Where one agent is, moment by moment: in `find_motion` and in drives alike.

`HeldCourse` is what happens without a motion, `PlannedMover` carries a walk or a motion out.
Frame: the scene's.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from augment.errors import InvalidModification
from augment.geometry.frames import difference, wrap
from augment.geometry.polyline import FloatArray, Polyline
from augment.scene import planned_motion as planned
from augment.scene.entities import AgentType, Modification, Point, Scene, TrafficAgent, apply
from augment.scene.lane_graph import LaneGraph
from augment.scene.schema import MOST_OBJECTS

WALK_S = 15.0
"""A walk without a pace of its own takes this long, as interPlan's do: 0.5 to 1.9 m/s."""
SETS_OUT_WITHIN_M = 50.0
"""People with a walk set out once the ego is this near to their start."""
# Between the points of lines that paths are made into.
SAMPLE_M = 0.5
LEAST_M = 1e-6
"""Points nearer to each other than this are one."""
MOST_SAMPLES = 20_000
"""Of one line: paths of strangers may be as long as they like, lines of 10 km are exact."""
# Points of one lane change.
MOST_OF_CHANGE = 100
REACH_M = 600.0
"""So far paths over lanes are followed past the last lane that is named."""
MOST_LISTED = 80
"""Names that a sentence lists as what is allowed."""
BESIDE_WITHIN_M = 8.0
"""Between the centrelines of lanes that one can change between."""
_KEEPS_OFFSET_SHARE = 0.25
"""Who is further from its lane's centre than this share of the width does not drive in it."""
_ALONG_BELOW_RAD = math.radians(60.0)

Places = Mapping[str, Point]
"""Centres of those who are there, by id; the ego is among them under the scene's id for it."""


class HeldCourse:
    """On at the same offset along the lane and what follows it, or straight on without a lane.

    The lane is the one that the agent names, else the one under it. Who heads against it goes
    back along it; who heads across it, and people, go straight on.

    Attributes:
        lane_id: The lane, None for straight on.
    """

    def __init__(self, agent: TrafficAgent, graph: LaneGraph) -> None:
        self._agent, self._graph = agent, graph
        self.lane_id = None
        lane_id = agent.lane_id if agent.lane_id in graph.lanes else None
        if agent.type is AgentType.PEDESTRIAN or not graph.lanes:
            return
        lane_id = lane_id or graph.under(agent.x_m, agent.y_m, agent.heading_rad)
        if lane_id is None:
            return
        line = graph.lane(lane_id).centerline
        self._here = line.project(agent.x_m, agent.y_m)
        # Its turn from the lane's direction is kept; who heads against the lane has the sign -1.
        self._askew = wrap(agent.heading_rad - line.heading_at(self._here.s_m))
        self._sign = math.copysign(1.0, math.cos(self._askew))
        if abs(math.cos(self._askew)) > math.cos(_ALONG_BELOW_RAD):
            self.lane_id = lane_id

    def pose_at(self, gone_m: float) -> tuple[float, float, float] | None:
        """Return x, y and heading after so many metres, None past the map."""
        agent = self._agent
        if gone_m <= 0.0:
            return agent.x_m, agent.y_m, agent.heading_rad
        if self.lane_id is None:
            east, north = math.cos(agent.heading_rad), math.sin(agent.heading_rad)
            return agent.x_m + gone_m * east, agent.y_m + gone_m * north, agent.heading_rad
        place = self._graph.along(
            self.lane_id, self._here.s_m, self._sign * gone_m, self._here.d_m
        )
        if place is None:
            return None
        return place.pose.x_m, place.pose.y_m, wrap(place.pose.heading_rad + self._askew)


class PlannedMover:
    """One agent with a walk or a motion, from t0 on: at each step `advance`, then `react`.

    Args:
        agent: With a walk or a motion.
        graph: Of its scene.

    Raises:
        InvalidModification: Its path leads over lanes that don't follow each other.

    Attributes:
        started_s: When it set out, None until then.
    """

    def __init__(self, agent: TrafficAgent, graph: LaneGraph) -> None:
        acting = walk_as_motion(agent)
        assert acting.motion is not None
        if isinstance(acting.motion.path, planned.LanePath):
            check_lane_path(graph, acting.motion.path)
        self.agent, self._motion, self._graph = agent, acting.motion, graph
        self._own_mps, self._held = acting.speed_mps, HeldCourse(agent, graph)
        self._line: Polyline | None = None
        self.started_s: float | None = None
        self.advance(0.0)

    def state(self) -> FloatArray:
        """Return x, y, heading and speed (4,) now; NaN past the map."""
        own_mps, speeds, path = self._own_mps, self._motion.speeds, self._motion.path
        if self.started_s is None:
            return _row(self._held.pose_at(own_mps * self._time_s), own_mps)
        since_s = self._time_s - self.started_s
        gone_m, speed_mps = way_and_speed(speeds, own_mps, since_s)
        if path is None:
            return _row(self._held.pose_at(own_mps * self.started_s + gone_m), speed_mps)
        if self._line is None:  # its path ends where it is
            stays = isinstance(path, planned.PointPath) or gone_m == 0.0
            return _row(self._held.pose_at(own_mps * self.started_s) if stays else None, 0.0)
        # Lanes lead off the map; at the last of some points somebody stands.
        if gone_m >= self._line.length_m:
            if isinstance(path, planned.LanePath):
                return np.full(4, np.nan)
            gone_m, speed_mps = self._line.length_m, 0.0
        pose = self._line.pose_at(gone_m)
        keeps_heading = isinstance(path, planned.PointPath) and path.keeps_heading
        heading_rad = self.agent.heading_rad if keeps_heading else pose.heading_rad
        return _row((pose.x_m, pose.y_m, heading_rad), speed_mps)

    def advance(self, time_s: float) -> None:
        """Go on to a moment; a trigger by time fires on the way."""
        self._time_s = time_s
        trigger = self._motion.start
        if isinstance(trigger, planned.AtTime) and time_s >= trigger.after_s:
            self._start(trigger.after_s)

    def react(self, places: Places) -> None:
        """Set out if the trigger fires, given where everybody is at this moment."""
        match self._motion.start:
            case planned.AtTime():
                return
            case planned.NearEgo(within_m=within_m):
                who, place = planned.EGO_ID, tuple(self.state()[:2].tolist())
            case planned.AtPlace(agent_id=agent_id, x_m=x_m, y_m=y_m, within_m=within_m):
                who, place = agent_id, (x_m, y_m)
        if who in places and math.dist(places[who], place) <= within_m:
            self._start(self._time_s)

    def _start(self, at_s: float) -> None:
        if self.started_s is not None:
            return
        self.started_s, path = at_s, self._motion.path
        # The path begins where it is at that moment, not where it was at t0.
        here = self._held.pose_at(self._own_mps * at_s)
        if here is not None and isinstance(path, planned.PointPath):
            self._line = smooth_line([here[:2], *path.points_m])
        elif here is not None and isinstance(path, planned.LanePath):
            self._line = lane_line(self._graph, path, here[:2])


def carry_out(agent: TrafficAgent, graph: LaneGraph, times_s: Iterable[float]) -> FloatArray:
    """Return the states (T, 4) of an agent whose motion waits for nobody; NaN past the map."""
    mover, rows = PlannedMover(agent, graph), []
    for time_s in times_s:
        mover.advance(time_s)
        rows.append(mover.state())
    return np.array(rows)


def walk_as_motion(agent: TrafficAgent) -> TrafficAgent:
    """Return an agent with its walk as a motion, straight to its end, once the ego is near.

    At its own pace, or the whole way in `WALK_S`.
    """
    if agent.walk_to_m is None or agent.motion is not None:
        return agent
    pace_mps = agent.speed_mps
    if pace_mps <= 0.0:
        pace_mps = math.dist((agent.x_m, agent.y_m), agent.walk_to_m) / WALK_S
    motion = planned.PlannedMotion(
        path=planned.PointPath(points_m=(agent.walk_to_m,)),
        speeds=((0.0, pace_mps),),
        start=planned.NearEgo(within_m=SETS_OUT_WITHIN_M),
    )
    return replace(agent, speed_mps=0.0, walk_to_m=None, motion=motion)


def way_and_speed(
    speeds: tuple[tuple[float, float], ...], own_mps: float, since_s: float
) -> tuple[float, float]:
    """Return way and speed so long after the start: the area under the speeds, and the last."""
    # Without a row at 0 s the profile begins at the agent's own speed.
    rows = speeds if speeds and speeds[0][0] == 0.0 else ((0.0, own_mps), *speeds)
    gone_m = 0.0
    for (from_s, from_mps), (to_s, to_mps) in pairwise(rows):
        if since_s < to_s:
            # Speeds are linear between rows, so the way is the area of trapezes.
            now_mps = from_mps + (to_mps - from_mps) * (since_s - from_s) / (to_s - from_s)
            return gone_m + (since_s - from_s) * (from_mps + now_mps) / 2.0, now_mps
        gone_m += (to_s - from_s) * (from_mps + to_mps) / 2.0
    last_s, last_mps = rows[-1]
    return gone_m + (since_s - last_s) * last_mps, last_mps


def smooth_line(points_m: list[Point]) -> Polyline | None:
    """Return a line through points without corners or overshoot, None for points in one place.

    Each coordinate is a monotone cubic (PCHIP) over the length of the chords.
    """
    from scipy.interpolate import PchipInterpolator

    points = np.array(points_m)
    steps_m = np.hypot(*np.diff(points, axis=0).T)
    points = points[np.concatenate([[True], steps_m > LEAST_M])]
    if len(points) < 2:
        return None
    if len(points) == 2:
        return Polyline(points)
    # (P,) the length of the chords as parameter: even steps of it are about even on the curve.
    chords_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    count = min(max(3, math.ceil(chords_m[-1] / SAMPLE_M) + 1), MOST_SAMPLES)
    samples_m = np.linspace(0.0, chords_m[-1], count)
    with np.errstate(over="ignore"):  # a slope of next to nothing is as good as none
        return Polyline(PchipInterpolator(chords_m, points)(samples_m))


@lru_cache(maxsize=8)  # a search for the nearest motion varies speeds on one path
def lane_line(graph: LaneGraph, path: planned.LanePath, here: Point) -> Polyline | None:
    """Return the line that a path over lanes takes from a place, None where the lanes end there.

    It keeps its offset from the centreline until it changes lanes; a change ends in the centre.
    Who sets out beside the first lane, or at its edge, changes onto it first.

    Raises:
        InvalidModification: A lane is unknown, or neither follows nor runs beside the one before.
    """
    check_lane_path(graph, path)
    runs = _split_runs(graph, path.lane_ids)
    line, last_begins_m = _join_run(graph, runs[0])
    at = line.project(*here)
    at_m, d_m, points = at.s_m, at.d_m, [here]
    # Who does not drive in its first lane changes onto it, as from another lane.
    is_beside = abs(d_m) > graph.lane(path.lane_ids[0]).width_m * _KEEPS_OFFSET_SHARE
    for run in runs[0 if is_beside and at.beyond_m == 0.0 else 1 :]:
        # A change begins at once, or where the last lane of the run before begins.
        begins_m = at_m if run is runs[0] else max(at_m, last_begins_m)
        points += [line.position(s_m, d_m) for s_m in _samples(at_m, begins_m)]
        target, last_begins_m = _join_run(graph, run)
        for s_m in _samples(begins_m, begins_m + path.change_m, most=MOST_OF_CHANGE):
            # From the offset in the old lane to the abreast place in the centre of the new one.
            share = smooth_share((s_m - begins_m) / path.change_m)
            start = line.position(s_m, d_m)
            end = target.position(target.project(*start).s_m)
            x_m, y_m = ((1.0 - share) * a + share * b for a, b in zip(start, end, strict=True))
            points.append((x_m, y_m))
        line, d_m = target, 0.0
        at_m = target.project(*points[-1]).s_m
    points += [line.position(s_m, d_m) for s_m in _samples(at_m, line.length_m)]
    leads_on = any(math.dist(here, point) > LEAST_M for point in points)
    return Polyline(points) if leads_on else None


def check_motions(scene: Scene, modification: Modification) -> None:
    """Do nothing where every motion can be carried out in the scene after a modification.

    Raises:
        InvalidModification: As `check_scene_motions`, or the modification does not fit.
    """
    check_scene_motions(apply(scene, modification))


def check_scene_motions(scene: Scene) -> None:
    """Do nothing where every motion in a scene can be carried out.

    Raises:
        InvalidModification: A path leads over lanes that don't follow each other, a trigger
            waits for nobody's arrival, or there are too many.
    """
    motions = [(agent, agent.motion) for agent in scene.agents if agent.motion is not None]
    if not motions:
        return
    if len(motions) > MOST_OBJECTS:
        raise InvalidModification(f"{len(motions)} agents have a motion; at most {MOST_OBJECTS}")
    graph, names = LaneGraph(scene), {agent.id for agent in scene.everyone}
    for agent, motion in motions:
        try:
            if isinstance(motion.path, planned.LanePath):
                check_lane_path(graph, motion.path)
        except InvalidModification as fault:
            raise InvalidModification(f"{agent.id}: {fault}") from None
        start = motion.start
        if isinstance(start, planned.AtPlace) and start.agent_id not in names - {agent.id}:
            raise InvalidModification(
                f"{agent.id}: it waits for {start.agent_id}, who is none of "
                f"{', '.join(sorted(names - {agent.id})[:MOST_LISTED])}"
            )


def check_lane_path(graph: LaneGraph, path: planned.LanePath) -> None:
    """Do nothing where the lanes can be followed one after the other.

    Raises:
        InvalidModification: One is unknown, or neither follows nor runs beside the one before.
    """
    for name in path.lane_ids:
        if name not in graph.lanes:
            allowed = ", ".join(sorted(graph.lanes)[:MOST_LISTED]) or "none"
            raise InvalidModification(f"{name} is no lane of the scene; its lanes: {allowed}")
    for before, after in pairwise(path.lane_ids):
        if after not in graph.successors(before) and not run_beside(graph, before, after):
            raise InvalidModification(
                f"a path over lanes: {after} neither follows {before} nor runs beside it"
            )


def run_beside(graph: LaneGraph, lane_id: str, other_id: str) -> bool:
    """Return whether one can change from a lane to another: it runs near it the same way."""
    if other_id == lane_id or other_id in graph.abreast(lane_id):
        return other_id != lane_id
    other = graph.lane(other_id).centerline
    line = graph.lane(lane_id).centerline
    for s_m in np.linspace(0.0, line.length_m, 20).tolist():
        pose = line.pose_at(s_m)
        place = other.project(pose.x_m, pose.y_m)
        turn_rad = abs(difference(place.heading_rad, pose.heading_rad))
        if place.distance_m <= BESIDE_WITHIN_M and turn_rad < _ALONG_BELOW_RAD:
            return True
    return False


def smooth_share(share: float) -> float:
    """Return a share that goes from 0 to 1 without a jump in speed or acceleration across."""
    # Quintic with first and second derivative 0 at 0 and at 1.
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


# Private


def _row(pose: tuple[float, float, float] | None, speed_mps: float) -> FloatArray:
    return np.full(4, np.nan) if pose is None else np.array([*pose, speed_mps])


def _split_runs(graph: LaneGraph, lane_ids: tuple[str, ...]) -> list[list[str]]:
    """Lanes that follow each other, one list for each lane change more."""
    runs = [[lane_ids[0]]]
    for before, after in pairwise(lane_ids):
        if after in graph.successors(before):
            runs[-1].append(after)
        else:
            runs.append([after])
    return runs


def _join_run(graph: LaneGraph, run: list[str]) -> tuple[Polyline, float]:
    """The line over lanes and what follows the last straightest; where that last one begins."""
    lines = [graph.lane(name).centerline for name in run]
    last_begins_m = sum(line.length_m for line in lines[:-1])
    lines += [graph.lane(name).centerline for name in graph.route(run[-1], REACH_M)[1:]]
    return Polyline(np.vstack([line.points_m for line in lines])), last_begins_m


def _samples(start_m: float, end_m: float, *, most: int = MOST_SAMPLES) -> list[float]:
    """Stations after the start up to the end."""
    # 1e-9: a length that is rounded up gets no sample more.
    count = min(math.ceil((end_m - start_m) / SAMPLE_M - 1e-9), most)
    return np.linspace(start_m, end_m, count + 1)[1:].tolist() if count > 0 else []
