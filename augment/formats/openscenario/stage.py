"""A scene with what is known of its scenario: where everybody will be, and what lies where.

Frame: the ego frame of t0; the map has its own. T steps.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from xml.etree.ElementTree import Element

import numpy as np

from augment import foreign
from augment.foreign import FloatArray, fault_at
from augment.formats.opendrive.network import RoadNetwork
from augment.formats.openscenario.conditions import Expectation
from augment.formats.openscenario.positions import PositionReader, find_legs, step_lanes
from augment.formats.openscenario.sources import Entity
from augment.formats.openscenario.trajectories import trace
from augment.geometry.frames import Pose
from augment.scene.entities import Scene, TrafficAgent
from augment.scene.lane_graph import LaneGraph
from augment.scene.motion import find_motion
from augment.scene.planned_motion import AtPlace
from augment.scene.recording import Recording


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
        self.scene, self._recording, self._ids = scene, recording, ids
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

    def find_point(self, position: Element, place: str) -> Pose:
        """Return the pose that a Position says at t0."""
        return self._origin.pose_to_local(self._placer.find_pose(position, place))

    def trace(
        self, name: str, action: Element, place: str, step: int
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return somebody's middles (V, 3) along a trajectory from a step on; see `trace`."""
        placer = self._placer.at(self._poses_at(step))
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

    def _expect(self, scene: Scene) -> None:
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
