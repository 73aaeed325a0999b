"""The readers of Argoverse 2: Sensor logs and Motion Forecasting scenarios, which share maps.

    <log>/annotations.feather, <log>/city_SE3_egovehicle.feather, <log>/map/log_map_archive_*.json
    <id>/scenario_<id>.parquet, <id>/log_map_archive_<id>.json

A frame of a log is an annotated sweep, of a scenario a timestep, counted from 0; without one the
last step that the data set calls observed, so that the future to be forecast is what follows t0.
City frame, headings of the forward axis seen from above. Bicycle lanes are left out: no car
drives there. The maps have no speed limits, no lights (their state is unknown) and no sidewalks.
"""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
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
    moments_of,
    reading_at,
    speeds,
)
from augment.formats.road_map import FloatArray, RoadMap, Segment
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, AreaKind
from augment.scene.recording import Note, SceneNoteKind
from augment.scene.schema import problems_of

WHAT = "Argoverse 2 log"
MOTION = "Argoverse 2 forecasting scenario"
LICENCE = "CC BY-NC-SA 4.0"
BOXES, POSES = "annotations.feather", "city_SE3_egovehicle.feather"
EGO_LENGTH_M, EGO_WIDTH_M = 4.877, 1.852
REAR_AXLE_TO_CENTER_M = 1.42
"""The fleet's car, a Ford Fusion: half its length less the overhang behind the rear axle."""
EGO = "EGO_VEHICLE"
"""Some releases annotate the ego itself, as a box at its frame's origin; it is no other agent."""
MOTION_EGO = "AV"
STEP_S = 0.1
MOST_STEPS = 10_000

_CATEGORIES = {
    AgentType.VEHICLE: "REGULAR_VEHICLE LARGE_VEHICLE BOX_TRUCK TRUCK TRUCK_CAB VEHICULAR_TRAILER "
    "RAILED_VEHICLE",
    AgentType.BUS: "BUS SCHOOL_BUS ARTICULATED_BUS",
    AgentType.BICYCLE: "BICYCLE BICYCLIST MOTORCYCLE MOTORCYCLIST WHEELED_DEVICE WHEELED_RIDER",
    AgentType.PEDESTRIAN: "PEDESTRIAN OFFICIAL_SIGNALER STROLLER WHEELCHAIR",
    AgentType.TRAFFIC_CONE: "CONSTRUCTION_CONE",
    AgentType.BARRIER: "CONSTRUCTION_BARREL",
    AgentType.CONSTRUCTION_SIGN: "SIGN STOP_SIGN MOBILE_PEDESTRIAN_CROSSING_SIGN "
    "MESSAGE_BOARD_TRAILER",
    AgentType.GENERIC_OBJECT: "TRAFFIC_LIGHT_TRAILER BOLLARD ANIMAL DOG",
}
TYPE_OF = {name: kind for kind, names in _CATEGORIES.items() for name in names.split()}
"""As nuPlan has it: two wheels are a bicycle, strollers and wheelchairs go with pedestrians. A
table without a rest: a category that is not in it is refused by name."""
MOTION_TYPE_OF = {
    "vehicle": AgentType.VEHICLE,
    "pedestrian": AgentType.PEDESTRIAN,
    "motorcyclist": AgentType.BICYCLE,
    "cyclist": AgentType.BICYCLE,
    "riderless_bicycle": AgentType.BICYCLE,
    "bus": AgentType.BUS,
    "construction": AgentType.TRAFFIC_CONE,
    "static": AgentType.GENERIC_OBJECT,
    "background": AgentType.GENERIC_OBJECT,
    "unknown": AgentType.GENERIC_OBJECT,
}
MERGED = frozenset({"motorcyclist", "riderless_bicycle", "construction", "static", "background"})
_QUATERNION, _PLACE = ("qx", "qy", "qz", "qw"), ("tx_m", "ty_m", "tz_m")
_POSITION = ("position_x", "position_y", "heading", "velocity_x", "velocity_y")


class ArgoverseSensor:
    """The reader of Argoverse 2 Sensor logs."""

    name = "av2"
    title = "Argoverse 2 Sensor log (folder)"

    def recognises(self, path: Path) -> bool:
        """A folder with annotations."""
        return (path / BOXES).is_file()

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Sweeps that far apart."""
        return moments_of(_read_log(path), every_s)

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene at one annotated sweep, and what was recorded to the end of the log."""
        if not path.is_dir():
            raise InvalidDocument(WHAT, [(str(path), "is not a folder")])
        if item is not None:
            raise InvalidDocument(WHAT, [("item", f"a log has no parts, {item!r} is not there")])
        frame = frame or 0
        map_file = _map_file_in(path, "map/", WHAT)
        log = _read_log(path)
        city = re.search(r"____([A-Z]+)_city", map_file.name)
        return reading_at(
            log,
            frame,
            _read_map(map_file, WHAT),
            name=name,
            world=f"Argoverse 2 city frame {city[1]}" if city else "Argoverse 2 city frame",
            provenance=(
                f"Argoverse 2 Sensor data set, log {path.resolve().name}, frame {frame} of "
                f"{len(log.times_s)}; {LICENCE}"
            ),
            licence=LICENCE,
            notes=[Note(kind=SceneNoteKind.SPEEDS_DIFFERENCED)],
        )


class ArgoverseMotion:
    """The reader of Argoverse 2 Motion Forecasting scenarios; `item` is the track of the ego."""

    name = "av2-motion"
    title = "Argoverse 2 Motion Forecasting scenario (folder, or its parquet file)"

    def recognises(self, path: Path) -> bool:
        """A scenario file by its name, or a folder with one."""
        if path.is_dir():
            return any(path.glob("scenario_*.parquet"))
        return path.is_file() and path.match("scenario_*.parquet")

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Steps in which the ego is there."""
        log, _ = _motion_log(_read_motion(_scenario_file(path)), MOTION_EGO)
        return moments_of(log, every_s)

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene at one step, and what was recorded to the end of the scenario."""
        file = _scenario_file(path)
        table = _read_motion(file)
        log, kinds = _motion_log(table, item or MOTION_EGO)
        if frame is None:
            frame = int(table["timestep"][table["observed"] > 0].max(initial=0))
        notes = [Note(kind=SceneNoteKind.NO_BOX_SIZES)]
        merged = [f"{kind}: {MOTION_TYPE_OF[kind].value}" for kind in sorted(kinds & MERGED)]
        if merged:
            notes.append(Note(kind=SceneNoteKind.CLASSES_MERGED, names=tuple(merged)))
        ego = "" if item is None else f", track {item} as the ego"
        return reading_at(
            log,
            frame,
            _read_map(_map_file_in(file.parent, "", MOTION), MOTION),
            name=name,
            world="Argoverse 2 city frame",
            provenance=(
                f"Argoverse 2 Motion Forecasting data set, "
                f"{file.stem.removeprefix('scenario_')[:80]}, step {frame} of "
                f"{len(log.times_s)}{ego}; {LICENCE}"
            ),
            licence=LICENCE,
            notes=notes,
            item=item,
        )


# Tables


def _read_table(
    file: Path, what: str, *, numbers: Sequence[str], texts: Sequence[str], whole: Sequence[str]
) -> dict[str, Any]:
    """The named columns of a Feather or Parquet file, all present and finite.

    Numbers become float64, whole ones int64, texts categorical series. Both formats can be
    compressed a thousandfold, and pyarrow takes every length at its word: what is too large for
    the memory of the reading process ends there (`sandbox`).
    """
    import pyarrow as pa
    from pyarrow import parquet

    faults = (
        *(ValueError, TypeError, KeyError, IndexError, OSError, OverflowError, AttributeError),
        *(NotImplementedError, pa.ArrowCapacityError, pa.ArrowSerializationError),
    )
    if not file.is_file():
        raise InvalidDocument(what, [(file.name, f"is not in {file.parent}")])
    wanted, source = [*whole, *numbers, *texts], pa.BufferReader(file.read_bytes())
    try:
        if file.suffix == ".parquet":
            table = parquet.ParquetFile(source, read_dictionary=list(texts)).read()
        else:
            table = pa.ipc.open_file(source).read_all()
        missing = [name for name in wanted if table.column_names.count(name) != 1]
        table = table.select([name for name in wanted if name not in missing])
        table.validate(full=True)
    except faults as fault:
        kind = file.suffix.removeprefix(".")
        problem = f"is not a {kind} file, or can't be read: {str(fault)[:200]}"
        raise InvalidDocument(what, [(file.name, problem)]) from None
    if missing:
        raise InvalidDocument(what, [(file.name, f"has no column {name!r}") for name in missing])
    try:
        frame = table.to_pandas(strings_to_categorical=True)
        columns = {name: frame[name] for name in texts}
        for name, column in columns.items():
            if column.isna().any() or not all(
                isinstance(one, str) for one in column.cat.categories
            ):
                raise ValueError(f"a text is missing in {name}")
        columns |= {name: frame[name].to_numpy().astype(np.float64) for name in numbers}
        columns |= {
            name: frame[name].to_numpy().astype(np.int64, casting="safe") for name in whole
        }
    except faults as fault:
        problem = f"has a column of a wrong kind: {str(fault)[:200]}"
        raise InvalidDocument(what, [(file.name, problem)]) from None
    for name in numbers:
        broken = np.flatnonzero(~np.isfinite(columns[name]))
        if len(broken):
            raise InvalidDocument(what, [(f"{file.name}[{broken[0]}].{name}", "is not finite")])
    return columns


def _check_kinds(column: Any, known: Collection[str], what: str, place: str) -> frozenset[str]:
    """The kinds of objects that are there, all of them known."""
    used = frozenset(column.unique())
    unknown = sorted(used - set(known))[:5]
    if unknown:
        names = ", ".join(sorted(known))
        problems = [(place, f"unknown {one!r}; known: {names}") for one in unknown]
        raise InvalidDocument(what, problems)
    return used


def _read_log(folder: Path) -> Log:
    """The two tables of a log: boxes in the ego frame of their sweep, poses in the city frame.

    The ego frame's origin lies under the rear axle; in the log the ego is its geometric centre.
    R rows of boxes, T sweeps.
    """
    numbers, stamp = (*_QUATERNION, *_PLACE), ("timestamp_ns",)
    boxes = _read_table(
        folder / BOXES,
        WHAT,
        numbers=(*numbers, "length_m", "width_m"),
        texts=("track_uuid", "category"),
        whole=stamp,
    )
    poses = _read_table(folder / POSES, WHAT, numbers=numbers, texts=(), whole=stamp)
    _check_kinds(boxes["category"], {*TYPE_OF, EGO}, WHAT, f"{BOXES}: category")
    stamps, sweep_of_row = np.unique(boxes["timestamp_ns"], return_inverse=True)
    if len(stamps) == 0:
        raise InvalidDocument(WHAT, [(BOXES, "has no annotated sweep")])
    posed, rows = np.unique(poses["timestamp_ns"], return_index=True)
    unposed = np.setdiff1d(stamps, posed)
    if len(unposed):
        text = f"has no pose at the annotated time {unposed[0]} ns"
        raise InvalidDocument(WHAT, [(POSES, text)])
    rows = rows[np.searchsorted(posed, stamps)]
    turn, place = _rigid({name: poses[name][rows] for name in numbers})
    box_turn, box_place = _rigid(boxes)
    times_s = (stamps - stamps[0]) * 1e-9
    heading = np.arctan2(turn[:, 1, 0], turn[:, 0, 0])
    level = np.column_stack([np.cos(heading), np.sin(heading)])
    center = place[:, :2] + REAR_AXLE_TO_CENTER_M * level
    city_turn = turn[sweep_of_row]
    xy = (np.einsum("rij,rj->ri", city_turn, box_place) + place[sweep_of_row])[:, :2]
    ahead = np.einsum("rij,rj->ri", city_turn, box_turn[:, :, 0])
    states = np.column_stack([xy, np.arctan2(ahead[:, 1], ahead[:, 0])])
    return Log(
        what=WHAT,
        times_s=times_s,
        ego=np.column_stack([center, heading, speeds(times_s, center)]),
        ego_length_m=EGO_LENGTH_M,
        ego_width_m=EGO_WIDTH_M,
        tracks=tuple(_log_tracks(boxes, sweep_of_row, states, times_s)),
    )


def _rigid(columns: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Rotations (R, 3, 3) and places (R, 3) of quaternion and translation columns."""
    quaternion = np.column_stack([columns[name] for name in _QUATERNION])
    length = np.linalg.norm(quaternion, axis=1)
    if (length < 1e-6).any():
        raise InvalidDocument(WHAT, [("qw", "has a quaternion of length 0")])
    x, y, z, w = (quaternion / length[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0), np.column_stack([columns[one] for one in _PLACE])


def _log_tracks(
    boxes: dict[str, Any], sweeps: NDArray[np.int64], states: FloatArray, times_s: FloatArray
) -> Iterator[LoggedTrack]:
    kinds = boxes["category"]
    for name, rows in (
        boxes["track_uuid"].groupby(boxes["track_uuid"], observed=True).indices.items()
    ):
        kind = kinds.iloc[rows[0]]
        if kind == EGO:
            continue
        seen, first = np.unique(sweeps[rows], return_index=True)
        mine = rows[first]
        track = np.full((len(times_s), 4), np.nan)
        track[seen] = np.column_stack([states[mine], speeds(times_s[seen], states[mine, :2])])
        yield LoggedTrack(
            name=str(name),
            type=TYPE_OF[kind],
            length_m=float(boxes["length_m"][mine[0]]),
            width_m=float(boxes["width_m"][mine[0]]),
            states=track,
        )


def _scenario_file(path: Path) -> Path:
    files = sorted(path.glob("scenario_*.parquet")) if path.is_dir() else [path]
    if len(files) != 1:
        text = f"{len(files)} such files in {path}; there must be one"
        raise InvalidDocument(MOTION, [("scenario_*.parquet", text)])
    return files[0]


def _read_motion(file: Path) -> dict[str, Any]:
    table = _read_table(
        file,
        MOTION,
        numbers=_POSITION,
        texts=("track_id", "object_type"),
        whole=("timestep", "observed"),
    )
    steps = table["timestep"]
    if not len(steps):
        raise InvalidDocument(MOTION, [(file.name, "has no row")])
    if steps.min() < 0 or steps.max() >= MOST_STEPS:
        raise InvalidDocument(MOTION, [("timestep", f"lies outside of 0 to {MOST_STEPS - 1}")])
    return table


def _motion_log(table: dict[str, Any], ego_id: str) -> tuple[Log, frozenset[str]]:
    """The log of a scenario, and the object types that are here; positions are centres."""
    kinds = _check_kinds(table["object_type"], MOTION_TYPE_OF, MOTION, "object_type")
    x_m, y_m, heading_rad, *velocity_mps = (table[name] for name in _POSITION)
    rows = np.column_stack([x_m, y_m, heading_rad, np.hypot(*velocity_mps)])
    steps = table["timestep"]
    tracks = {}
    for name, mine in table["track_id"].groupby(table["track_id"], observed=True).indices.items():
        kind = MOTION_TYPE_OF[table["object_type"].iloc[mine[0]]]
        length_m, width_m = LENGTH_WIDTH_M[kind]
        states = np.full((int(steps.max()) + 1, 4), np.nan)
        states[steps[mine]] = rows[mine]
        tracks[str(name)] = LoggedTrack(
            name=str(name), type=kind, length_m=length_m, width_m=width_m, states=states
        )
    if ego_id not in tracks:
        text = f"{ego_id[:40]!r} is not there; known: {', '.join(sorted(tracks)[:12])}"
        raise InvalidDocument(MOTION, [("track_id", text)])
    ego = tracks.pop(ego_id)
    log = Log(
        what=MOTION,
        times_s=np.arange(len(ego.states), dtype=np.float64) * STEP_S,
        ego=ego.states,
        ego_length_m=EGO_LENGTH_M,
        ego_width_m=EGO_WIDTH_M,
        tracks=tuple(tracks.values()),
    )
    return log, kinds


# Maps


class _Part(BaseModel):
    """A part of the map file; fields that nobody needs here are allowed."""

    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False, frozen=True)


class _Point(_Part):
    x: float
    y: float


_Points = Annotated[list[_Point], Field(fail_fast=True, min_length=2)]


class _Segment(_Part):
    """A lane segment; boundaries run in the direction of travel."""

    id: int
    is_intersection: bool
    lane_type: Literal["VEHICLE", "BUS", "BIKE"]
    left_lane_boundary: _Points
    right_lane_boundary: _Points
    predecessors: list[int]
    successors: list[int]
    left_neighbor_id: int | None = None
    right_neighbor_id: int | None = None


class _Crossing(_Part):
    """A crosswalk, by its two long edges."""

    edge1: _Points
    edge2: _Points


class _Drivable(_Part):
    area_boundary: Annotated[list[_Point], Field(fail_fast=True, min_length=3)]


class _Map(_Part):
    lane_segments: dict[str, _Segment]
    drivable_areas: dict[str, _Drivable] = {}
    pedestrian_crossings: dict[str, _Crossing] = {}


def _map_file_in(path: Path, folder: str, what: str) -> Path:
    files = sorted((path / folder).glob("log_map_archive_*.json"))
    if len(files) != 1:
        text = "no such file" if not files else f"{len(files)} such files; there must be one"
        raise InvalidDocument(what, [(f"{folder}log_map_archive_*.json", f"{text} in {path}")])
    return files[0]


def _read_map(file: Path, what: str) -> RoadMap:
    """The map in that file, with what maps of Argoverse 2 don't say."""
    document = read_json(file, what=what)
    try:
        city = _Map.model_validate(document)
    except ValidationError as fault:
        problems = [(f"{file.name}: {place}", text) for place, text in problems_of(fault)]
        raise InvalidDocument(what, problems) from None
    areas = [
        (AreaKind.DRIVABLE, _points(area.area_boundary)) for area in city.drivable_areas.values()
    ]
    for crossing in city.pedestrian_crossings.values():
        one, other = _points(crossing.edge1), _points(crossing.edge2)
        is_same_way = float(np.dot(one[-1] - one[0], other[-1] - other[0])) > 0.0
        areas.append((AreaKind.CROSSWALK, np.vstack([one, other[::-1] if is_same_way else other])))
    driven = [one for one in city.lane_segments.values() if one.lane_type != "BIKE"]
    missing = (SceneNoteKind.NO_SPEED_LIMITS, SceneNoteKind.NO_LIGHTS, SceneNoteKind.NO_WALKWAYS)
    notes = [Note(kind=kind) for kind in missing]
    bicycle_lanes = len(city.lane_segments) - len(driven)
    if bicycle_lanes:
        notes.append(Note(kind=SceneNoteKind.BICYCLE_LANES_LEFT_OUT, number=bicycle_lanes))
    return RoadMap(
        what=what,
        place=f"{file.name}: lane_segments",
        segments=tuple(
            Segment(
                name=one.id,
                crosses=one.is_intersection,
                left=_points(one.left_lane_boundary),
                right=_points(one.right_lane_boundary),
                successors=tuple(one.successors),
                predecessors=tuple(one.predecessors),
                left_neighbors=() if one.left_neighbor_id is None else (one.left_neighbor_id,),
                right_neighbors=() if one.right_neighbor_id is None else (one.right_neighbor_id,),
            )
            for one in driven
        ),
        areas=tuple(areas),
        notes=tuple(notes),
    )


def _points(points: Sequence[_Point]) -> FloatArray:
    return np.array([[point.x, point.y] for point in points])
