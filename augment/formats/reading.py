"""What every reader is and gives: from a log and a map in their world frame to a scene.

A reader knows one format of recorded data. It is pure: a path goes in, values come out, and what
is wrong with the file is raised as `InvalidDocument`. `reading_at` does what all readers need
once they know times, ego, tracks and map: who is near, in which order they are named, which lane
lies under them. Metres are rounded to millimetres, so that documents can be read by people. T
steps.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from augment.errors import InvalidDocument
from augment.formats.road_map import FURTHEST_M, FloatArray, RoadMap
from augment.formats.roads import RADIUS_M, MapExtract, road_around
from augment.geometry.frames import Pose, wrap
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, Origin, Scene, TrafficAgent
from augment.scene.lane_graph import LaneGraph
from augment.scene.recording import Note, Recording, SceneNoteKind, Track

LONGEST_M = 100.0
"""No road user is longer."""
LONGEST_GAP_S = 0.35
"""Steps are 0.1 s apart; over a longer gap no speed is taken."""
NEIGHBOURS = 2
"""Steps on either side that a speed is taken over: one alone shows the annotators' jitter."""
_STANDING = (AgentType.TRAFFIC_CONE, AgentType.BARRIER, AgentType.CONSTRUCTION_SIGN)
_HEADED = (AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE)


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

    def __str__(self) -> str:
        return f"frame {self.frame}" if self.item is None else f"{self.item}, frame {self.frame}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A scene, what was recorded from it on, and what the source did not say.

    Attributes:
        recording: None for a source that is no recording.
        notes: Every loss and assumption.
        moment: What was taken.
    """

    scene: Scene
    recording: Recording | None
    notes: tuple[Note, ...] = ()
    moment: Moment = Moment()


class Reader(Protocol):
    """One format."""

    name: str
    """How the format is called where one is asked for."""
    title: str
    """What it is, for people."""

    def recognises(self, path: Path) -> bool:
        """Whether the file or folder looks like this format; nothing is raised."""

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """What can be taken, in the source's order, `every_s` seconds apart.

        Raises:
            InvalidDocument: The input breaks its format.
        """

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene at one moment.

        Args:
            path: The file or folder.
            item: See `Moment`; None for the first.
            frame: See `Moment`; None for the one that the format means, else 0.
            name: The scene's slug.

        Raises:
            InvalidDocument: The input breaks its format, or has no such moment.
        """


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoggedTrack:
    """One object.

    Attributes:
        name: Its id in the source; an order among those that are equally near.
        states: (T, 4): x_m, y_m, heading_rad, speed_mps in the world frame; NaN where unseen.
    """

    name: str
    type: AgentType
    length_m: float
    width_m: float
    states: FloatArray

    @property
    def has_size(self) -> bool:
        """Whether its size can be."""
        return all(0.0005 < size_m <= LONGEST_M for size_m in (self.length_m, self.width_m))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Log:
    """What was recorded.

    Attributes:
        what: What the source is called in faults.
        times_s: (T,) ascending.
        ego: (T, 4), as a track's states, of the ego's geometric centre.
    """

    what: str
    times_s: FloatArray
    ego: FloatArray
    ego_length_m: float
    ego_width_m: float
    tracks: tuple[LoggedTrack, ...]

    def ego_pose(self, frame: int) -> Pose:
        """Return where the ego is at a frame.

        Raises:
            InvalidDocument: There is no such frame, or no ego in it.
        """
        frame_in(self.what, frame, len(self.times_s))
        x_m, y_m, heading_rad, _ = self.ego[frame].tolist()
        if not np.isfinite(self.ego[frame]).all():
            raise InvalidDocument(self.what, [("frame", f"{frame} has no ego in it")])
        return Pose(x_m=x_m, y_m=y_m, heading_rad=wrap(heading_rad))


def frame_in(what: str, frame: int, steps: int) -> int:
    """Return the frame, where it is one of that many.

    Raises:
        InvalidDocument: It is not.
    """
    if not 0 <= frame < steps:
        allowed = f"this log has frames 0 to {steps - 1}" if steps else "this log has no frame"
        raise InvalidDocument(what, [("frame", f"{frame} is not there; {allowed}")])
    return frame


def frames_every(times_s: list[float], every_s: float) -> Iterator[int]:
    """Yield the frames that lie at least `every_s` after the one before, the first among them."""
    last: float | None = None
    for frame, time_s in enumerate(times_s):
        if last is None or time_s - last >= every_s - 1e-6:
            last = time_s
            yield frame


def moments_of(log: Log, every_s: float, item: str | None = None) -> Iterator[Moment]:
    """Yield the steps of a log that far apart in which the ego is there."""
    frames = np.flatnonzero(np.isfinite(log.ego).all(axis=1)).tolist()
    times_s = log.times_s[frames].tolist()
    for index in frames_every(times_s, every_s):
        yield Moment(item=item, frame=frames[index], time_s=times_s[index] - times_s[0])


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


def reading_at(
    log: Log,
    frame: int,
    city: RoadMap,
    *,
    name: str,
    world: str,
    provenance: str,
    licence: str | None,
    notes: Iterable[Note] = (),
    item: str | None = None,
) -> Reading:
    """Return the scene at a frame, what was recorded from there on, what the source left open.

    Args:
        log: The whole log.
        frame: What becomes t0.
        city: The map, as far as the ego can see at least.
        name: The scene's slug.
        world: What the source's frame is called.
        provenance: Where it comes from and under which licence.
        licence: One that forbids commercial use; None where there is none such.
        notes: What neither the log nor the map tells.
        item: Which part of the source it is.

    Raises:
        InvalidDocument: No such frame, no ego in it, a number that is none, or a part of the map
            without a shape.
    """
    origin = log.ego_pose(frame)
    road = road_around(city, origin)
    tracks = _tracks(log, frame, origin)
    scene = Scene(
        name=name,
        ego=_ego(log, frame),
        traffic_side=road.traffic_side,
        origin=Origin.at(origin, frame=world),
        provenance=provenance,
        agents=tuple(_agent(track) for track in tracks if _is_near(track)),
        lanes=road.lanes,
        connectors=road.connectors,
        areas=road.areas,
    )
    return Reading(
        scene=_on_lanes(scene),
        recording=Recording(
            times_s=np.round(log.times_s[frame:] - log.times_s[frame], 6),
            ego=_local(log.ego[frame:], origin),
            tracks=tracks,
        ),
        notes=(*city.notes, *notes, *_own_notes(log, frame, road, licence)),
        moment=Moment(item=item, frame=frame),
    )


# Private


def _tracks(log: Log, frame: int, origin: Pose) -> tuple[Track, ...]:
    """The tracks near the ego from t0 on: who is there at t0 first, then by time.

    Within one step the nearest comes first.
    """
    for states in (log.ego, *(track.states for track in log.tracks)):
        if (np.abs(states) > FURTHEST_M).any():
            raise InvalidDocument(log.what, [("", f"has a number over {FURTHEST_M:.0e}")])
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
            met.append((int(near[0]), away_m, track.name, track))
    met.sort(key=lambda item: item[:3])
    made = []
    for number, (*_, track) in enumerate(met, start=2):
        own = track.length_m, track.width_m
        length_m, width_m = own if track.has_size else LENGTH_WIDTH_M[track.type]
        made.append(
            Track(
                agent_id=f"Agent{number}",
                type=track.type,
                length_m=round(length_m, 3),
                width_m=round(width_m, 3),
                states=_local(track.states[frame:], origin),
            )
        )
    return tuple(made)


def _local(states: FloatArray, origin: Pose) -> FloatArray:
    """States (K, 4) of the world frame in the frame of t0's ego, rounded."""
    xy = np.round(origin.to_local(states[:, :2]), 3)
    turn = np.remainder(states[:, 2] - origin.heading_rad + np.pi, 2.0 * np.pi) - np.pi
    headings = np.round(np.where(turn == -np.pi, np.pi, turn), 4)
    made = np.column_stack([xy, headings, np.round(states[:, 3], 3)])
    made[~np.isfinite(made).all(axis=1)] = np.nan
    return made


def _is_near(track: Track) -> bool:
    return bool(np.hypot(*track.states[0, :2]) <= RADIUS_M)


def _ego(log: Log, frame: int) -> TrafficAgent:
    return TrafficAgent(
        id="Agent1",
        type=AgentType.EGO_VEHICLE,
        x_m=0.0,
        y_m=0.0,
        heading_rad=0.0,
        width_m=round(log.ego_width_m, 3),
        length_m=round(log.ego_length_m, 3),
        speed_mps=round(float(log.ego[frame, 3]), 3),
    )


def _agent(track: Track) -> TrafficAgent:
    x_m, y_m, heading_rad, speed_mps = track.states[0].tolist()
    return TrafficAgent(
        id=track.agent_id,
        type=track.type,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        width_m=track.width_m,
        length_m=track.length_m,
        speed_mps=0.0 if track.type in _STANDING else speed_mps,
    )


def _on_lanes(scene: Scene) -> Scene:
    """Everyone with the lane under them; only of what drives does the heading count."""
    graph = LaneGraph(scene)

    def place(agent: TrafficAgent, heading_rad: float | None) -> TrafficAgent:
        return replace(agent, lane_id=graph.under(agent.x_m, agent.y_m, heading_rad))

    agents = [place(one, one.heading_rad if one.type in _HEADED else None) for one in scene.agents]
    return replace(scene, ego=place(scene.ego, 0.0), agents=tuple(agents))


def _own_notes(log: Log, frame: int, road: MapExtract, licence: str | None) -> Iterator[Note]:
    sizeless = sum(not track.has_size for track in log.tracks)
    if sizeless:
        yield Note(kind=SceneNoteKind.SOME_BOX_SIZES, number=sizeless, of=len(log.tracks))
    away_m = [np.hypot(*(track.states[frame, :2] - log.ego[frame, :2])) for track in log.tracks]
    number = road.far + sum(bool(distance_m > RADIUS_M) for distance_m in away_m)
    if number:
        yield Note(kind=SceneNoteKind.FAR_PARTS_LEFT_OUT, number=number, value=RADIUS_M)
    if road.side_is_assumed:
        side = (road.traffic_side.value,)
        yield Note(kind=SceneNoteKind.TRAFFIC_SIDE_ASSUMED, names=side)
    if licence:
        yield Note(kind=SceneNoteKind.NON_COMMERCIAL, names=(licence,))
