"""The reader of OpenSCENARIO scenarios at t0, with what moves as motions of ours.

`item` is the entity that becomes the ego, or "@ROAD,LANE,S" to put one on a lane. Whoever follows
a trajectory by the clock alone was recorded, as it were; whatever else moves gets a motion.
"""

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from augment import foreign
from augment.errors import InvalidDocument
from augment.foreign import FloatArray, fault_at
from augment.formats.opendrive.geometry import read_float
from augment.formats.opendrive.maps import map_around
from augment.formats.opendrive.reader import parse_place
from augment.formats.openscenario.events import (
    ACTIONS,
    GONE,
    StoryEvent,
    describe_action,
    list_events,
)
from augment.formats.openscenario.motions import Stage, read_motion, read_speed_target
from augment.formats.openscenario.positions import PositionReader
from augment.formats.openscenario.sources import EGO_NAMES, ScenarioSource, is_catalog
from augment.formats.openscenario.trajectories import trace
from augment.formats.reading import Log, LogReader, Moment, Reading
from augment.geometry.frames import Pose, wrap
from augment.scene.entities import EGO_LENGTH_M, EGO_WIDTH_M, AgentType, TrafficLight
from augment.scene.motion import STEP_S, read_at
from augment.scene.recording import Track

_LIGHT_ACTION, _PHASE_ACTION = "TrafficSignalStateAction", "TrafficSignalControllerAction"
LONGEST_S = 60.0
"""Trajectories are read so far."""
_STATES = foreign.name_all(
    {
        TrafficLight.GREEN: "green go off;off;on",
        TrafficLight.YELLOW: "yellow amber attention off;on;off",
        TrafficLight.RED: "red stop on;off;off on;on;off",
        TrafficLight.UNKNOWN: "off off;off;off",
    }
)
NO_EGO = (
    "nobody is called {}, and not just one vehicle is here; who could be, as the item (--ego): {}"
)


class OpenScenario(LogReader):
    """The reader of OpenSCENARIO XML with its OpenDRIVE map."""

    name = "openscenario"
    title = "OpenSCENARIO scenario, 1.0 to 1.3, with its OpenDRIVE map (.xosc file, or a zip)"
    suffix, marker = ".xosc", b"<OpenSCENARIO"

    def recognises(self, path: Path) -> bool:
        """Return whether the file is a scenario, and no catalog."""
        return super().recognises(path) and not is_catalog(path)

    def logs(self, path: Path, item: str | None) -> Iterator[Log]:
        """The one with that ego."""
        yield _Scenario(path, item, self.reach_m).log()

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Yield t0 with each vehicle as the ego, the one that is meant first."""
        scenario = _Scenario(path, None, self.reach_m)
        for name in sorted(scenario.drivers, key=lambda name: name != scenario.ego_name):
            yield Moment(item=name)

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """Return the scene at t0."""
        if frame:
            raise fault_at("frame", f"{frame} is not there; a scenario has frame 0 alone")
        scenario = _Scenario(path, item, self.reach_m)
        return scenario.add_motions(scenario.log().reading_at(0, name, self.reach_m))


class _Scenario:
    """A scenario while it is read.

    Attributes:
        drivers: Names of those who can be the ego.
        ego_name: Of the ego; None where it is put on a lane.
    """

    def __init__(self, path: Path, item: str | None, reach_m: float) -> None:
        self._source, self._reach_m, self._stem = ScenarioSource(path), reach_m, path.stem[:80]
        self._doubts, self._network = self._source.doubts, self._source.open_map()
        self._entities = self._source.entities()
        self._events = list_events(self._source)
        self._positions, self._speeds = dict[str, Element](), dict[str, Element]()
        self._starts = dict[str, Element]()
        for private in self._source.root.findall("Storyboard/Init/Actions/Private"):
            for action in private.findall("PrivateAction"):
                self._begin(private.get("entityRef", ""), action)
        for action in self._source.root.findall("Storyboard/Init/Actions/GlobalAction"):
            if (kind := describe_action(action)) not in (_LIGHT_ACTION, _PHASE_ACTION):
                self._doubts.assume(f"{kind} at t0 was left out")
        read = self._doubts.read
        self._mps = {name: read("speeds", self._read_speed, name) for name in self._speeds}
        self._placer = PositionReader(self._network, self._positions)
        for name in (name for name in self._starts if name not in self._positions):
            with self._doubts.about("entities"):
                rows, _ = trace(self._starts[name], (0.0, 0.0), self._placer.at({}, name), name)
                x, y, h = map(repr, rows[0].tolist())
                self._positions[name] = Element("Position")
                SubElement(self._positions[name], "WorldPosition", x=x, y=y, h=h)
        self._middles = dict[str, FloatArray]()
        for name in (name for name in self._entities if name in self._positions):
            with self._doubts.about("entities"):
                pose = self._placer.entity_pose(name)
                (middle,) = pose.to_parent(np.array([self._entities[name].centre_m]))
                self._middles[name] = np.array([*middle, pose.heading_rad])
        cars = (AgentType.VEHICLE, AgentType.BUS)
        self.drivers = [
            n for n, e in self._entities.items() if n in self._middles and e.type in cars
        ]
        self.ego_name = self._find_ego(item)
        self._tracks, self._gone_s = dict[str, tuple[FloatArray, FloatArray]](), dict[str, float]()
        for name in self._entities:
            # Those of others are read again, as events, where they are no track.
            is_ego, about = name == self.ego_name, self._doubts.about("trajectories")
            with about if is_ego else suppress(InvalidDocument):
                self._read_track(name)

    def log(self) -> Log:
        """Return everybody's states, of those without a trajectory by the clock at t0 alone."""
        last_s = min(max([0.0, *(times[-1] for times, _ in self._tracks.values())]), LONGEST_S)
        times_s = np.arange(round(last_s / STEP_S) + 1) * STEP_S
        placed = [n for n in self._entities if n in self._middles or n in self._tracks]
        states = {name: self._states(name, times_s) for name in placed}
        lost = len(self._entities) - len(states)
        self._doubts.assume("Somebody who is put nowhere at t0 was left out", lost)
        ego = states.pop(self.ego_name, None) if self.ego_name else None
        size_m = self._entities[self.ego_name].size_m if self.ego_name else None
        if self.ego_name is None:
            ego = np.full((len(times_s), 4), np.nan)
            ego[0] = [*self._put, 0.0]
        assert ego is not None
        pose = Pose(x_m=ego[0, 0], y_m=ego[0, 1], heading_rad=wrap(ego[0, 2]))
        licences = (e.get("name", "") for e in self._source.root.iterfind("FileHeader/License"))
        return Log(
            times_s=times_s,
            ego=ego,
            ego_size_m=size_m or (EGO_LENGTH_M, EGO_WIDTH_M),
            tracks=[self._track(name, rows) for name, rows in states.items()],
            map_at=lambda _: map_around(self._network, pose, self._reach_m, self._lights()),
            world=f"OpenSCENARIO frame of {self._stem}",
            title=f"OpenSCENARIO scenario {self._stem}",
            licence=next(licences, "").strip()[:200] or "no licence named",
            is_free=True,
            item=self.ego_name,
        )

    def add_motions(self, reading: Reading) -> Reading:
        """Return the reading with the motions of those who have events."""
        scene, recording, names = reading.scene, reading.recording, reading.names
        assert recording is not None
        kept = tuple(t for t in recording.tracks if names[t.agent_id] in self._tracks)
        is_recorded = bool(kept or self.ego_name in self._tracks)
        recording = replace(recording, tracks=kept) if is_recorded else None
        ids = {name: agent_id for agent_id, name in names.items()}
        ids[self.ego_name or ""] = scene.ego.id
        stage = Stage(
            scene,
            recording,
            network=self._network,
            placer=self._placer,
            entities=self._entities,
            ids=ids,
        )
        if self.ego_name in self._events.keys() - self._tracks.keys():
            self._doubts.assume(
                "The ego's own events and route were left out: a planner drives it"
            )
        unknown = len(self._events.keys() - self._entities.keys())
        self._doubts.assume("Events of somebody who is not there were left out", unknown)
        for name in self._order_actors():
            agent = next((agent for agent in scene.agents if agent.id == ids.get(name)), None)
            if agent is not None and name not in self._tracks:
                events = self._choose_events(self._events[name])
                read_motion(stage, name, agent, events, self._doubts)
        notes = *reading.notes, *self._doubts.notes
        return replace(reading, scene=stage.scene, recording=recording, notes=notes)

    def _order_actors(self) -> list[str]:
        """Return who has events, those who wait for none of the others first."""
        owners = {
            n: name for name, events in self._events.items() for e in events for n in e.names
        }

        def count(name: str) -> int:
            parts = [p for e in self._events[name] for c in e.conditions for p in c.iter()]
            elements = (part.get("storyboardElementRef", "").split("::")[-1] for part in parts)
            watched = {part.get("entityRef") for part in parts} | set(map(owners.get, elements))
            return len(watched & (self._events.keys() - {name, self.ego_name}))

        return sorted(self._events, key=count)

    def _choose_events(self, events: list[StoryEvent]) -> list[StoryEvent]:
        """Return the events of a motion, without trajectories before one that waits."""
        following = [e for e in events if "FollowTrajectoryAction" in dict(e.actions)]
        waits = any(e.time_s is None and e.waits_for is None for e in following)
        before = [e for e in following if waits and e.time_s is not None]
        text = "Before a trajectory that waits, somebody holds speed and lane"
        self._doubts.assume(text, len(before))
        return [e for e in events if dict(e.actions).keys() & ACTIONS.keys() and e not in before]

    # Entities at t0

    def _begin(self, name: str, action: Element) -> None:
        """Take an action at t0: a place, a speed, or what goes on from there."""
        kind = describe_action(action)
        position = action.find("TeleportAction/Position")
        found = action.find(ACTIONS.get(kind, "-"))
        if position is not None:
            self._positions[name] = position
        elif kind == "SpeedAction" and found is not None and _is_step(found):
            self._speeds[name] = found
        elif found is not None:
            if kind == "FollowTrajectoryAction":
                self._starts[name] = found
            made = StoryEvent(
                place=f"Init of {name[:40]}", names=(), groups=(), actions=((kind, found),)
            )
            self._events[name].insert(0, made)
        else:
            self._doubts.assume(f"{kind} at t0 was left out")

    def _read_speed(self, name: str, depth: int = 0) -> float:
        if name not in self._speeds or depth > len(self._speeds):
            return 0.0
        place, action = f"speed of {name[:40]}", self._speeds[name]
        return read_speed_target(action, lambda other: self._read_speed(other, depth + 1), place)

    def _find_ego(self, item: str | None) -> str | None:
        if item is not None and item.startswith("@"):
            road_id, lane_id, s_m = parse_place(item)
            pose = self._network.road(road_id).lane_pose(lane_id, s_m)
            self._put = pose.x_m, pose.y_m, pose.heading_rad
            return None
        drivers = dict.fromkeys(self.drivers)
        if item is not None:
            foreign.look_up(drivers, item, "item")
            return item
        told = [name for name, entity in self._entities.items() if entity.is_ego]
        meant = [*told, *(name for name in EGO_NAMES if name in self._entities)]
        # Nobody takes the place of one that can't be read.
        is_alone = len(drivers) == 1 and not meant
        candidates = [*drivers] if is_alone else [name for name in meant if name in drivers]
        if not candidates:
            offer = ", ".join([*drivers][:12]) or "nobody"
            reasons = [NO_EGO.format(" or ".join(EGO_NAMES), offer), *self._doubts.notes]
            raise fault_at("ego", "; ".join(reasons))
        return candidates[0]

    def _lights(self) -> dict[str, TrafficLight]:
        """Return the states of lights at t0, by their ids."""
        root, rows = self._source.root, list[tuple[Element, str]]()
        actions = root.findall("Storyboard/Init/Actions/GlobalAction//*")
        chosen = {a.get("trafficSignalControllerRef"): a.get("phase") for a in actions}
        for controller in root.iterfind("RoadNetwork//TrafficSignalController"):
            name, place = controller.get("name", ""), "phase of a light's controller"
            phases = {phase.get("name"): phase for phase in controller.iterfind("Phase")}
            with self._doubts.about("states of lights"):
                if name not in chosen and read_float(controller, "delay", place, default=0.0):
                    raise fault_at(place, f"{name[:40]} begins later, by its delay")
                phase = foreign.look_up(phases, chosen.get(name, next(iter(phases), None)), place)
                rows += [(e, "trafficSignalId") for e in phase.iterfind("TrafficSignalState")]
        lights = {}
        for element, named in (*rows, *((a, "name") for a in actions if a.tag == _LIGHT_ACTION)):
            name, text = element.get(named, ""), element.get("state", "").lower()
            with self._doubts.about("states of lights"):
                lights[name] = foreign.look_up(_STATES, text, f"light {name[:40]}")
        return lights

    # Trajectories by the clock

    def _read_track(self, name: str) -> None:
        """Keep the states of somebody whose events are trajectories by the clock alone."""
        events = self._events.get(name, [])
        moves = [e for e in events if any(kind != GONE for kind, _ in e.actions)]
        timed = [e for e in moves if e.time_s is not None]
        kinds = {kind for event in moves for kind, _ in event.actions}
        if not moves or len(timed) < len(moves) or kinds != {"FollowTrajectoryAction"}:
            return
        rows = np.empty((0, 4))
        for event in sorted(timed, key=lambda event: event.time_s or 0.0):
            (_, action), *_ = event.actions
            start_s, centre_m = event.time_s or 0.0, self._entities[name].centre_m
            # What goes by where somebody is later is read as an event.
            is_later = start_s > 0.0 and name != self.ego_name
            placer = PositionReader(self._network, {} if is_later else self._positions)
            middles, times_s = trace(action, centre_m, placer.at({}, name), event.place)
            if times_s is None:
                return
            if action.find("TimeReference/Timing[@domainAbsoluteRelative='relative']") is not None:
                times_s = times_s + start_s
            rows = rows[rows[:, 0] < start_s - 1e-6]
            made = np.column_stack([times_s, middles])[times_s >= start_s - 1e-6]
            rows = np.vstack([rows, made])
        rows = rows[np.append(np.diff(rows[:, 0]) > 1e-9, True)]
        if len(rows) < 2:
            return
        if name in self._middles and rows[0, 0] > 1e-6:
            waits = [[s, *self._middles[name]] for s in (0.0, rows[0, 0] - 1e-3)]
            rows = np.vstack([waits[: 1 if self._mps.get(name) else 2], rows])
        gone = [e for e in events if any(kind == GONE for kind, _ in e.actions)]
        ends = [e.time_s for e in gone if e.time_s is not None]
        # Who is taken away without a time is so where its trajectory ends.
        gone_s = min(ends) - 1e-3 if ends else rows[-1, 0] if gone else math.inf
        steps_m = np.hypot(*np.diff(rows[:, 1:3], axis=0).T)
        mps = np.gradient(np.concatenate([[0.0], np.cumsum(steps_m)]), rows[:, 0])
        states = np.column_stack([rows[:, 1:3], np.unwrap(rows[:, 3]), mps])
        self._tracks[name] = rows[:, 0], states
        self._gone_s[name] = gone_s

    def _states(self, name: str, times_s: FloatArray) -> FloatArray:
        """Return an entity's states (T, 4); NaN where it is not, or nobody knows."""
        states = np.full((len(times_s), 4), np.nan)
        if name in self._tracks:
            track_s, rows = self._tracks[name]
            states = read_at(rows, track_s, times_s)
            absent = (times_s < track_s[0] - 1e-6) | (times_s > self._gone_s[name] + 1e-6)
            states[absent] = np.nan
        if name in self._middles:
            mps = self._mps.get(name, states[0, 3])
            states[0] = np.nan_to_num([*self._middles[name], mps or 0.0])
        return states

    def _track(self, name: str, states: FloatArray) -> Track:
        kind, (length_m, width_m) = self._entities[name].type, self._entities[name].size_m
        return Track(agent_id=name, type=kind, length_m=length_m, width_m=width_m, states=states)


def _is_step(action: Element) -> bool:
    dynamics = action.find("SpeedActionDynamics")
    if dynamics is None or dynamics.get("dynamicsShape") == "step":
        return True
    return read_float(dynamics, "value", "SpeedActionDynamics") == 0.0
