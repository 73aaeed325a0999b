"""Every format that can be read, by name.

In: a path to somebody's file or folder, and where it is known the format's name. Out: its reader,
which gives a `Reading` (reading.py): a `Scene`, a `Recording` and `Note`s on what the source left
open. A new format is a class that fits `Reader`, and its entry in READERS.
"""

import itertools
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from augment.errors import InvalidDocument, UnknownName
from augment.formats.argoverse2 import ArgoverseMotion, ArgoverseSensor
from augment.formats.commonroad.scenario import CommonRoad
from augment.formats.nuplan_log import NuPlan
from augment.formats.own_json import OwnJson
from augment.formats.reading import Moment, Reader
from augment.formats.scenarionet.scenario import ScenarioNet
from augment.formats.waymo.scenario import WaymoMotion
from augment.geometry.frames import Pose
from augment.scene.lane_graph import AnyLane
from augment.scene.recording import Recording

READERS: dict[str, Reader] = {
    reader.name: reader
    for reader in (
        ArgoverseSensor(),
        OwnJson(),
        CommonRoad(),
        WaymoMotion(),
        NuPlan(),
        ScenarioNet(),
        ArgoverseMotion(),
    )
}
"""In the order in which a file is tried; each is asked about what is its own alone."""


def reader_of(name: str) -> Reader:
    """The reader of a format.

    Raises:
        UnknownName: Nobody reads that.
    """
    try:
        return READERS[name]
    except KeyError:
        raise UnknownName("source", name, list(READERS)) from None


def recognise(path: Path) -> Reader:
    """Return the reader of the format that a file or folder looks like.

    Raises:
        InvalidDocument: There is nothing, or it looks like none of the formats, or like several.
    """
    if not path.exists():
        raise InvalidDocument("input", [(str(path), "is not there")])
    return find_input(path, list(READERS.values()), is_deep=False)[0]


def find_input(path: Path, readers: list[Reader], *, is_deep: bool) -> tuple[Reader, Path]:
    """Return what one of the readers takes, and which: the path, or what lies in it.

    Args:
        path: A file or folder.
        readers: Who may read it.
        is_deep: Whether it may lie in the folder, level by level.

    Raises:
        InvalidDocument: Nothing is in one of the formats, or several things are.
    """
    level = [path]
    while level:
        found = [
            (reader, one) for one in sorted(level) for reader in readers if reader.recognises(one)
        ]
        if len(found) == 1:
            return found[0]
        if found:
            names = [
                f"{one.relative_to(path.parent)} ({reader.name})" for reader, one in found[:5]
            ]
            text = f"holds {len(found)} recordings, one is needed: {', '.join(names)}"
            raise InvalidDocument("input", [("", text)])
        level = [below for one in level if is_deep and one.is_dir() for below in one.iterdir()]
    known = ", ".join(f"{reader.name}: {reader.title}" for reader in readers)
    raise InvalidDocument("input", [(str(path), f"looks like none of the formats: {known}")])


EVERY_S = 0.5
MOST_STOPS = 2_000
"""Moments that are offered; later ones of a longer recording are not."""
LOOKS_S = 3.0
"""So long moments are read for the maps, each of them the whole file once more: seconds of
computing, of those that its process has (`sandbox.ProcessLimits`)."""
_LOOKS_OF_A_TRACK = 6
_ROAD_POINT_EVERY_M = 4.0
_MOST_ROADS = 600


@dataclass(slots=True, kw_only=True)
class Stop:
    """A moment that can become t0.

    Attributes:
        place_m: Of the ego, None where nobody looked so far.
    """

    moment: Moment
    place_m: tuple[float, float] | None = None


@dataclass(slots=True, kw_only=True)
class RecordingPart:
    """One part of a recording: a log, a record, a planning problem, a vehicle as the ego.

    Attributes:
        name: Its item, empty where there is one part alone.
        roads_m: Points of centrelines around the places that were looked at, to 0.1 m.
        is_seen: Whether anybody looked: a part beyond the bounds has neither places nor roads.
    """

    name: str
    stops: list[Stop]
    roads_m: list[list[tuple[float, float]]] = field(default_factory=list)
    is_seen: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Timeline:
    """All of a recording.

    Attributes:
        is_cut: Whether it holds more moments than are offered.
    """

    tracks: tuple[RecordingPart, ...]
    is_cut: bool


def timeline_of(reader: Reader, path: Path, *, every_s: float = EVERY_S) -> Timeline:
    """Return the moments of a recording that far apart, with maps as far as the bounds reach.

    Raises:
        InvalidDocument: The input breaks its format.
    """
    moments = list(itertools.islice(reader.moments(path, every_s=every_s), MOST_STOPS + 1))
    is_cut, moments = len(moments) > MOST_STOPS, moments[:MOST_STOPS]
    # Where each moment has an item of its own and a time, the items name frames of one recording.
    items = {moment.item for moment in moments}
    is_one = len(items) == len(moments) and all(one.time_s is not None for one in moments)
    tracks: dict[str, RecordingPart] = {}
    for moment in moments:
        name = "" if is_one else moment.item or ""
        track = tracks.setdefault(name, RecordingPart(name=name, stops=[]))
        track.stops.append(Stop(moment=moment))
    until_s = time.process_time() + LOOKS_S
    for track in tracks.values():
        _look(track, reader, path, until_s)
    return Timeline(tracks=tuple(tracks.values()), is_cut=is_cut)


# Private


def _look(track: RecordingPart, reader: Reader, path: Path, until_s: float) -> None:
    """Find the ego's places by reading the first moment that has none, again and again."""
    frame: Pose | None = None
    for _ in range(_LOOKS_OF_A_TRACK):
        unseen = [stop for stop in track.stops if stop.place_m is None]
        if not unseen or time.process_time() > until_s:
            return
        moment = unseen[0].moment
        reading = reader.read(path, item=moment.item, frame=moment.frame, name="look")
        here = reading.scene.origin.pose
        track.is_seen = True
        frame = frame or here
        seen = frame.pose_to_local(here)
        unseen[0].place_m = (seen.x_m, seen.y_m)
        _fill_in(unseen, reading.recording, seen)
        ways: list[AnyLane] = [*reading.scene.lanes, *reading.scene.connectors]
        for way in ways[: _MOST_ROADS - len(track.roads_m)]:
            every_m = max(_ROAD_POINT_EVERY_M, way.centerline.length_m / 60.0)
            points_m = seen.to_parent(way.centerline.resampled(every_m).points_m)
            track.roads_m.append([(round(x, 1), round(y, 1)) for x, y in points_m.tolist()])


def _fill_in(unseen: list[Stop], recording: Recording | None, seen: Pose) -> None:
    """The ego's places after the first of these moments, as far as its recording tells them."""
    start_s = unseen[0].moment.time_s
    if recording is None or start_s is None:
        return
    places_m = seen.to_parent(recording.ego[:, :2])
    for stop in unseen[1:]:
        away_s = np.abs(recording.times_s - ((stop.moment.time_s or 0.0) - start_s))
        nearest = int(np.argmin(away_s))
        x_m, y_m = places_m[nearest].tolist()
        if away_s[nearest] < 0.06 and np.isfinite([x_m, y_m]).all():
            stop.place_m = (x_m, y_m)
