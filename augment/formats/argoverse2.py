"""Columns out of Arrow and Parquet files that somebody else made.

Both formats can be compressed a thousandfold, and pyarrow takes every length in a file at its
word: what is too large for the memory of the reading process ends there (`sandbox`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from augment.errors import InvalidDocument
from augment.formats.documents import read_json
from augment.formats.reading import (
    Log,
    LoggedTrack,
    Moment,
    Reading,
    frames_every,
    reading_at,
    speeds,
)
from augment.formats.road_map import RoadMap, Segment, count_notes
from augment.scene.entities import AgentType, AreaKind
from augment.scene.recording import Note, SceneNoteKind
from augment.scene.schema import problems_of


@dataclass(frozen=True, slots=True, eq=False)
class TextColumn:
    """A column of texts.

    Attributes:
        values: The different ones, ascending.
        codes: For each row the place of its text among them.
    """

    values: tuple[str, ...]
    codes: NDArray[np.int64]


Columns = dict[str, Any]
"""By name: a `TextColumn`, or numbers as float64 or int64."""


def read_arrow(
    file: Path, *, what: str, numbers: Sequence[str], texts: Sequence[str], whole: Sequence[str]
) -> Columns:
    """The named columns of an Arrow file (Feather, version 2), all present and finite.

    Args:
        file: The file.
        what: How faults call the source.
        numbers: Columns of finite numbers.
        texts: Columns of texts.
        whole: Columns of whole numbers.

    Raises:
        InvalidDocument: The file, a column or a value is not so.
    """
    import pyarrow as pa

    block, wanted = _bytes(file, what), (*whole, *numbers, *texts)
    try:
        with pa.ipc.open_file(pa.py_buffer(block)) as reader:
            _check_names(file, what, reader.schema.names, wanted)
            table = reader.read_all().select(list(wanted))
        table.validate(full=True)
    except _faults() as fault:
        text = f"is not a feather file: {str(fault)[:200]}"
        raise InvalidDocument(what, [(file.name, text)]) from None
    return _columns(table, file, what, numbers, texts, whole)


def read_parquet(
    file: Path, *, what: str, numbers: Sequence[str], texts: Sequence[str], whole: Sequence[str]
) -> Columns:
    """The same of a Parquet file.

    Raises:
        InvalidDocument: As above.
    """
    import pyarrow as pa
    from pyarrow import parquet

    block, wanted = _bytes(file, what), (*whole, *numbers, *texts)
    try:
        with parquet.ParquetFile(pa.BufferReader(block), read_dictionary=list(texts)) as opened:
            _check_names(file, what, opened.schema_arrow.names, wanted)
            table = opened.read(columns=list(wanted), use_threads=False)
        table.validate(full=True)
    except _faults() as fault:
        text = f"is not a parquet file: {str(fault)[:200]}"
        raise InvalidDocument(what, [(file.name, text)]) from None
    return _columns(table, file, what, numbers, texts, whole)


# Private


def _faults() -> tuple[type[BaseException], ...]:
    """All that a broken file makes of pyarrow; want of memory is `sandbox`'s to say."""
    import pyarrow as pa

    usual = (ValueError, TypeError, KeyError, IndexError, OSError, OverflowError)
    return (*usual, NotImplementedError, pa.ArrowCapacityError, pa.ArrowSerializationError)


def _bytes(file: Path, what: str) -> bytes:
    if not file.is_file():
        raise InvalidDocument(what, [(file.name, f"is not in {file.parent}")])
    return file.read_bytes()


def _check_names(file: Path, what: str, there: Sequence[str], wanted: Sequence[str]) -> None:
    missing = [name for name in wanted if list(there).count(name) != 1]
    if missing:
        raise InvalidDocument(what, [(file.name, f"has no column {name!r}") for name in missing])


def _columns(
    table: Any,
    file: Path,
    what: str,
    numbers: Sequence[str],
    texts: Sequence[str],
    whole: Sequence[str],
) -> Columns:
    try:
        columns: Columns = {name: _text_column(table[name]) for name in texts}
        columns |= {name: table[name].to_numpy().astype(np.float64) for name in numbers}
        columns |= {
            name: table[name].to_numpy().astype(np.int64, casting="safe") for name in whole
        }
    except _faults() as fault:
        text = f"has a column of a wrong kind: {str(fault)[:200]}"
        raise InvalidDocument(what, [(file.name, text)]) from None
    for name in numbers:
        broken = np.flatnonzero(~np.isfinite(columns[name]))
        if len(broken):
            raise InvalidDocument(what, [(f"{file.name}[{broken[0]}].{name}", "is not finite")])
    return columns


def _text_column(column: Any) -> TextColumn:
    """Each text once: a thousand rows may share one of a megabyte."""
    import pyarrow as pa

    if not pa.types.is_dictionary(column.type):
        column = column.dictionary_encode()
    array = column.unify_dictionaries().combine_chunks()
    if isinstance(array, pa.ChunkedArray):
        array = (
            array.chunk(0) if array.num_chunks else pa.array([], pa.string()).dictionary_encode()
        )
    if array.null_count or array.dictionary.null_count:
        raise ValueError("a text is missing")
    given = [str(one) for one in array.dictionary.to_pylist()]
    values = tuple(sorted(set(given)))
    place = {text: number for number, text in enumerate(values)}
    ranks = np.array([place[text] for text in given], dtype=np.int64)
    codes = array.indices.to_numpy(zero_copy_only=False).astype(np.int64)
    return TextColumn(values=values, codes=ranks[codes] if len(codes) else codes)


EGO = "EGO_VEHICLE"
"""Some releases annotate the ego itself, as a box at its frame's origin; it is no other agent."""

TYPE_OF: dict[str, AgentType] = {
    "REGULAR_VEHICLE": AgentType.VEHICLE,
    "LARGE_VEHICLE": AgentType.VEHICLE,
    "BOX_TRUCK": AgentType.VEHICLE,
    "TRUCK": AgentType.VEHICLE,
    "TRUCK_CAB": AgentType.VEHICLE,
    "VEHICULAR_TRAILER": AgentType.VEHICLE,
    "RAILED_VEHICLE": AgentType.VEHICLE,
    "BUS": AgentType.BUS,
    "SCHOOL_BUS": AgentType.BUS,
    "ARTICULATED_BUS": AgentType.BUS,
    "BICYCLE": AgentType.BICYCLE,
    "BICYCLIST": AgentType.BICYCLE,
    "MOTORCYCLE": AgentType.BICYCLE,
    "MOTORCYCLIST": AgentType.BICYCLE,
    "WHEELED_DEVICE": AgentType.BICYCLE,
    "WHEELED_RIDER": AgentType.BICYCLE,
    "PEDESTRIAN": AgentType.PEDESTRIAN,
    "OFFICIAL_SIGNALER": AgentType.PEDESTRIAN,
    "STROLLER": AgentType.PEDESTRIAN,
    "WHEELCHAIR": AgentType.PEDESTRIAN,
    "CONSTRUCTION_CONE": AgentType.TRAFFIC_CONE,
    "CONSTRUCTION_BARREL": AgentType.BARRIER,
    "SIGN": AgentType.CONSTRUCTION_SIGN,
    "STOP_SIGN": AgentType.CONSTRUCTION_SIGN,
    "MOBILE_PEDESTRIAN_CROSSING_SIGN": AgentType.CONSTRUCTION_SIGN,
    "MESSAGE_BOARD_TRAILER": AgentType.CONSTRUCTION_SIGN,
    "TRAFFIC_LIGHT_TRAILER": AgentType.GENERIC_OBJECT,
    "BOLLARD": AgentType.GENERIC_OBJECT,
    "ANIMAL": AgentType.GENERIC_OBJECT,
    "DOG": AgentType.GENERIC_OBJECT,
}
"""A table without a rest: a category that is not in it is refused by name."""


WHAT = "Argoverse 2 log"
BOXES = "annotations.feather"
POSES = "city_SE3_egovehicle.feather"

EGO_LENGTH_M = 4.877
EGO_WIDTH_M = 1.852
REAR_AXLE_TO_CENTER_M = 1.42
"""The fleet's car, a Ford Fusion: half its length less the overhang behind the rear axle."""

MOST_NAMED = 5

FloatArray = NDArray[np.float64]

_QUATERNION = ("qw", "qx", "qy", "qz")
_PLACE = ("tx_m", "ty_m", "tz_m")


def read_log(folder: Path) -> Log:
    """Both tables of the log in that folder.

    Raises:
        InvalidDocument: A file or a column is missing or broken, a category is unknown, or a sweep
            has no ego pose.
    """
    numbers = (*_QUATERNION, *_PLACE)
    sized, texts = (*numbers, "length_m", "width_m"), ("track_uuid", "category")
    stamp = ("timestamp_ns",)
    boxes = read_arrow(folder / BOXES, what=WHAT, numbers=sized, texts=texts, whole=stamp)
    poses = read_arrow(folder / POSES, what=WHAT, numbers=numbers, texts=(), whole=stamp)
    _check_categories(boxes["category"])
    stamps, sweep_of_row = np.unique(boxes["timestamp_ns"], return_inverse=True)
    if len(stamps) == 0:
        raise InvalidDocument(WHAT, [(BOXES, "has no annotated sweep")])
    turn, place = _rigid(_taken(poses, _rows_at(poses["timestamp_ns"], stamps)))
    times_s = (stamps - stamps[0]) * 1e-9
    forward = turn[:, :2, 0]
    heading = np.arctan2(forward[:, 1], forward[:, 0])
    level = np.column_stack([np.cos(heading), np.sin(heading)])
    center = place[:, :2] + REAR_AXLE_TO_CENTER_M * level
    ego = np.column_stack([center, heading, speeds(times_s, center)])
    box_turn, box_place = _rigid(boxes)
    city_turn = turn[sweep_of_row]
    xy = (np.einsum("rij,rj->ri", city_turn, box_place) + place[sweep_of_row])[:, :2]
    ahead = np.einsum("rij,rj->ri", city_turn, box_turn[:, :, 0])
    rows = np.column_stack([xy, np.arctan2(ahead[:, 1], ahead[:, 0])])
    return Log(
        what=WHAT,
        times_s=times_s,
        ego=ego,
        ego_length_m=EGO_LENGTH_M,
        ego_width_m=EGO_WIDTH_M,
        tracks=tuple(_tracks(boxes, sweep_of_row, rows, times_s)),
    )


# Private


def _check_categories(categories: TextColumn) -> None:
    used = {categories.values[code] for code in np.unique(categories.codes)}
    unknown = sorted(used - set(TYPE_OF) - {EGO})[:MOST_NAMED]
    if unknown:
        known = ", ".join(sorted(TYPE_OF))
        problems = [(BOXES, f"unknown category {name!r}; known: {known}") for name in unknown]
        raise InvalidDocument(WHAT, problems)


def _rows_at(stamps: NDArray[np.int64], wanted: NDArray[np.int64]) -> NDArray[np.int64]:
    """The rows (T,) of the poses at exactly the sweeps' time stamps."""
    order = np.argsort(stamps, kind="stable")
    places = np.searchsorted(stamps[order], wanted)
    is_wanted = np.zeros(len(wanted), dtype=bool)
    inside = places < len(stamps)
    is_wanted[inside] = stamps[order][places[inside]] == wanted[inside]
    if not is_wanted.all():
        first = wanted[~is_wanted][0]
        raise InvalidDocument(WHAT, [(POSES, f"has no pose at the annotated time {first} ns")])
    return order[places]


def _taken(columns: dict[str, Any], rows: NDArray[np.int64]) -> dict[str, Any]:
    return {name: values[rows] for name, values in columns.items()}


def _rigid(columns: dict[str, Any]) -> tuple[FloatArray, FloatArray]:
    """Rotations (R, 3, 3) and places (R, 3) of quaternion and translation columns."""
    quaternion = np.column_stack([columns[name] for name in _QUATERNION])
    length = np.linalg.norm(quaternion, axis=1)
    if (length < 1e-6).any():
        row = int(np.argmin(length))
        raise InvalidDocument(WHAT, [(f"row {row}", "has a quaternion of length 0")])
    w, x, y, z = (quaternion / length[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    turn = np.moveaxis(np.array(rows), 2, 0)
    return turn, np.column_stack([columns[name] for name in _PLACE])


def _tracks(
    boxes: dict[str, Any], sweeps: NDArray[np.int64], rows: FloatArray, times_s: FloatArray
) -> Iterator[LoggedTrack]:
    names, kinds = boxes["track_uuid"], boxes["category"]
    order = np.lexsort((sweeps, names.codes))
    uuids, starts = np.unique(names.codes[order], return_index=True)
    for uuid, mine in zip(uuids.tolist(), np.split(order, starts[1:]), strict=True):
        kind = kinds.values[kinds.codes[mine[0]]]
        if kind == EGO:
            continue
        mine = mine[np.concatenate([[True], np.diff(sweeps[mine]) > 0])]
        states = np.full((len(times_s), 4), np.nan)
        states[sweeps[mine]] = np.column_stack(
            [rows[mine], speeds(times_s[sweeps[mine]], rows[mine, :2])]
        )
        yield LoggedTrack(
            name=names.values[uuid],
            type=TYPE_OF[kind],
            length_m=float(boxes["length_m"][mine[0]]),
            width_m=float(boxes["width_m"][mine[0]]),
            states=states,
        )


LICENCE = "CC BY-NC-SA 4.0"


class MapPart(BaseModel):
    """A part of the map file; fields that nobody needs here are allowed."""

    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False, frozen=True)


class MapPoint(MapPart):
    """A point of the city frame."""

    x: float
    y: float


Points = Annotated[list[MapPoint], Field(fail_fast=True, min_length=2)]


class MapSegment(MapPart):
    """A lane segment; boundaries run in the direction of travel."""

    id: int
    is_intersection: bool
    lane_type: Literal["VEHICLE", "BUS", "BIKE"]
    left_lane_boundary: Points
    right_lane_boundary: Points
    predecessors: list[int]
    successors: list[int]
    left_neighbor_id: int | None = None
    right_neighbor_id: int | None = None


class MapCrossing(MapPart):
    """A crosswalk, by its two long edges."""

    edge1: Points
    edge2: Points


class MapDrivable(MapPart):
    """A polygon that can be driven on."""

    area_boundary: Annotated[list[MapPoint], Field(fail_fast=True, min_length=3)]


class MapFile(MapPart):
    """The map archive."""

    lane_segments: dict[str, MapSegment]
    drivable_areas: dict[str, MapDrivable] = {}
    pedestrian_crossings: dict[str, MapCrossing] = {}


def read_map(file: Path, *, what: str) -> RoadMap:
    """The map in that file as segments and areas, with what maps of Argoverse 2 don't say.

    Raises:
        InvalidDocument: The file is no such map; with the path and the reason of every fault.
    """
    document = read_json(file, what=what)
    try:
        city = MapFile.model_validate(document)
    except ValidationError as fault:
        problems = [(f"{file.name}: {place}", text) for place, text in problems_of(fault)]
        raise InvalidDocument(what, problems) from None
    areas = [
        (AreaKind.DRIVABLE, _points(area.area_boundary)) for area in city.drivable_areas.values()
    ]
    for crossing in city.pedestrian_crossings.values():
        one, other = _points(crossing.edge1), _points(crossing.edge2)
        same_way = float(np.dot(one[-1] - one[0], other[-1] - other[0])) > 0.0
        areas.append((AreaKind.CROSSWALK, np.vstack([one, other[::-1] if same_way else other])))
    driven = [one for one in city.lane_segments.values() if one.lane_type != "BIKE"]
    bicycle_lanes = len(city.lane_segments) - len(driven)
    return RoadMap(
        what=what,
        place=f"{file.name}: lane_segments",
        segments=tuple(_segment(segment) for segment in driven),
        areas=tuple(areas),
        notes=(
            Note(kind=SceneNoteKind.NO_SPEED_LIMITS),
            Note(kind=SceneNoteKind.NO_LIGHTS),
            Note(kind=SceneNoteKind.NO_WALKWAYS),
            *count_notes({SceneNoteKind.BICYCLE_LANES_LEFT_OUT: bicycle_lanes}),
        ),
    )


# Private


def _segment(segment: MapSegment) -> Segment:
    left, right = segment.left_neighbor_id, segment.right_neighbor_id
    return Segment(
        name=segment.id,
        crosses=segment.is_intersection,
        left=_points(segment.left_lane_boundary),
        right=_points(segment.right_lane_boundary),
        successors=tuple(segment.successors),
        predecessors=tuple(segment.predecessors),
        left_neighbors=() if left is None else (left,),
        right_neighbors=() if right is None else (right,),
    )


def _points(points: Sequence[MapPoint]) -> NDArray[np.float64]:
    return np.array([[point.x, point.y] for point in points])


class ArgoverseSensor:
    """The reader of Argoverse 2 Sensor logs."""

    name = "av2"
    title = "Argoverse 2 Sensor log (folder)"

    def recognises(self, path: Path) -> bool:
        """A folder with annotations."""
        return (path / BOXES).is_file()

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Sweeps that far apart."""
        _check_folder(path)
        times_s = read_log(path).times_s.tolist()
        for frame in frames_every(times_s, every_s):
            yield Moment(frame=frame, time_s=times_s[frame] - times_s[0])

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene at one annotated sweep, and what was recorded to the end of the log."""
        _check_folder(path)
        if item is not None:
            raise InvalidDocument(WHAT, [("item", f"a log has no parts, {item!r} is not there")])
        frame = frame or 0
        map_file = map_file_in(path / "map", WHAT)
        log = read_log(path)
        return reading_at(
            log,
            frame,
            read_map(map_file, what=WHAT),
            name=name,
            world=city_of(map_file),
            provenance=(
                f"Argoverse 2 Sensor data set, log {path.resolve().name}, frame {frame} of "
                f"{len(log.times_s)}; {LICENCE}"
            ),
            licence=LICENCE,
            notes=[Note(kind=SceneNoteKind.SPEEDS_DIFFERENCED)],
        )


def map_file_in(folder: Path, what: str) -> Path:
    """The one map archive in a folder.

    Raises:
        InvalidDocument: There is none, or several.
    """
    files = sorted(folder.glob("log_map_archive_*.json"))
    if len(files) != 1:
        text = "no such file" if not files else f"{len(files)} such files; there must be one"
        in_map = folder.name == "map"
        place = "map/log_map_archive_*.json" if in_map else "log_map_archive_*.json"
        where = folder.parent if in_map else folder
        raise InvalidDocument(what, [(place, f"{text} in {where}")])
    return files[0]


def city_of(map_file: Path) -> str:
    """What the frame of a map is called."""
    city = re.search(r"____([A-Z]+)_city", map_file.name)
    return f"Argoverse 2 city frame {city[1]}" if city else "Argoverse 2 city frame"


# Private


def _check_folder(path: Path) -> None:
    if not path.is_dir():
        raise InvalidDocument(WHAT, [(str(path), "is not a folder")])
