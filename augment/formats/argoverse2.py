"""The readers of Argoverse 2: Sensor logs and Motion Forecasting scenarios, which share maps.

    <log>/annotations.feather, <log>/city_SE3_egovehicle.feather, <log>/map/log_map_archive_*.json
    <id>/scenario_<id>.parquet, <id>/log_map_archive_<id>.json

A frame of a log is an annotated sweep, of a scenario a timestep, counted from 0; without one the
last step that the data set calls observed, so that the future to be forecast is what follows t0.
City frame, headings of the forward axis seen from above. Bicycle lanes are left out: no car
drives there. The maps have no speed limits, no lights (their state is unknown) and no sidewalks.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from augment.errors import InvalidDocument
from augment.foreign import FURTHEST, WHAT, Doubts, FloatArray, fault_at, look_up, name_all
from augment.formats.documents import read_json
from augment.formats.reading import Log, LogReader, read_tracks, speeds
from augment.formats.road_map import RoadMap, Segment
from augment.scene.entities import AgentType, AreaKind
from augment.scene.schema import list_problems

if TYPE_CHECKING:
    import pandas as pd
    from scipy.spatial.transform import Rotation

LICENCE = "CC BY-NC-SA 4.0"
WORLD = "Argoverse 2 city frame"
BOXES, POSES = "annotations.feather", "city_SE3_egovehicle.feather"
EGO_SIZE_M = (4.877, 1.852)
REAR_AXLE_TO_CENTER_M = 1.42
"""The fleet's car, a Ford Fusion: half its length less the overhang behind the rear axle."""
EGO = "EGO_VEHICLE"
"""Some releases annotate the ego itself, as a box at its frame's origin; it is no other agent."""
MOTION_EGO = "AV"
STEP_S = 0.1
MOST_STEPS = 10_000

TYPE_OF = name_all(
    {
        AgentType.VEHICLE: "REGULAR_VEHICLE LARGE_VEHICLE BOX_TRUCK TRUCK TRUCK_CAB "
        "VEHICULAR_TRAILER RAILED_VEHICLE",
        AgentType.BUS: "BUS SCHOOL_BUS ARTICULATED_BUS",
        AgentType.BICYCLE: "BICYCLE BICYCLIST MOTORCYCLE MOTORCYCLIST WHEELED_DEVICE "
        "WHEELED_RIDER",
        AgentType.PEDESTRIAN: "PEDESTRIAN OFFICIAL_SIGNALER STROLLER WHEELCHAIR",
        AgentType.TRAFFIC_CONE: "CONSTRUCTION_CONE",
        AgentType.BARRIER: "CONSTRUCTION_BARREL",
        AgentType.CONSTRUCTION_SIGN: "SIGN STOP_SIGN MOBILE_PEDESTRIAN_CROSSING_SIGN "
        "MESSAGE_BOARD_TRAILER",
        AgentType.GENERIC_OBJECT: "TRAFFIC_LIGHT_TRAILER BOLLARD ANIMAL DOG",
    }
)
"""As nuPlan has it: two wheels are a bicycle, strollers and wheelchairs go with pedestrians. A
table without a rest: a category that is not in it is refused by name."""
MOTION_TYPE_OF = name_all(
    {
        AgentType.VEHICLE: "vehicle",
        AgentType.PEDESTRIAN: "pedestrian",
        AgentType.BICYCLE: "motorcyclist cyclist riderless_bicycle",
        AgentType.BUS: "bus",
        AgentType.TRAFFIC_CONE: "construction",
        AgentType.GENERIC_OBJECT: "static background unknown",
    }
)
_QUATERNION, _PLACE = ["qx", "qy", "qz", "qw"], ["tx_m", "ty_m", "tz_m"]
_RIGID = dict.fromkeys((*_QUATERNION, *_PLACE), "double")
_POSE_COLUMNS = {"timestamp_ns": "int64", **_RIGID}
_BOX_COLUMNS = {
    **_POSE_COLUMNS,
    **dict.fromkeys(("length_m", "width_m"), "double"),
    **dict.fromkeys(("track_uuid", "category"), "text"),
}
_POSITION = ["position_x", "position_y", "heading", "velocity_x", "velocity_y"]
_MOTION_COLUMNS = {
    **dict.fromkeys(("timestep", "observed"), "int64"),
    **dict.fromkeys(_POSITION, "double"),
    **dict.fromkeys(("track_id", "object_type"), "text"),
}


class ArgoverseSensor(LogReader):
    """The reader of Argoverse 2 Sensor logs."""

    name = "av2"
    title = "Argoverse 2 Sensor log (folder)"
    has_items = False

    def recognises(self, path: Path) -> bool:
        """A folder with annotations."""
        return (path / BOXES).is_file()

    def logs(self, path: Path, item: str | None) -> Iterator[Log]:
        """The one log.

        Its boxes are in the ego frame of their sweep, whose origin lies under the rear axle; here
        the ego is its geometric centre. T sweeps.
        """
        doubts = Doubts()
        boxes = _read_table(path / BOXES, _BOX_COLUMNS, doubts)
        poses = _read_table(path / POSES, _POSE_COLUMNS, doubts)
        boxes = _select_known(boxes, "category", {**TYPE_OF, EGO: None}, doubts)
        is_repeat = poses.duplicated("timestamp_ns")
        doubts.assume("Of two poses at one time the first counts", is_repeat.sum())
        poses = poses[~is_repeat].set_index("timestamp_ns")
        has_pose = boxes["timestamp_ns"].isin(poses.index)
        doubts.assume("A box at a time without a pose was left out", (~has_pose).sum())
        boxes = boxes[has_pose]
        stamps, sweeps = np.unique(boxes["timestamp_ns"], return_inverse=True)
        poses = poses.reindex(stamps)
        if not len(stamps):
            raise fault_at(POSES, "has no pose at an annotated time")
        times_s = (stamps - stamps[0]) * 1e-9
        turn, places = _rotation(poses), poses[_PLACE].to_numpy(copy=True)
        forward = turn.apply([1.0, 0.0, 0.0])
        heading = np.arctan2(forward[:, 1], forward[:, 0])
        level = np.column_stack([np.cos(heading), np.sin(heading)])
        center = places[:, :2] + REAR_AXLE_TO_CENTER_M * level
        in_city = turn[sweeps]
        box_places = in_city.apply(boxes[_PLACE].to_numpy(copy=True)) + places[sweeps]
        ahead = (in_city * _rotation(boxes)).apply([1.0, 0.0, 0.0])
        table = boxes.rename(columns={"track_uuid": "track", "category": "kind"}).assign(
            step=sweeps,
            x_m=box_places[:, 0],
            y_m=box_places[:, 1],
            heading_rad=np.arctan2(ahead[:, 1], ahead[:, 0]),
        )
        tracks = read_tracks(table[table["kind"] != EGO], TYPE_OF, times_s, doubts)
        yield Log(
            times_s=times_s,
            ego=np.column_stack([center, heading, speeds(times_s, center)]),
            ego_size_m=EGO_SIZE_M,
            tracks=[*tracks.values()],
            map_at=lambda _: _read_map(path / "map"),
            world=WORLD,
            title=f"Argoverse 2 Sensor data set, log {path.resolve().name}",
            licence=LICENCE,
            notes=["Speeds were taken from the recorded places.", *doubts.notes],
        )


class ArgoverseMotion(LogReader):
    """The reader of Argoverse 2 Motion Forecasting scenarios; `item` is the track of the ego."""

    name = "av2-motion"
    title = "Argoverse 2 Motion Forecasting scenario (folder, or its parquet file)"

    def recognises(self, path: Path) -> bool:
        """A scenario file by its name, or a folder with one."""
        if path.is_dir():
            return any(path.glob("scenario_*.parquet"))
        return path.is_file() and path.match("scenario_*.parquet")

    def logs(self, path: Path, item: str | None) -> Iterator[Log]:
        """The scenario, with one of its tracks as the ego; positions are centres."""
        file = _only_file(path, "scenario_*.parquet") if path.is_dir() else path
        doubts = Doubts()
        table = _read_table(file, _MOTION_COLUMNS, doubts)
        table = _select_known(table, "object_type", MOTION_TYPE_OF, doubts)
        is_step = table["timestep"].between(0, MOST_STEPS - 1)
        doubts.assume(
            f"A step that is not from 0 to {MOST_STEPS - 1} was left out", (~is_step).sum()
        )
        table = table[is_step]
        steps = table["timestep"]
        if not len(steps):
            raise fault_at(f"{file.name}: timestep", f"needs steps from 0 to {MOST_STEPS - 1}")
        doubts.assume("No step is observed: the first is t0", not table["observed"].any())
        names = {"track_id": "track", "object_type": "kind", "timestep": "step"}
        names |= {"position_x": "x_m", "position_y": "y_m", "heading": "heading_rad"}
        speeds_mps = np.hypot(table["velocity_x"], table["velocity_y"])
        times_s = np.arange(steps.max() + 1) * STEP_S
        table = table.rename(columns=names).assign(speed_mps=speeds_mps)
        tracks = read_tracks(table, MOTION_TYPE_OF, times_s, doubts)
        ego_id = item or MOTION_EGO
        ego = look_up(tracks, ego_id, "track_id")
        yield Log(
            times_s=times_s,
            ego=ego.states,
            ego_size_m=EGO_SIZE_M,
            tracks=[track for name, track in tracks.items() if name != ego_id],
            map_at=lambda _: _read_map(file.parent),
            world=WORLD,
            title=f"Argoverse 2 Motion Forecasting data set, {file.stem[:90]}, ego {ego_id}",
            licence=LICENCE,
            item=item,
            frame=int(steps[table["observed"] > 0].max()) if table["observed"].any() else 0,
            notes=doubts.notes,
        )


# Tables


def _read_table(file: Path, columns: Mapping[str, str], doubts: Doubts) -> "pd.DataFrame":
    """The named columns of a Feather or Parquet file; rows with gaps or odd numbers are left out.

    Both formats can be compressed a thousandfold, and pyarrow takes every length at its word:
    what is too large for the memory of the reading process ends there (`sandbox`).
    """
    import pyarrow as pa
    from pyarrow import parquet

    text = pa.dictionary(pa.int32(), pa.string())
    types = {"int64": pa.int64(), "double": pa.float64(), "text": text}
    try:
        source = pa.BufferReader(file.read_bytes())
        if file.suffix == ".parquet":
            table = parquet.ParquetFile(source, read_dictionary=list(columns)).read()
        else:
            table = pa.ipc.open_file(source).read_all()
        table = table.select(list(columns))
        table.validate(full=True)
        table = table.cast(pa.schema([(name, types[kind]) for name, kind in columns.items()]))
    except (pa.ArrowException, *_ARROW_FAULTS) as fault:
        problem = f"can't be read, or has not the columns {', '.join(columns)}: {str(fault)[:200]}"
        raise fault_at(file.name, problem) from None
    frame: pd.DataFrame = table.to_pandas()
    # An object without a size has the usual one.
    doubles = {name for name, kind in columns.items() if kind == "double"}
    numbers = frame[sorted(doubles - {"length_m", "width_m"})].to_numpy()
    is_odd = ~(np.abs(numbers) <= FURTHEST).all(axis=1)
    is_odd |= frame[sorted(columns.keys() - doubles)].isna().any(axis=1).to_numpy()
    if set(_QUATERNION) <= columns.keys():
        is_odd |= np.abs(frame[_QUATERNION].to_numpy()).max(axis=1, initial=0.0) < 1e-6
    lost = f"A row of {file.name} with a gap or an odd number was left out"
    doubts.assume(lost, is_odd.sum())
    counts = {name: "int64" for name, kind in columns.items() if kind == "int64"}
    whole: pd.DataFrame = frame[~is_odd].reset_index(drop=True).astype(counts)
    return whole


def _select_known(
    table: "pd.DataFrame", column: str, types: Mapping[str, object], doubts: Doubts
) -> "pd.DataFrame":
    """The rows of kinds that are known."""
    is_odd = ~table[column].isin(list(types))
    doubts.doubt_unknown("kinds of objects", types, table[column][is_odd].unique(), column)
    usable: pd.DataFrame = table[~is_odd].reset_index(drop=True)
    return usable


_ARROW_FAULTS = (ValueError, TypeError, KeyError, IndexError, OSError, OverflowError)


def _rotation(columns: "pd.DataFrame") -> "Rotation":
    from scipy.spatial.transform import Rotation

    try:
        return Rotation.from_quat(columns[_QUATERNION].to_numpy(copy=True))
    except ValueError as fault:
        raise fault_at("qw", f"has a quaternion that is none: {fault}") from None


# Maps


class _Part(BaseModel):
    """A part of the map file; fields that nobody needs here are allowed."""

    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False, frozen=True)


Part = TypeVar("Part", bound=_Part)


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
    predecessors: tuple[int, ...] = Field(strict=False)
    successors: tuple[int, ...] = Field(strict=False)
    left_neighbor_id: int | None = None
    right_neighbor_id: int | None = None


class _Crossing(_Part):
    """A crosswalk, by its two long edges."""

    edge1: _Points
    edge2: _Points


class _Drivable(_Part):
    area_boundary: _Points


class _Map(_Part):
    """Its parts are read one by one."""

    lane_segments: dict[str, object]
    drivable_areas: dict[str, object] = {}
    pedestrian_crossings: dict[str, object] = {}


def _only_file(folder: Path, pattern: str) -> Path:
    files = sorted(folder.glob(pattern))
    if len(files) != 1:
        raise fault_at(pattern, f"{len(files)} such files in {folder}; there must be one")
    return files[0]


def _read_map(folder: Path) -> RoadMap:
    file = _only_file(folder, "log_map_archive_*.json")
    doubts, city = Doubts(), _read_part(_Map, read_json(file, what=WHAT), file.name)

    def read_parts(kind: type[Part], name: str) -> list[Part]:
        rows = ((kind, value, f"{name}.{key[:40]}") for key, value in getattr(city, name).items())
        return doubts.read_all(name, _read_part, rows)

    areas = [
        (AreaKind.DRIVABLE, _array(area.area_boundary))
        for area in read_parts(_Drivable, "drivable_areas")
    ]
    for crossing in read_parts(_Crossing, "pedestrian_crossings"):
        first, other = _array(crossing.edge1), _array(crossing.edge2)
        is_same_way = float(np.dot(first[-1] - first[0], other[-1] - other[0])) > 0.0
        areas.append(
            (AreaKind.CROSSWALK, np.vstack([first, other[::-1] if is_same_way else other]))
        )
    lanes = read_parts(_Segment, "lane_segments")
    driven = [lane for lane in lanes if lane.lane_type != "BIKE"]
    return RoadMap(
        place=f"{file.name}: lane_segments",
        segments=tuple(
            Segment(
                name=lane.id,
                crosses=lane.is_intersection,
                left=_array(lane.left_lane_boundary),
                right=_array(lane.right_lane_boundary),
                successors=lane.successors,
                predecessors=lane.predecessors,
                left_neighbors=() if lane.left_neighbor_id is None else (lane.left_neighbor_id,),
                right_neighbors=()
                if lane.right_neighbor_id is None
                else (lane.right_neighbor_id,),
            )
            for lane in driven
        ),
        areas=tuple(areas),
        left_out={"bicycle lanes": len(lanes) - len(driven)},
        doubts=doubts,
    )


def _read_part(kind: type[Part], value: object, place: str) -> Part:
    try:
        return kind.model_validate(value)
    except ValidationError as fault:
        problems = [(f"{place}: {where}", text) for where, text in list_problems(fault)]
        raise InvalidDocument(WHAT, problems) from None


def _array(points: Sequence[_Point]) -> FloatArray:
    return np.array([(point.x, point.y) for point in points])
