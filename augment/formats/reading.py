"""Interface of all readers: from a log and a map in their world frame to a scene.

A reader knows one format of recorded data and opens a path as `Log`s. What all need once times,
ego, tracks and map are known is done here: who is near, in which order they are named, which lane
lies under them. Metres are rounded to millimetres, so that people can read documents. T steps.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from augment import foreign
from augment.errors import InvalidDocument
from augment.foreign import FASTEST_MPS, FURTHEST, Doubts, FloatArray, fault_at
from augment.formats.road_map import RoadMap, complete_map
from augment.formats.roads import RADIUS_M, refuse_shape, road_around, segment_centreline
from augment.geometry.frames import Pose, wrap
from augment.scene import entities
from augment.scene.entities import EGO_LENGTH_M, EGO_WIDTH_M, AgentType, Scene, TrafficAgent
from augment.scene.lane_graph import LaneGraph
from augment.scene.recording import Recording, Track, track_agent

if TYPE_CHECKING:
    import pandas as pd

LONGEST_M = 100.0
"""No road user is longer."""
LONGEST_GAP_S = 0.35
"""Steps are 0.1 s apart; over a longer gap no speed is taken."""
NEIGHBOURS = 2
"""Steps on either side that a speed is taken over: one alone shows the annotators' jitter."""
_STANDING = (AgentType.TRAFFIC_CONE, AgentType.BARRIER, AgentType.CONSTRUCTION_SIGN)
_HEADED = (AgentType.EGO_VEHICLE, AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE)
STATE = ("x_m", "y_m", "heading_rad", "speed_mps")
"""The columns of a state."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """A time that can become t0.

    Attributes:
        item: Which part of a file that holds several; None where there is one. A number of a
            record, a planning problem, a lidar_pc token.
        frame: The step of it, from 0.
        time_s: Since the first step of its part; None where there is one step alone.
    """

    item: str | None = None
    frame: int = 0
    time_s: float | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A scene, what was recorded from it on, and what the source did not say.

    Attributes:
        recording: None for a source that is no recording.
        notes: A sentence on every loss and assumption.
        moment: What was taken.
        names: What the source calls the agents, by their ids; empty where these are the same.
        places: Of a map alone: s_m, and x_m and y_m in the ego frame, along each lane by its name.
    """

    scene: Scene
    recording: Recording | None
    notes: tuple[str, ...] = ()
    moment: Moment = Moment()
    names: Mapping[str, str] = field(default_factory=dict)
    places: Mapping[str, list[tuple[float, float, float]]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Log:
    """One part of a recording: what moved, the map, and where it comes from.

    Attributes:
        times_s: (T,) ascending.
        ego: (T, 4), as a track's states, of the ego's geometric centre.
        ego_size_m: Its length and width.
        tracks: In the world frame, by their ids in the source, which order those that are equally
            near; sizes are what it says, be it none.
        map_at: The map with the lights of a frame, as far as the ego can see at least.
        world: What the source's frame is called.
        title: The data set and the part of it.
        licence: What stands beside the title; none where it is empty.
        is_free: Whether the licence allows commercial use.
        item: Which part it is, see `Moment`.
        frame: The one that the format means to be t0.
        notes: What neither the tracks nor the map tell.
        no_ego: Why nobody can be the ego, and who could; empty where somebody is.
    """

    times_s: FloatArray
    ego: FloatArray
    ego_size_m: tuple[float, float]
    tracks: Sequence[Track]
    map_at: Callable[[int], RoadMap]
    world: str
    title: str
    licence: str
    is_free: bool = False
    item: str | None = None
    frame: int = 0
    notes: Sequence[str] = ()
    no_ego: str = ""

    def moments(self, every_s: float) -> Iterator[Moment]:
        """Yield the steps that far apart in which the ego is there.

        Raises:
            InvalidDocument: Nobody can be the ego.
        """
        if self.no_ego:
            raise fault_at("ego", self.no_ego)
        frames = np.flatnonzero(np.isfinite(self.ego).all(axis=1)).tolist()
        times_s = self.times_s[frames].tolist()
        for index in frames_every(times_s, every_s):
            time_s = times_s[index] - times_s[0] if len(times_s) > 1 else None
            yield Moment(item=self.item, frame=frames[index], time_s=time_s)

    def reading_at(self, frame: int, name: str, reach_m: float = RADIUS_M) -> Reading:
        """Return the scene at a frame, what was recorded from there on, and what is left open.

        Args:
            frame: What becomes t0.
            name: The scene's slug.
            reach_m: How far from the ego the map goes.

        Raises:
            InvalidDocument: There is no such frame, no ego in it, or no lane.
        """
        log, doubts = _bound(self)
        origin = log._ego_pose(frame)
        city, map_notes = complete_map(self.map_at(frame))
        road = road_around(city, origin, reach_m)
        if city.doubts.notes and not (road.lanes or road.connectors or road.far):
            raise fault_at(city.place, "; ".join(["there is no lane", *city.doubts.notes]))
        tracks, names = _tracks(log, frame, origin)
        scene = Scene(
            name=name,
            ego=_ego(self, frame),
            traffic_side=road.traffic_side,
            origin=entities.Origin.at(origin, frame=self.world),
            provenance=f"{self.title}, step {frame} of {len(self.times_s)}; {self.licence}",
            agents=tuple(
                _agent(track) for track in tracks if np.hypot(*track.states[0, :2]) <= RADIUS_M
            ),
            lanes=road.lanes,
            connectors=road.connectors,
            areas=road.areas,
        )
        notes = [*map_notes, *self.notes, *city.doubts.notes, *doubts.notes]
        if (apart_s := np.diff(self.times_s).max(initial=0.0)) > LONGEST_GAP_S:
            notes.append(f"Steps lie up to {apart_s:g} s apart; a drive looks between them.")
        if bare := sum(not _is_size(track.length_m, track.width_m) for track in self.tracks):
            of = f"{bare} of {len(self.tracks)}"
            notes.append(f"{of} objects got the usual size of their class.")
        if not _is_size(*self.ego_size_m):
            notes.append(f"The ego's size is not told; {EGO_LENGTH_M:g} m long is assumed.")
        places = np.array([track.states[frame, :2] for track in log.tracks]).reshape(-1, 2)
        if far := road.far + int((np.hypot(*(places - log.ego[frame, :2]).T) > reach_m).sum()):
            notes.append(f"{far} things more than {reach_m:g} m from the ego were left out.")
        side = f"That people drive on the {road.traffic_side} is assumed{city.side_reason}."
        notes += [side] * road.side_is_assumed
        if not self.is_free:
            notes.append(f"The data's licence, {self.licence}, does not allow commercial use.")
        return Reading(
            scene=place_on_lanes(scene),
            recording=Recording(
                times_s=np.round(self.times_s[frame:] - self.times_s[frame], 6),
                ego=_local(self.ego[frame:], origin),
                tracks=tracks,
            ),
            notes=tuple(notes),
            moment=Moment(item=self.item, frame=frame),
            names=names,
        )

    def place_ego(self, place: str, frame: int) -> "Log":
        """Return the log with an ego that stands on a lane at a frame, in place of its own.

        Args:
            place: The lane as the source calls it, a comma, and how many metres along it.
            frame: The one at which the ego is there.

        Raises:
            InvalidDocument: There is no such lane, or it is shorter.
        """
        lane, _, along = place.rpartition(",")
        segments = {str(segment.name): segment for segment in self.map_at(frame).segments}
        with refuse_shape(f"lane {lane}"):
            line = segment_centreline(foreign.look_up(segments, lane.strip(), "lane"))
        pose = line.pose_at(foreign.read_number(along, "lane", 0.0, line.length_m))
        ego = np.full(self.ego.shape, np.nan)
        ego[frame : frame + 1] = pose.x_m, pose.y_m, pose.heading_rad, 0.0
        put = f"The ego was put on lane {lane}, {along} m along it; nobody recorded it."
        size_m = EGO_LENGTH_M, EGO_WIDTH_M
        return replace(self, ego=ego, ego_size_m=size_m, notes=[*self.notes, put], no_ego="")

    def _ego_pose(self, frame: int) -> Pose:
        steps = len(self.times_s)
        if self.no_ego:
            raise fault_at("ego", self.no_ego)
        if not 0 <= frame < steps:
            raise fault_at("frame", f"{frame} is not there; there are 0 to {steps - 1}")
        x_m, y_m, heading_rad, _ = self.ego[frame].tolist()
        if not np.isfinite(self.ego[frame]).all():
            raise fault_at("frame", f"{frame} has no ego, or one beyond the earth or 100 m/s")
        return Pose(x_m=x_m, y_m=y_m, heading_rad=wrap(heading_rad))


class Reader(ABC):
    """One format.

    Attributes:
        name: How the format is called where one is asked for.
        title: What it is, for people.
        suffix, marker: What its files end in, and what stands near their beginning.
        goes_with_others: Whether its files may lie beside those of a format that needs them.
    """

    name: str
    title: str
    suffix, marker, goes_with_others = "", b"", False

    def recognises(self, path: Path) -> bool:
        """Return whether the file or folder looks like this format; nothing is raised."""
        if path.suffix.lower() != self.suffix or not path.is_file():
            return False
        with path.open("rb") as file:
            return self.marker in file.read(10_000).replace(b"\0", b"")  # as in UTF-16

    @abstractmethod
    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Yield what can be taken, in the source's order, `every_s` seconds apart.

        Raises:
            InvalidDocument: The input breaks its format.
        """

    @abstractmethod
    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """Return the scene at one moment.

        Args:
            path: The file or folder.
            item: See `Moment`; None for the first. After it, or alone, "@LANE,S" puts an ego on a
                lane of a recording, see `Log.place_ego`.
            frame: See `Moment`; None for the one that the format means.
            name: The scene's slug.

        Raises:
            InvalidDocument: The input breaks its format, or has no such moment.
        """


def read_each(parts: Iterable[Callable[[], Log]]) -> Iterator[Log]:
    """Yield the logs that can be read, with a note on what could not; raises if none can."""
    faults, log = list[InvalidDocument](), None
    for part in parts:
        try:
            log = part()
        except InvalidDocument as fault:
            faults.append(fault)
            continue
        lost = [f"Passed over as unreadable: {len(faults)}; {fault}." for fault in faults[:1]]
        yield replace(log, notes=[*log.notes, *lost])
    if faults and log is None:
        raise faults[0]


class LogReader(Reader):
    """A format of recordings, opened as logs.

    Attributes:
        has_items: Whether a path can hold several parts.
        reach_m: How far from the ego the map of a scene goes.
    """

    has_items, reach_m = True, RADIUS_M

    @abstractmethod
    def logs(self, path: Path, item: str | None) -> Iterator[Log]:
        """Yield the part of that name, or all in the source's order for None.

        Raises:
            InvalidDocument: The input breaks its format, or has no such part.
        """

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Yield the moments of every log."""
        for log in self.logs(path, None):
            yield from log.moments(every_s)

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """Return the scene at one moment of one log."""
        part, is_put, place = (item or "").rpartition("@")
        item = part or None if is_put else item
        if item is not None and not self.has_items:
            raise fault_at("item", f"there are no parts, {item!r} is not there")
        log = next(self.logs(path, item), None)
        if log is None:
            raise fault_at("item", f"{str(item or 'a first part')[:60]!r} is not there")
        frame = log.frame if frame is None else frame
        log = log.place_ego(place, frame) if is_put else log
        return log.reading_at(frame, name, self.reach_m)


def frames_every(times_s: Sequence[float], every_s: float) -> Iterator[int]:
    """Yield the frames that lie at least `every_s` after the one before, the first among them."""
    last_s = -np.inf
    for frame, time_s in enumerate(times_s):
        if time_s - last_s >= every_s - 1e-6:
            last_s = time_s
            yield frame


def speeds(times_s: FloatArray, xy_m: FloatArray) -> FloatArray:
    """Return speeds (K,) over the neighbouring rows, one-sided at ends, 0 for a lone row."""
    rows = np.arange(len(times_s))
    gap = np.diff(times_s) > LONGEST_GAP_S
    first = np.maximum.accumulate(np.where(np.append(True, gap), rows, 0))
    last = np.where(np.append(gap, True), rows, len(rows))
    last = np.minimum.accumulate(last[::-1])[::-1]
    before = np.maximum(rows - NEIGHBOURS, first)
    after = np.minimum(rows + NEIGHBOURS, last)
    apart = times_s[after] - times_s[before]
    moved = np.hypot(*(xy_m[after] - xy_m[before]).T)
    return np.divide(moved, apart, out=np.zeros(len(rows)), where=apart > 0.0)


def read_tracks(
    table: "pd.DataFrame", types: Mapping[str, AgentType], times_s: FloatArray, doubts: Doubts
) -> dict[str, Track]:
    """Return the tracks in a table with a row for each object and step.

    Args:
        table: Columns `track` (its name), `kind` (a key of the types), `step`, `x_m`, `y_m`,
            `heading_rad`, and where they are known `speed_mps`, `length_m` and `width_m`.
        types: What the kinds are here.
        times_s: (T,), by which speeds are taken from places where there is no such column.
        doubts: Told of objects that are at one step twice.
    """
    is_repeat = table.duplicated(["track", "step"])
    doubts.assume("Of two boxes of one object at one step the first counts", is_repeat.sum())
    table = table[~is_repeat].sort_values("step")
    places = foreign.read_finite(table[[*STATE[:3]]], "places")
    unknown = np.full(len(table), np.nan)
    states = np.column_stack([places, table.get("speed_mps", unknown)])  # (R, 4)
    steps, tracks = table["step"].to_numpy(), {}
    for name, rows in table.groupby("track", observed=True).indices.items():
        seen, own = steps[rows], states[rows]
        if np.isnan(own[:, 3]).any():
            own[:, 3] = speeds(times_s[seen], own[:, :2])
        every = np.full((len(times_s), 4), np.nan)
        every[seen] = own
        box = table.iloc[rows[0]]
        tracks[str(name)] = Track(
            agent_id=str(name),
            type=types[box["kind"]],
            length_m=float(box.get("length_m", 0.0)),
            width_m=float(box.get("width_m", 0.0)),
            states=every,
        )
    return tracks


def place_on_lanes(scene: Scene) -> Scene:
    """Return the scene, everyone with the lane under them.

    The heading counts only of what drives.
    """
    graph = LaneGraph(scene)

    def place(agent: TrafficAgent) -> TrafficAgent:
        heading_rad = agent.heading_rad if agent.type in _HEADED else None
        return replace(agent, lane_id=graph.under(agent.x_m, agent.y_m, heading_rad))

    return replace(scene, ego=place(scene.ego), agents=tuple(map(place, scene.agents)))


# Private


def _bound(log: Log) -> tuple[Log, Doubts]:
    """The log without states in which nothing on earth is, and what to note of that."""
    doubts, most = Doubts(), [FURTHEST, FURTHEST, FURTHEST, FASTEST_MPS]

    def bound(states: FloatArray) -> FloatArray:
        odd = np.any(np.abs(states) > most, axis=1)
        doubts.assume("A state beyond the earth, or faster than 100 m/s, was left out", odd.sum())
        return np.where(odd[:, None], np.nan, states)

    tracks = [replace(track, states=bound(track.states)) for track in log.tracks]
    shared = len(tracks) - len({track.agent_id for track in tracks})
    doubts.assume("Two objects have one id; both are taken", shared)
    return replace(log, ego=bound(log.ego), tracks=tracks), doubts


def _tracks(log: Log, frame: int, origin: Pose) -> tuple[tuple[Track, ...], dict[str, str]]:
    """The tracks near the ego from t0 on, and their names in the source by id.

    Who is there at t0 comes first, then by time; within one step the nearest.
    """
    met = []
    ego = log.ego[frame:, :2]
    # Where the ego's way is not known, near is near to where it was.
    seen = np.isfinite(ego).all(axis=1)
    ego = ego[np.maximum.accumulate(np.where(seen, np.arange(len(ego)), 0))]
    for track in log.tracks:
        distances = np.hypot(*(track.states[frame:, :2] - ego).T)
        near = np.flatnonzero(distances <= RADIUS_M)  # NaN is not near
        if len(near):
            away_m = round(float(distances[near[0]]), 3)
            met.append((int(near[0]), away_m, track.agent_id, track))
    met.sort(key=lambda item: item[:3])
    tracks = []
    for number, (*_, track) in enumerate(met, start=2):
        own_m = track.length_m, track.width_m
        length_m, width_m = own_m if _is_size(*own_m) else entities.LENGTH_WIDTH_M[track.type]
        near_track = replace(
            track,
            agent_id=f"Agent{number}",
            length_m=round(length_m, 3),
            width_m=round(width_m, 3),
            states=_local(track.states[frame:], origin),
        )
        tracks.append(near_track)
    return tuple(tracks), {track.agent_id: ids[2] for track, ids in zip(tracks, met, strict=True)}


def _local(states: FloatArray, origin: Pose) -> FloatArray:
    """States (K, 4) of the world frame in the frame of t0's ego, rounded."""
    xy = np.round(origin.to_local(states[:, :2]), 3)
    turn = np.remainder(states[:, 2] - origin.heading_rad + np.pi, 2.0 * np.pi) - np.pi
    headings = np.round(np.where(turn == -np.pi, np.pi, turn), 4)
    local = np.column_stack([xy, headings, np.round(states[:, 3], 3)])
    local[~np.isfinite(local).all(axis=1)] = np.nan
    return local


def _is_size(*sizes_m: float) -> bool:
    return all(0.0005 < size_m <= LONGEST_M for size_m in sizes_m)


def _ego(log: Log, frame: int) -> TrafficAgent:
    length_m, width_m = log.ego_size_m
    size_m = (round(length_m, 3), round(width_m, 3)) if _is_size(length_m, width_m) else None
    speed_mps, origin = round(float(log.ego[frame, 3]), 3), Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)
    return TrafficAgent.at(AgentType.EGO_VEHICLE, origin, size_m, id="Agent1", speed_mps=speed_mps)


def _agent(track: Track) -> TrafficAgent:
    agent = track_agent(track, track.states[0])
    return replace(agent, speed_mps=0.0) if track.type in _STANDING else agent
