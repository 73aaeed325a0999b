"""Planned motions of ours from the events of an actor.

The first event starts the motion; later ones of the same actor become part of it where they wait
for one before, or for a time as well. Frame: the ego frame of t0. V vertices.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
import shapely
from pydantic import TypeAdapter

from augment import foreign
from augment.errors import InvalidModification
from augment.foreign import Doubts, FloatArray, fault_at
from augment.formats.opendrive.geometry import read_float
from augment.formats.openscenario.conditions import Expectation, find_trigger
from augment.formats.openscenario.events import StoryEvent, read_vertices
from augment.geometry.frames import Pose
from augment.geometry.polyline import Polyline
from augment.scene.entities import TrafficAgent
from augment.scene.lane_graph import LaneGraph
from augment.scene.planned_motion import AtTime, LanePath, Path, PlannedMotion, PointPath, Trigger
from augment.scene.planned_mover import HeldCourse, lane_line, way_and_speed
from augment.scene.schema import Codec

_MOTION = Codec("motion", TypeAdapter(PlannedMotion))
_MOST_SPEEDS, _MOST_POINTS = 50, 200
_STEP_S = 0.01
"""A step in speed takes so long."""
_LANE_M = 3.5
_SHAPES: dict[str, Callable[[float], float]] = {
    "linear": lambda share: share,
    "step": lambda share: share,
    "cubic": lambda share: share * share * (3.0 - 2.0 * share),
    "sinusoidal": lambda share: (1.0 - math.cos(math.pi * share)) / 2.0,
}
_WAIT = "ByValueCondition/StoryboardElementStateCondition"
_BEGUN = ("startTransition", "runningState")


@dataclass(slots=True, kw_only=True)
class Done:
    """When an element of the storyboard begins and ends, in seconds since its actor's start."""

    actor: str
    start: Trigger
    begins_s: float
    ends_s: float


@dataclass(slots=True, kw_only=True)
class MotionReader:
    """Reads the motions of one scenario.

    Attributes:
        find_middles: The middles of an actor's box at positions, with headings (V, 3).
        count_lanes: How many lanes to the left of a pose a lane of an id is.
        done: Elements that were read, by name.
    """

    graph: LaneGraph
    expected: Expectation
    find_middles: Callable[[str, list[Element], str], FloatArray]
    count_lanes: Callable[[Pose, int], int]
    doubts: Doubts
    done: dict[str, Done] = field(default_factory=dict)

    def read(self, name: str, agent: TrafficAgent, events: Iterable[StoryEvent]) -> TrafficAgent:
        """Return the agent with the motion in its events; without one where none can be read."""
        draft = _Draft(self, name, agent)
        for event in events:
            with self.doubts.about("events"):
                draft.add(event)
        if draft.start is None:
            return agent
        motion = PlannedMotion(path=draft.path, speeds=tuple(draft.speeds), start=draft.start)
        # What breaks a bound of motions is left out.
        bounded = self.doubts.read("motions", _MOTION.from_parts, _MOTION.dump(motion))
        return replace(agent, motion=bounded)


class _Draft:
    """A motion while its events are added."""

    def __init__(self, reader: MotionReader, name: str, agent: TrafficAgent) -> None:
        self._reader, self._name, self._agent = reader, name, agent
        self.start: Trigger | None = None
        self.path: Path | None = None
        self.speeds: list[tuple[float, float]] = []
        self._line: Polyline | None = None

    def add(self, event: StoryEvent) -> None:
        """Add what an event does; raises InvalidDocument if it can't be."""
        begins_s, ends_s = self._begin(event), 0.0
        start = self.start
        assert start is not None
        for kind, action in event.actions:
            act: dict[str, Callable[[Element, float, str], float]] = {
                "SpeedAction": self._change_speed,
                "LaneChangeAction": self._change_lane,
                "FollowTrajectoryAction": self._follow,
            }
            lasts_s = foreign.look_up(act, kind, event.place)(action, begins_s, event.place)
            ends_s = max(ends_s, begins_s + lasts_s)
        done = Done(actor=self._name, start=start, begins_s=begins_s, ends_s=ends_s)
        self._reader.done |= dict.fromkeys(event.names, done)

    def _begin(self, event: StoryEvent) -> float:
        """Set the start by the first event, and return how long after it an event begins."""
        waits = [c.find(_WAIT) for group in event.groups for c in group]
        start: Trigger
        if waits and waits[0] is not None:
            state, name = waits[0].get("state"), waits[0].get("storyboardElementRef", "")
            done = foreign.look_up(self._reader.done, name.split("::")[-1], event.place)
            since_s = done.begins_s if state in _BEGUN else done.ends_s
            if done.actor == self._name and self.start is not None:
                return since_s
            if not isinstance(done.start, AtTime):
                raise fault_at(event.place, f"waits for {name[:40]}, which starts by no time")
            time_s = done.start.after_s + since_s
            start, self._step = AtTime(after_s=time_s), self._step_at(time_s)
        elif self.start is None or event.time_s is None:
            if self.start is not None:
                raise fault_at(event.place, "a second start of one actor's is left out")
            arguments = event, self._name, self._reader.expected, self._reader.doubts
            start, self._step = find_trigger(*arguments)
        else:
            start = AtTime(after_s=event.time_s)
        if self.start is None:
            self.start = start
            state_row = self._reader.expected.states[self._name][self._step].tolist()
            self._here = Pose(x_m=state_row[0], y_m=state_row[1], heading_rad=state_row[2])
            return 0.0
        assert isinstance(start, AtTime)
        if not isinstance(self.start, AtTime) or start.after_s < self.start.after_s:
            raise fault_at(event.place, "begins by a time, and not after the actor's first event")
        return start.after_s - self.start.after_s

    def _step_at(self, time_s: float) -> int:
        times_s = self._reader.expected.times_s
        return min(int(np.searchsorted(times_s, time_s - 1e-9)), len(times_s) - 1)

    # Actions; each returns how long it takes

    def _change_speed(self, action: Element, at_s: float, place: str) -> float:
        own_mps = self._agent.speed_mps
        now_mps = way_and_speed(tuple(self.speeds), own_mps, at_s)[1]
        goal_mps = read_speed_target(action, self._mps_of, f"{place}.SpeedAction")
        dynamics = _find(action, "SpeedActionDynamics", place)
        by, value = dynamics.get("dynamicsDimension"), read_float(dynamics, "value", place, 0.0)
        shape = foreign.look_up(_SHAPES, dynamics.get("dynamicsShape"), place)
        change_mps, mean_mps = abs(goal_mps - now_mps), max((goal_mps + now_mps) / 2.0, 0.1)
        spans = {
            "time": value,
            "rate": change_mps / max(value, 1e-3),
            "distance": value / mean_mps,
        }
        lasts_s = foreign.look_up(spans, by, f"{place}.dynamicsDimension")
        lasts_s = _STEP_S if dynamics.get("dynamicsShape") == "step" else max(lasts_s, _STEP_S)
        self.speeds = [row for row in self.speeds if row[0] < at_s - _STEP_S]
        shares = (0.0, 1.0) if shape(0.25) == 0.25 else np.linspace(0.0, 1.0, 7).tolist()
        self.speeds += [
            (round(at_s + s * lasts_s, 4), now_mps + shape(s) * (goal_mps - now_mps))
            for s in shares
        ]
        return lasts_s

    def _mps_of(self, name: str) -> float:
        states = foreign.look_up(self._reader.expected.states, name, "entityRef")
        return float(states[0, 3])

    def _change_lane(self, action: Element, at_s: float, place: str) -> float:
        gone_m, now_mps = way_and_speed(tuple(self.speeds), self._agent.speed_mps, at_s)
        dynamics = _find(action, "LaneChangeActionDynamics", place)
        value = read_float(dynamics, "value", place, 0.0)
        by = {"time": value, "rate": _LANE_M / max(value, 1e-3), "distance": 0.0}
        lasts_s = foreign.look_up(by, dynamics.get("dynamicsDimension"), place)
        later_m = way_and_speed(tuple(self.speeds), self._agent.speed_mps, at_s + lasts_s)[0]
        change_m = (later_m - gone_m) or value
        here = self._pose_after(gone_m, place)
        graph, target = self._reader.graph, action.find("LaneChangeTarget/*")
        lane_id = graph.under(here.x_m, here.y_m, here.heading_rad)
        if target is None or lane_id is None:
            raise fault_at(place, "a lane change needs a target, and a lane where it begins")
        number = foreign.read_whole(target.get("value"), f"{place}.LaneChangeTarget")
        if target.tag == "AbsoluteTargetLane":
            number = self._reader.count_lanes(here, number)
        elif target.get("entityRef") != self._name:
            raise fault_at(place, "a lane relative to somebody else's is not read")
        onto = lane_id
        for _ in range(abs(number)):
            lane = graph.lane(onto)
            side = "left_neighbor" if number > 0 else "right_neighbor"
            beside = getattr(lane, side, None)
            if beside is None:
                raise fault_at(place, f"there is no lane {number} lanes to the left to change to")
            onto = beside
        lanes = LanePath(lane_ids=(lane_id, onto), change_m=min(max(change_m, 1.0), 200.0))
        try:
            line = lane_line(graph, lanes, (here.x_m, here.y_m))
        except InvalidModification as fault:
            raise fault_at(place, str(fault)) from None
        if line is None:
            raise fault_at(place, "the lane ends where the lane change begins")
        if gone_m == 0.0 and self._line is None:
            self.path, self._line = lanes, line
        else:
            before = [self._pose_after(m, place) for m in np.arange(2.0, gone_m, 2.0)]
            rows = [(pose.x_m, pose.y_m) for pose in before]
            ahead = line.between(0.0, 300.0).resample(2.0).points_m.tolist()
            points = [*rows, *ahead]
            every = math.ceil(len(points) / _MOST_POINTS)
            self._line = Polyline([(self._here.x_m, self._here.y_m), *points])
            self.path = PointPath(points_m=tuple((x, y) for x, y in points[::every]))
        return lasts_s or change_m / max(now_mps, 1.0)

    def _pose_after(self, gone_m: float, place: str) -> Pose:
        """Return where it is so far after its start."""
        if self._line is not None:
            return self._line.pose_at(gone_m)
        here = self._here
        agent = replace(
            self._agent, x_m=here.x_m, y_m=here.y_m, heading_rad=here.heading_rad, lane_id=None
        )
        row = HeldCourse(agent, self._reader.graph).pose_at(gone_m)
        if row is None:
            raise fault_at(place, "is past the map when it begins")
        return Pose(x_m=row[0], y_m=row[1], heading_rad=row[2])

    def _follow(self, action: Element, at_s: float, place: str) -> float:
        if at_s > 0.0 or self.path is not None:
            raise fault_at(place, "a trajectory after another motion of the actor is left out")
        positions, times_s = read_vertices(action, place)
        points = self._reader.find_middles(self._name, positions, place)[:, :2]
        ways_m = np.cumsum(np.hypot(*np.diff(points, axis=0, prepend=points[:1]).T))
        apart = np.append(np.diff(np.round(ways_m, 2)) > 0.0, True)
        kept = points[apart][:: math.ceil(apart.sum() / _MOST_POINTS)]
        rows = [(float(x), float(y)) for x, y in np.round(kept, 4)]
        last = float(points[-1, 0]), float(points[-1, 1])
        self.path = PointPath(points_m=(*rows[: _MOST_POINTS - 1], last))
        if times_s is None:
            return float(ways_m[-1]) / max(self._agent.speed_mps, 0.1)
        self.speeds = fit_speeds(times_s - times_s[0], ways_m)
        return float(times_s[-1] - times_s[0])


def fit_speeds(times_s: FloatArray, ways_m: FloatArray) -> list[tuple[float, float]]:
    """Return few pairs of time and speed, linear between them, that make these ways (V,)."""
    gaps_s = np.diff(times_s)
    used = gaps_s > 1e-6
    middles_s, mps = (times_s[:-1] + gaps_s / 2.0)[used], (np.diff(ways_m)[used] / gaps_s[used])
    if not len(mps):
        return []
    # Who stops at once does so at the last point, where a path ends by itself.
    last = int(np.flatnonzero(mps > 1e-6)[-1]) if (mps > 1e-6).any() else 0
    drops = -np.diff(mps, prepend=mps[:1])
    if last >= 2 and drops[last : last + 2].max() > 2.0 * abs(drops[last - 1]) + 0.05:
        middles_s, mps = middles_s[:last], mps[:last]
    # Between two middles the mean speed of each half; at the ends the slope goes on.
    ends = (
        [mps[0] - (mps[1] - mps[0]) / 2.0, mps[-1] + (mps[-1] - mps[-2]) / 2.0]
        if len(mps) > 1
        else mps[[0, 0]]
    )
    knots = np.column_stack(
        [
            [
                times_s[0],
                *middles_s,
                2.0 * middles_s[-1] - middles_s[-2] if len(mps) > 1 else times_s[-1],
            ],
            np.maximum([ends[0], *mps, ends[1]], 0.0),
        ]
    )
    within_mps = 0.001
    while True:
        line = shapely.LineString(knots).simplify(within_mps, preserve_topology=False)
        rows = shapely.get_coordinates(line)
        if len(rows) <= _MOST_SPEEDS:
            return [(round(time_s, 4), round(speed_mps, 4)) for time_s, speed_mps in rows.tolist()]
        within_mps *= 2.0


def read_speed_target(action: Element, mps_of: Callable[[str], float], place: str) -> float:
    """Return the speed that an action leads to."""
    target = _find(action, "SpeedActionTarget/*", place)
    value = read_float(target, "value", place, -100.0, 100.0)
    if target.tag == "RelativeTargetSpeed":
        other_mps = mps_of(target.get("entityRef", ""))
        by = {"delta": other_mps + value, "factor": other_mps * value}
        value = foreign.look_up(by, target.get("speedTargetValueType"), place)
    if value < 0.0:
        raise fault_at(place, f"a speed of {value:g} m/s, backwards, is not read")
    return value


def _find(action: Element, path: str, place: str) -> Any:
    element = action.find(path)
    if element is None:
        raise fault_at(place, f"needs a {path}")
    return element
