"""What LCTGen generated becomes vehicles to be added, and nothing else."""

import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from augment.errors import InvalidDocument
from augment.formats.lctgen import read_arrays, read_vehicles
from augment.formats.scenarionet.unpickling import read_pickle
from augment.scene.entities import AgentType

EGO = [0.4, -0.1, 8.0, 0.0, 0.0, 4.6, 1.9]
AHEAD = [20.0, 3.5, -3.0, 4.0, math.pi, 4.4, 1.8]
PADDING = [0.0] * 7
STATE = np.zeros((190, 10))


class AgentType_(int):
    """Stands for a member of LCTGen's own enumeration: pickled by its class and number."""

    def __reduce__(self) -> Any:
        return AgentType_, (1,)


def tracks_pickle(path: Path, *rows: list[float]) -> Path:
    """As `save_as_metadrive_data` writes: a state of x, y, z, l, w, h, heading, vx, vy, valid."""
    tracks = {}
    for number, (x, y, vx, vy, heading, length, width) in enumerate(rows):
        state = STATE.copy()
        state[:] = [x, y, 0.0, length, width, 0.0, heading, vx, vy, 1.0]
        tracks[number] = {"type": AgentType_(1), "state": state}
    written = pickle.dumps({"id": "fake", "sdc_index": 0, "tracks": tracks, "map": {}}, protocol=3)
    ours = f"c{__name__}\nAgentType_\n".encode()
    path.write_bytes(written.replace(ours, b"ctrafficgen.utils.typedef\nAgentType\n"))
    return path


def check_ahead(document: object) -> None:
    modification, notes = read_vehicles(document)
    (vehicle,) = modification.added
    assert (vehicle.type, vehicle.x_m, vehicle.y_m) == (AgentType.VEHICLE, 20.0, 3.5)
    assert vehicle.heading_rad == pytest.approx(math.pi)
    assert (vehicle.length_m, vehicle.width_m, vehicle.speed_mps) == (4.4, 1.8, 5.0)
    assert (modification.moved, modification.removed) == ((), ())
    assert len(notes) == 1


def test_agents_and_tracks_mean_the_same(tmp_path: Path) -> None:
    rows = np.array([EGO, AHEAD, PADDING])
    np.savez(tmp_path / "a.npz", agent=rows)
    check_ahead(read_arrays(tmp_path / "a.npz"))
    check_ahead({"agent": [[*row, 1.0] for row in rows.tolist()]})
    check_ahead(read_pickle(tracks_pickle(tmp_path / "a.pkl", EGO, AHEAD)))


def test_what_is_not_said_is_noted() -> None:
    sizeless = [*AHEAD[:5], 0.0, 1.8]
    modification, notes = read_vehicles({"agent": [[3.0, 4.0, *EGO[2:]], sizeless]})
    assert modification.added[0].length_m == 4.8
    assert notes[1:] == (
        "Its ego, 5.00 m from the scene's, is left out.",
        "1 vehicles without a size got the usual one.",
    )


def test_a_type_that_is_no_vehicle_is_noted() -> None:
    rows = [[*EGO, 1.0], [*AHEAD, 2.0], [*AHEAD, 1.0], [*PADDING, 0.0]]
    modification, notes = read_vehicles({"agent": rows})
    assert [vehicle.type for vehicle in modification.added] == [AgentType.VEHICLE] * 2
    assert notes[1:] == ("A type other than 1 was left out: a vehicle as all.",)


@pytest.mark.parametrize("odd", [[math.nan] * 7, ["x"] * 7, [1e9] * 7, [1.0], "car", {}])
def test_one_that_is_no_vehicle_costs_no_other(odd: object) -> None:
    modification, notes = read_vehicles({"agent": [EGO, odd, AHEAD]})
    assert [vehicle.x_m for vehicle in modification.added] == [20.0]
    assert "left out: vehicles (1); first vehicles[1]" in notes[1]


def test_what_is_no_generated_scene_is_refused() -> None:
    for document, reason in (
        ({}, "expected LCTGen's `agent` or `tracks`"),
        ([], "expected LCTGen's `agent` or `tracks`"),
        ({"agent": [[1.0, 2.0]]}, "the ego, .* needs 7 numbers a row"),
        ({"agent": [[float("nan"), *EGO[1:]]]}, r"the ego, .* needs finite numbers"),
        ({"tracks": {0: {"state": STATE}}}, "is the ego, and is not there at t0"),
        ({"tracks": {0: {"state": STATE[:0]}}}, "is the ego, and is not there at t0"),
        ({"tracks": {0: {}}}, r"is the ego, .*vehicles\[0\]\.state: needs an array"),
        ({"tracks": {0: "car"}}, r"is the ego, .*vehicles\[0\]: needs an array"),
    ):
        with pytest.raises(InvalidDocument, match=reason):
            read_vehicles(document)


def test_arrays_of_objects_are_not_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", agent=np.array([{"x": 1}], dtype=object))
    with pytest.raises(InvalidDocument, match=r"is no \.npz that is read"):
        read_arrays(tmp_path / "a.npz")
