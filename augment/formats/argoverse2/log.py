"""The two tables of a log: boxes and ego poses, brought into the city frame.

Boxes are stored in the ego frame of their own sweep, poses as city_SE3_egovehicle. The ego frame's
origin lies under the rear axle; from here on the ego is its geometric centre. Headings are those
of the forward axis, seen from above. T sweeps, R rows.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from augment.errors import InvalidDocument
from augment.formats.argoverse2.categories import EGO, TYPE_OF
from augment.formats.recorded_log import MOST_NUMBERS, Log, LoggedTrack, speeds

WHAT = "Argoverse 2 log"
BOXES = "annotations.feather"
POSES = "city_SE3_egovehicle.feather"

EGO_LENGTH_M = 4.877
EGO_WIDTH_M = 1.852
REAR_AXLE_TO_CENTER_M = 1.42
"""The fleet's car, a Ford Fusion: half its length less the overhang behind the rear axle."""

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
    boxes = _columns(folder / BOXES, (*numbers, "length_m", "width_m"), ("track_uuid", "category"))
    poses = _columns(folder / POSES, numbers, ())
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


def _columns(file: Path, numbers: tuple[str, ...], texts: tuple[str, ...]) -> dict[str, Any]:
    """The named columns and the time stamps (int64) of a feather file, all present and finite."""
    import pyarrow as pa
    from pyarrow import feather

    if not file.is_file():
        raise InvalidDocument(WHAT, [(file.name, f"is not in {file.parent}")])
    try:
        table = feather.read_table(file)
    except (pa.ArrowException, OSError) as fault:
        raise InvalidDocument(WHAT, [(file.name, f"is not a feather file: {fault}")]) from None
    wanted = ("timestamp_ns", *numbers, *texts)
    missing = [name for name in wanted if name not in table.column_names]
    if missing:
        raise InvalidDocument(WHAT, [(file.name, f"has no column {name!r}") for name in missing])
    try:
        columns: dict[str, Any] = {name: np.array(table[name].to_pylist(), str) for name in texts}
        columns |= {name: table[name].to_numpy().astype(np.float64) for name in numbers}
        columns["timestamp_ns"] = table["timestamp_ns"].to_numpy().astype(np.int64, casting="safe")
    except (TypeError, ValueError) as fault:
        raise InvalidDocument(
            WHAT, [(file.name, f"has a column of a wrong kind: {fault}")]
        ) from None
    for name in numbers:
        broken = np.flatnonzero(~np.isfinite(columns[name]))
        if len(broken):
            raise InvalidDocument(WHAT, [(f"{file.name}[{broken[0]}].{name}", "is not finite")])
    return columns


def _check_categories(categories: NDArray[np.str_]) -> None:
    unknown = sorted(set(categories.tolist()) - set(TYPE_OF) - {EGO})
    if unknown:
        known = ", ".join(sorted(TYPE_OF))
        problems = [(BOXES, f"unknown category {name!r}; known: {known}") for name in unknown]
        raise InvalidDocument(WHAT, problems)


def _rows_at(stamps: NDArray[np.int64], wanted: NDArray[np.int64]) -> NDArray[np.int64]:
    """The rows (T,) of the poses at exactly the sweeps' time stamps."""
    order = np.argsort(stamps, kind="stable")
    places = np.searchsorted(stamps[order], wanted)
    found = np.zeros(len(wanted), dtype=bool)
    inside = places < len(stamps)
    found[inside] = stamps[order][places[inside]] == wanted[inside]
    if not found.all():
        first = wanted[~found][0]
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
    order = np.lexsort((sweeps, boxes["track_uuid"]))
    uuids, starts = np.unique(boxes["track_uuid"][order], return_index=True)
    if len(uuids) * len(times_s) * 4 > MOST_NUMBERS:
        text = f"has {len(uuids)} tracks in {len(times_s)} sweeps, which is too much"
        raise InvalidDocument(WHAT, [(BOXES, text)])
    for uuid, mine in zip(uuids.tolist(), np.split(order, starts[1:]), strict=True):
        if boxes["category"][mine[0]] == EGO:
            continue
        mine = mine[np.concatenate([[True], np.diff(sweeps[mine]) > 0])]
        states = np.full((len(times_s), 4), np.nan)
        states[sweeps[mine]] = np.column_stack(
            [rows[mine], speeds(times_s[sweeps[mine]], rows[mine, :2])]
        )
        yield LoggedTrack(
            name=uuid,
            type=TYPE_OF[str(boxes["category"][mine[0]])],
            length_m=float(boxes["length_m"][mine[0]]),
            width_m=float(boxes["width_m"][mine[0]]),
            states=states,
        )
