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
from augment.formats.argoverse2 import EGO, TYPE_OF, TextColumn, read_arrow
from augment.formats.reading import Log, LoggedTrack, speeds

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
