"""What LCTGen generated: vehicles around the ego, to be added to a scene.

LCTGen (Tan et al., CoRL 2023) places up to 32 vehicles on the lanes around the ego, in the frame
of the ego at t0: metres, x forward, y left. Read from the released code, its own words:

    agent    rows of x, y, vx, vy, heading, length, width[, type], the ego first: the features of
             its `WaymoAgent`s, in a .npz, a .json, or a pickled dictionary
    tracks   by number from 0, the ego first, each a `state` (T, 10) of x, y, z, length, width,
             height, heading, vx, vy, valid, of which the first row is t0: the pickle of its
             `save_as_metadrive_data`, in which all boxes are 5.286 x 2.332 m

Rows without any size pad a list to 32. The generated ego is left out: a scene has its own.
"""

import lzma
import struct
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from augment.foreign import FloatArray, fault_at, read_finite
from augment.formats.reading import LONGEST_M
from augment.geometry.frames import wrap
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, Modification, TrafficAgent

NAME = "lctgen"
_COLUMNS = 7
_TRACK_COLUMNS = [0, 1, 7, 8, 6, 3, 4, 9]
"""Where x, y, vx, vy, heading, length, width and valid stand in a track's state."""
_BROKEN = (
    *(OSError, ValueError, EOFError, RuntimeError, NotImplementedError, struct.error),
    *(zipfile.BadZipFile, zlib.error, lzma.LZMAError),
)
"""What zips raise that are broken, encrypted, or packed in ways of their own."""
_ASIDE_M = 1.0
"""How far its ego may lie from the origin without a note: it is sampled around a lane."""


def read_arrays(path: Path) -> dict[str, FloatArray]:
    """Return the array `agent` of a .npz, if it is there; nothing in the file is run.

    Raises:
        InvalidDocument: It is no .npz, or broken, or holds objects.
    """
    try:
        with np.load(path, allow_pickle=False) as arrays:
            return {"agent": arrays["agent"]} if "agent" in arrays else {}
    except _BROKEN as fault:
        raise fault_at(path.name, f"is no .npz that is read: {str(fault)[:200]}") from None


def read_vehicles(document: object) -> tuple[Modification, tuple[str, ...]]:
    """Return the vehicles to be added, and notes on what is not said.

    Args:
        document: What a .npz, .pkl or .json holds.

    Raises:
        InvalidDocument: Neither `agent` nor `tracks`, or a row that is no vehicle.
    """
    rows = _rows(document)
    notes = ["LCTGen says nothing of other road users than vehicles, nor what stays or goes."]
    away_m = float(np.hypot(*rows[0, :2]))
    if away_m > _ASIDE_M:
        notes.append(f"Its ego, {away_m:.2f} m from the scene's, is left out.")
    others = rows[1:]
    others = others[np.abs(others).any(axis=1)]
    fits = (others[:, 5:] > 0.0005) & (others[:, 5:] <= LONGEST_M)
    is_sized = [all(both) for both in fits.tolist()]
    if not all(is_sized):
        notes.append(f"{is_sized.count(False)} vehicles without a size got the usual one.")
    vehicles = []
    usual_m = LENGTH_WIDTH_M[AgentType.VEHICLE]
    for number, (row, has_size) in enumerate(zip(others.tolist(), is_sized, strict=True), start=1):
        x_m, y_m, vx_mps, vy_mps, heading_rad, *size_m = row
        length_m, width_m = size_m if has_size else usual_m
        vehicles.append(
            TrafficAgent(
                id=f"{NAME}-{number}",
                type=AgentType.VEHICLE,
                x_m=x_m,
                y_m=y_m,
                heading_rad=wrap(heading_rad),
                length_m=length_m,
                width_m=width_m,
                speed_mps=float(np.hypot(vx_mps, vy_mps)),
            )
        )
    return Modification(added=tuple(vehicles)), tuple(notes)


# Private


def _rows(document: object) -> FloatArray:
    """The vehicles, the ego first: (N, 7) x, y, vx, vy, heading, length, width."""
    parts = document if isinstance(document, Mapping) else {}
    if "agent" in parts:
        return read_finite(parts["agent"], "agent", _COLUMNS)
    tracks = parts.get("tracks")
    if not isinstance(tracks, Mapping) or not tracks:
        raise fault_at("", "expected LCTGen's `agent` or `tracks`")
    rows = np.vstack([_first_state(one, f"tracks[{n}]") for n, one in enumerate(tracks.values())])
    if not rows[0, -1]:
        raise fault_at("tracks", "the first is the ego, and is not there at t0")
    return np.asarray(rows[rows[:, -1] > 0.0, :_COLUMNS])


def _first_state(track: Any, place: str) -> FloatArray:
    state = track.get("state") if isinstance(track, Mapping) else None
    states = read_finite(() if state is None else state, f"{place}.state", 10)
    return np.asarray(states[0, _TRACK_COLUMNS])
