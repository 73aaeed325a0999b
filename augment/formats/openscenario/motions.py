"""Planned motions of ours from the events of an actor.

The first event starts the motion; later ones of the same actor become part of it where they wait
for one before, or for a time as well. Frame: the ego frame of t0; the map has its own. T steps,
V vertices.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
import shapely

from augment import foreign
from augment.errors import InvalidDocument, InvalidModification
from augment.foreign import Doubts, FloatArray, fault_at
from augment.formats.opendrive.geometry import read_float
from augment.formats.opendrive.network import RoadNetwork
from augment.formats.openscenario.conditions import Done, Expectation, find_step, find_trigger
from augment.formats.openscenario.events import StoryEvent
from augment.formats.openscenario.positions import PositionReader, find_legs, step_lanes
from augment.formats.openscenario.sources import Entity
from augment.formats.openscenario.trajectories import trace
from augment.geometry.frames import Pose
from augment.geometry.polyline import Polyline
from augment.scene import planned_motion as planned
from augment.scene.entities import Scene, TrafficAgent
from augment.scene.lane_graph import LaneGraph
from augment.scene.motion import find_motion
from augment.scene.planned_motion import AtPlace, AtTime, LanePath, PlannedMotion, PointPath
from augment.scene.planned_mover import HeldCourse, lane_line, way_and_speed
from augment.scene.recording import Recording

_MOST_SPEEDS, _MOST_POINTS, _MOST_LANES = 50, 200, 20
_BESIDE_ROUTE_M = 15.0
"""Lanes of a route end no further from its roads' middles."""
_STEP_S, _JUMP_S = 0.01, 0.001
"""A step in speed takes so long, and one onto a trajectory with times."""
_ON_M, _THIN_M, _LATEST_S, _USUAL_MPS = 1_000.0, 0.0005, 60.0, 10.0
_SHAPES: dict[str, Callable[[float], float]] = {
    "linear": lambda share: share,
    **dict.fromkeys(("step", "carla:hold"), lambda share: share),
    "cubic": lambda share: share * share * (3.0 - 2.0 * share),
    "sinusoidal": lambda share: (1.0 - math.cos(math.pi * share)) / 2.0,
}


class Stage:
    """A scene, in which those who have events get motions one by one.

    Attributes:
        scene: With the motions so far.
        graph: Of its lanes.
        expected: Where everybody will be with them.
    """

    def __init__(
        self,
        scene: Scene,
        recording: Recording | None,
        *,
        network: RoadNetwork,
        placer: PositionReader,
        entities: Mapping[str, Entity],
        ids: Mapping[str, str],
    ) -> None:
        self.scene, self._ego_mps = scene, scene.ego.speed_mps
        self._recording, self._ids = recording, ids
        self._network, self._placer = network, placer
        self._origin, self.graph = scene.origin.pose, LaneGraph(scene)
        motion = find_motion(scene, recording=recording)
        here = {agent.id for agent in scene.everyone}
        present = {name: entities[name] for name in ids if name and ids[name] in here}
        self.expected = Expectation(
            times_s=motion.times_s,
            states={},
            centres_m={"": (0.0, 0.0)} | {n: e.centre_m for n, e in present.items()},
            sizes_m={"": scene.ego.size_m} | {n: e.size_m for n, e in present.items()},
            ids=ids,
            find_point=self.find_point,
        )
        self._expect(scene)

    def follow(self, agent: TrafficAgent) -> None:
        """Put an agent with its motion into the scene, and where it will be then."""
        agents = tuple(agent if other.id == agent.id else other for other in self.scene.agents)
        self.scene, by_id = replace(self.scene, agents=agents), {a.id: a for a in agents}
        # With those alone whom it waits for, and whom they do: a scene has many.
        needed, name = dict[str, TrafficAgent](), agent.id
        while name in by_id and name not in needed:
            needed[name], motion = by_id[name], by_id[name].motion
            name = motion.start.agent_id if motion and isinstance(motion.start, AtPlace) else ""
        self._expect(replace(self.scene, agents=tuple(needed.values())))

    def find_start(
        self, event: StoryEvent, name: str, doubts: Doubts
    ) -> tuple[planned.Trigger, int]:
        """Return how an event begins, and the step; an ego that stands may have to set off."""
        own_mps = self.scene.ego.speed_mps  # it may have set off for another alone
        for mps in (own_mps, *[_USUAL_MPS] * (self._recording is None and own_mps == 0.0)):
            self._set_off(mps)
            with suppress(InvalidDocument):
                found = find_trigger(event, name, self.expected, doubts)
                text = f"The ego stands: who waits for it sees it at {_USUAL_MPS:g} m/s"
                doubts.assume(text, mps != own_mps)
                return found
        self._set_off(own_mps)
        return find_trigger(event, name, self.expected, doubts)  # says why not

    def find_point(self, position: Element, place: str) -> Pose:
        """Return the pose that a Position says at t0."""
        return self._origin.pose_to_local(self._placer.find_pose(position, place))

    def trace(
        self, name: str, action: Element, place: str, step: int
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return somebody's middles (V, 3) along a trajectory from a step on; see `trace`."""
        placer = self._placer.at(self._poses_at(step), name)
        world, times_s = trace(action, self.expected.centres_m[name], placer, place)
        local = self._origin.to_local(world[:, :2])
        return np.column_stack([local, world[:, 2] - self._origin.heading_rad]), times_s

    def find_lane(self, name: str, here: Pose, target: Element, step: int, place: str) -> Pose:
        """Return the middle of the lane beside somebody that a lane change leads to at a step.

        Raises:
            InvalidDocument: There is none, or who it is relative to is on another road.
        """
        own = self._origin.pose_to_parent(here)
        road, s_m, _, lane_id = self._placer.locate(own, place)
        number = foreign.read_whole(target.get("value"), f"{place}.LaneChangeTarget")
        if target.tag != "AbsoluteTargetLane":
            other = target.get("entityRef", "")
            if other != name:
                own = foreign.look_up(self._poses_at(step), other, place)
                theirs, _, _, lane_id = self._placer.locate(own, place)
                if theirs.id != road.id:
                    raise fault_at(place, f"{other[:40]} is on another road, {theirs.id[:20]}")
            # To the left of where it heads.
            is_along = math.cos(own.heading_rad - road.pose_at(s_m, 0.0).heading_rad) > 0.0
            number = step_lanes(lane_id, number if is_along else -number)
        return self._origin.pose_to_local(road.lane_pose(number, s_m))

    def find_route(self, here: Pose, action: Element, place: str) -> FloatArray:
        """Return places (V, 2) in the middles of the roads along a route, from a pose on."""
        first = self._placer.locate(self._origin.pose_to_parent(here), place)
        places = self._placer.find_waypoints(action, place)
        legs = find_legs(self._network, places, place)
        if first[0].id not in {leg.road.id for leg in legs}:
            legs = [*find_legs(self._network, [first, places[0]], place), *legs]
        rows = [leg.road.line.poses_at(np.linspace(leg.from_m, leg.to_m, 100)) for leg in legs]
        return self._origin.to_local(np.vstack(rows)[:, :2])

    def _set_off(self, mps: float) -> None:
        self._ego_mps = mps
        self._expect(replace(self.scene, agents=()))

    def _expect(self, scene: Scene) -> None:
        scene = replace(scene, ego=replace(scene.ego, speed_mps=self._ego_mps))
        motion = find_motion(scene, recording=self._recording)
        states = {one.agent.id: one.states for one in (motion.ego, *motion.others)}
        self.expected.states.update(
            {name: states[number] for name, number in self._ids.items() if number in states}
        )

    def _poses_at(self, step: int) -> dict[str, Pose]:
        """Where points of reference are in the map's frame at a step."""
        poses = {}
        for name, states in self.expected.states.items():
            x_m, y_m = self.expected.references(name, name)[step].tolist()
            pose = Pose(x_m=x_m, y_m=y_m, heading_rad=float(states[step, 2]))
            if math.isfinite(x_m):
                poses[name] = self._origin.pose_to_parent(pose)
        return poses


def read_motion(
    stage: Stage, name: str, agent: TrafficAgent, events: Iterable[StoryEvent], doubts: Doubts
) -> None:
    """Give an agent on a stage the motion in its events, without what can't be read."""
    draft = _Draft(stage, name, agent, doubts)
    for event in events:
        with doubts.about("events"):
            draft.add(event)
        # Others may wait for somebody who moves so, and its own later events.
        stage.follow(draft.move_agent(Doubts()))
    draft.move_agent(doubts)  # what breaks a bound is noted once


class _Draft:
    """A motion while its events are added."""

    def __init__(self, stage: Stage, name: str, agent: TrafficAgent, doubts: Doubts) -> None:
        self._stage, self._name, self._agent, self._doubts = stage, name, agent, doubts
        self.start: planned.Trigger | None = None
        self.path: planned.Path | None = None
        self.speeds: list[tuple[float, float]] = []
        self._line: Polyline | None = None
        self._step = 0

    def move_agent(self, doubts: Doubts) -> TrafficAgent:
        """Return the agent with the motion so far."""
        if self.start is None or not (self.path or self.speeds):
            return self._agent
        motion = PlannedMotion(path=self.path, speeds=tuple(self.speeds), start=self.start)
        # What breaks a bound of motions is left out.
        bounded = doubts.read("motions", planned.MOTION.from_parts, planned.MOTION.dump(motion))
        return replace(self._agent, motion=bounded)

    def add(self, event: StoryEvent) -> None:
        """Add what an event does; raises InvalidDocument if it can't be."""
        begins_s, ends_s = self._begin(event), 0.0
        if begins_s >= _LATEST_S:
            raise fault_at(event.place, f"begins over {_LATEST_S:g} s after the first")
        start, times_s = self.start, self._stage.expected.times_s
        assert start is not None
        for kind, action in event.actions:
            act: dict[str, Callable[[Element, float, str], float]] = {
                "SpeedAction": self._change_speed,
                "LaneChangeAction": self._change_lane,
                "FollowTrajectoryAction": self._follow,
                "AssignRouteAction": self._take_route,
            }
            lasts_s = foreign.look_up(act, kind, event.place)(action, begins_s, event.place)
            ends_s = max(ends_s, begins_s + lasts_s)
        started_s, name = float(times_s[self._step]), self._name
        done = Done(actor=name, start=start, started_s=started_s, begins_s=begins_s, ends_s=ends_s)
        self._stage.expected.done.update(dict.fromkeys(event.names, done))

    def _begin(self, event: StoryEvent) -> float:
        """Set the start by the first event, and return how long after it an event begins."""
        expected, doubts = self._stage.expected, self._doubts
        start: planned.Trigger
        if (wait := event.waits_for) is not None:
            done = expected.find_done(wait, event.place)
            delay_s = foreign.read_number(
                event.conditions[0].get("delay") or "0", event.place, 0.0
            )
            since_s = done.since_s(wait) + delay_s
            if done.actor == self._name and self.start is not None:
                return since_s
            if not isinstance(done.start, AtTime):
                raise fault_at(event.place, "waits for what starts by no time")
            time_s = done.start.after_s + since_s
            start, step = AtTime(after_s=time_s), self._step_at(time_s)
        elif self.start is None:
            start, step = self._stage.find_start(event, self._name, doubts)
        elif event.time_s is None:
            step, _ = find_step(event, expected)
            if step < self._step:
                raise fault_at(event.place, "begins before its actor's first event")
            doubts.assume(f"{event.place} begins so long after the first as its conditions hold")
            return float(expected.times_s[step] - expected.times_s[self._step])
        else:
            start = AtTime(after_s=event.time_s)
        if self.start is None:
            x_m, y_m, heading_rad, _ = expected.states[self._name][step].tolist()
            if not math.isfinite(x_m):
                raise fault_at(event.place, "is past the map when it begins")
            self.start, self._step = start, step
            self._here = Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)
            return 0.0
        assert isinstance(start, AtTime)
        if not isinstance(self.start, AtTime) or start.after_s < self.start.after_s:
            raise fault_at(event.place, "begins by a time, and not after the actor's first event")
        return start.after_s - self.start.after_s

    def _step_since(self, at_s: float) -> int:
        return self._step_at(float(self._stage.expected.times_s[self._step]) + at_s)

    def _step_at(self, time_s: float) -> int:
        times_s = self._stage.expected.times_s
        return min(int(np.searchsorted(times_s, time_s - 1e-9)), len(times_s) - 1)

    # Actions; each returns how long it takes

    def _change_speed(self, action: Element, at_s: float, place: str) -> float:
        now_mps = way_and_speed(tuple(self.speeds), self._agent.speed_mps, at_s)[1]
        step, expected = self._step_since(at_s), self._stage.expected
        goal_mps = read_speed_target(
            action, lambda name: expected.find_states(name, place)[step, 3], f"{place}.SpeedAction"
        )
        dynamics = _find(action, "SpeedActionDynamics", place)
        by, kind = dynamics.get("dynamicsDimension"), dynamics.get("dynamicsShape")
        value = abs(read_float(dynamics, "value", place, default=0.0))
        shape = foreign.look_up(_SHAPES, kind, place)
        is_held = kind == "carla:hold"
        mean_mps = max(goal_mps if is_held else (goal_mps + now_mps) / 2.0, 0.1)
        rated_s, way_s = abs(goal_mps - now_mps) / max(value, 1e-6), value / mean_mps
        spans_s = {"time": value, "rate": value if is_held else rated_s, "distance": way_s}
        held_s = max(foreign.look_up(spans_s, by, f"{place}.dynamicsDimension"), _STEP_S)
        lasts_s = _STEP_S if is_held or kind == "step" else held_s
        self.speeds = [row for row in self.speeds if row[0] < at_s - _STEP_S]
        shares = (0.0, 1.0) if shape(0.25) == 0.25 else np.linspace(0.0, 1.0, 7).tolist()
        # So much of it as is over by the last moment.
        for share in np.multiply(shares, min((_LATEST_S - at_s) / lasts_s, 1.0)).tolist():
            mps = now_mps + shape(share) * (goal_mps - now_mps)
            self.speeds.append((round(at_s + share * lasts_s, 4), mps))
        return held_s if is_held else lasts_s

    def _change_lane(self, action: Element, at_s: float, place: str) -> float:
        gone_m, now_mps = way_and_speed(tuple(self.speeds), self._agent.speed_mps, at_s)
        dynamics = _find(action, "LaneChangeActionDynamics", place)
        value = abs(read_float(dynamics, "value", place))
        here = self._pose_after(gone_m, place)
        graph, target = self._stage.graph, _find(action, "LaneChangeTarget/*", place)
        goal = self._stage.find_lane(self._name, here, target, self._step_since(at_s), place)
        apart_m = math.hypot(goal.x_m - here.x_m, goal.y_m - here.y_m)
        by = {"time": value, "rate": apart_m / max(value, 1e-3), "distance": 0.0}
        lasts_s = foreign.look_up(by, dynamics.get("dynamicsDimension"), place)
        later_m = way_and_speed(tuple(self.speeds), self._agent.speed_mps, at_s + lasts_s)[0]
        change_m = (later_m - gone_m) or value
        onto = graph.under(goal.x_m, goal.y_m, goal.heading_rad)
        if onto is None or not self._drives_along(onto, here):
            raise fault_at(place, "there is no lane in its direction to change to")
        lane_id = graph.under(here.x_m, here.y_m, here.heading_rad)
        lane_id = lane_id if lane_id and self._drives_along(lane_id, here) else onto
        shape = dynamics.get("dynamicsShape")
        foreign.look_up(_SHAPES, shape, f"{place}.LaneChangeActionDynamics")
        is_sharp = shape in ("linear", "step")
        self._doubts.assume(f"A {shape} lane change became a smooth one", is_sharp)
        is_offset = read_float(action, "targetLaneOffset", place, default=0.0) != 0.0
        self._doubts.assume("The offset after a lane change was left out", is_offset)
        lane_ids = tuple(dict.fromkeys((lane_id, onto)))
        lanes = LanePath(lane_ids=lane_ids, change_m=min(max(change_m, 1.0), 200.0))
        try:
            line = lane_line(graph, lanes, (here.x_m, here.y_m))
        except InvalidModification as fault:
            raise fault_at(place, str(fault)) from None
        if line is None:
            raise fault_at(place, "the lane ends where the lane change begins")
        if gone_m == 0.0 and self._line is None:
            self.path, self._line = lanes, line
        else:
            self._go_on(gone_m, line.between(0.0, _ON_M).resample(2.0).points_m, place)
        return lasts_s or change_m / max(now_mps, 1.0)

    def _drives_along(self, lane_id: str, here: Pose) -> bool:
        line = self._stage.graph.lane(lane_id).centerline
        along_rad = line.heading_at(line.project(here.x_m, here.y_m).s_m)
        return math.cos(along_rad - here.heading_rad) > 0.0

    def _go_on(self, gone_m: float, points: FloatArray, place: str) -> None:
        """Follow points (V, 2) once it has gone so far."""
        before = [self._pose_after(m, place) for m in np.arange(2.0, gone_m, 2.0)]
        rows = np.array([*((pose.x_m, pose.y_m) for pose in before), *points]).reshape(-1, 2)
        apart = np.append(np.hypot(*np.diff(rows, axis=0).T) > 0.005, True)
        line = np.vstack([[self._here.x_m, self._here.y_m], rows[apart]])
        # Where it begins, but for rounding, is no point of its way.
        line = line[np.append(True, np.hypot(*np.diff(line, axis=0).T) > 0.005)]
        thinned = np.round(_thin(line[1:]), 4).tolist()
        self.path, self._line = PointPath(points_m=tuple(map(tuple, thinned))), Polyline(line)

    def _pose_after(self, gone_m: float, place: str) -> Pose:
        """Return where it is so far after its start."""
        if self._line is not None:
            return self._line.pose_at(gone_m)
        here = self._here
        agent = replace(
            self._agent, x_m=here.x_m, y_m=here.y_m, heading_rad=here.heading_rad, lane_id=None
        )
        row = HeldCourse(agent, self._stage.graph).pose_at(gone_m)
        if row is None:
            raise fault_at(place, "is past the map when it begins")
        return Pose(x_m=row[0], y_m=row[1], heading_rad=row[2])

    def _follow(self, action: Element, at_s: float, place: str) -> float:
        middles, times_s = self._stage.trace(self._name, action, place, self._step_since(at_s))
        gone_m, now_mps = way_and_speed(tuple(self.speeds), self._agent.speed_mps, at_s)
        points = middles[:, :2]
        ways_m = np.cumsum(np.hypot(*np.diff(points, axis=0, prepend=points[:1]).T))
        if times_s is None:
            # It goes on at its end, where it had no time to be there.
            x_m, y_m, heading_rad = middles[-1].tolist()
            end = replace(self._agent, x_m=x_m, y_m=y_m, heading_rad=heading_rad, lane_id=None)
            course = HeldCourse(end, self._stage.graph)
            further = (course.pose_at(m) for m in np.arange(2.0, _ON_M, 2.0))
            points = np.array([*points, *(row[:2] for row in further if row is not None)])
        self._go_on(gone_m, points, place)
        if times_s is None:
            return float(ways_m[-1]) / max(now_mps, 0.1)
        fitted = fit_speeds(times_s - times_s[0], ways_m)
        before = [row for row in self.speeds if row[0] < at_s - _STEP_S]
        before += [(round(at_s - _JUMP_S, 4), now_mps)] * (at_s > _STEP_S)
        self.speeds = [*before, *((round(at_s + since_s, 4), mps) for since_s, mps in fitted)]
        return float(times_s[-1] - times_s[0])

    def _take_route(self, action: Element, at_s: float, place: str) -> float:
        """Go the lanes of a route, as far as the map goes."""
        gone_m = way_and_speed(tuple(self.speeds), self._agent.speed_mps, at_s)[0]
        here, graph = self._pose_after(gone_m, place), self._stage.graph
        lane_id = graph.under(here.x_m, here.y_m, here.heading_rad)
        if lane_id is None or self.path is not None or at_s > 0.0:
            raise fault_at(place, "a route needs a lane where it begins, and no motion before it")
        route = shapely.LineString(self._stage.find_route(here, action, place))
        lane_ids = [lane_id]
        while len(lane_ids) < _MOST_LANES and (after := graph.successors(lane_ids[-1])):
            ends = [shapely.Point(graph.lane(name).centerline.points_m[-1]) for name in after]
            away_m, nearest = min((route.distance(e), n) for n, e in enumerate(ends))
            if away_m > _BESIDE_ROUTE_M:
                break
            lane_ids.append(after[nearest])
        self.path = LanePath(lane_ids=tuple(lane_ids))
        self._line = lane_line(graph, self.path, (here.x_m, here.y_m))
        return 0.0


def fit_speeds(times_s: FloatArray, ways_m: FloatArray) -> list[tuple[float, float]]:
    """Return few pairs of time and speed, linear between them, that make these ways (V,)."""
    gaps_s = np.diff(times_s)
    used = gaps_s > 1e-6
    middles_s, mps = (times_s[:-1] + gaps_s / 2.0)[used], (np.diff(ways_m)[used] / gaps_s[used])
    if not len(mps):
        return []
    # Who stops at once does so at the last point, where a path ends by itself.
    last, end_s = int(np.flatnonzero(mps > 1e-6)[-1]) if (mps > 1e-6).any() else 0, times_s[-1]
    drops = -np.diff(mps, prepend=mps[:1])
    if last >= 2 and drops[last : last + 2].max() > 2.0 * abs(drops[last - 1]) + 0.05:
        middles_s, mps = middles_s[:last], mps[:last]
        end_s = 2.0 * middles_s[-1] - middles_s[-2]
    # Between two middles the mean speed of each half; at the ends the slope goes on.
    slopes = np.diff(mps) / np.diff(middles_s) if len(mps) > 1 else np.zeros(1)
    first_mps = mps[0] - slopes[0] * (middles_s[0] - times_s[0])
    last_mps = mps[-1] + slopes[-1] * (end_s - middles_s[-1])
    fitted_mps = np.maximum([first_mps, *mps, last_mps], 0.0)
    knots = np.column_stack([[times_s[0], *middles_s, end_s], fitted_mps])
    within_mps = 0.001
    while True:
        line = shapely.LineString(knots).simplify(within_mps, preserve_topology=False)
        if len(line.coords) <= _MOST_SPEEDS:
            return [(round(time_s, 4), round(speed_mps, 4)) for time_s, speed_mps in line.coords]
        within_mps *= 2.0


def read_speed_target(action: Element, mps_of: Callable[[str], float], place: str) -> float:
    """Return the speed that an action leads to."""
    target = _find(action, "SpeedActionTarget/*", place)
    value = read_float(target, "value", place, -100.0, 100.0)
    if target.tag == "RelativeTargetSpeed":
        other_mps = mps_of(target.get("entityRef", ""))
        by = {"delta": other_mps + value, "factor": other_mps * value}
        value = foreign.look_up(by, target.get("speedTargetValueType", "delta"), place)
    if value < 0.0:
        raise fault_at(place, f"a speed of {value:g} m/s, backwards, is not read")
    return value


def _thin(rows: FloatArray) -> FloatArray:
    """Return those of the rows (R, 2) that a smooth line needs to lead by all of them."""
    from scipy.interpolate import PchipInterpolator

    ways_m = np.cumsum(np.hypot(*np.diff(rows, axis=0, prepend=rows[:1]).T))
    kept = np.unique([0, len(rows) - 1])
    while 1 < len(kept) < _MOST_POINTS:
        off_m = np.hypot(*(PchipInterpolator(ways_m[kept], rows[kept])(ways_m) - rows).T)
        worst = kept[:-1] + [int(gap.argmax()) for gap in np.split(off_m, kept[1:-1])]
        worst = worst[off_m[worst] > _THIN_M]
        if not len(worst):
            break
        most = np.argsort(-off_m[worst])[: _MOST_POINTS - len(kept)]
        kept = np.union1d(kept, worst[most])
    return np.asarray(rows[kept])


def _find(action: Element, path: str, place: str) -> Any:
    element = action.find(path)
    if element is None:
        raise fault_at(place, f"needs a {path}")
    return element
