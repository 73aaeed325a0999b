"""The checks that MetaDrive makes before it takes a scenario, in our own words.

Re-implemented from the published `ScenarioDescription.sanity_check` (MetaDrive, main of 2026),
with `check_self_type` and `valid_check` on; nothing of the receiver is installed.
"""

import io
import pickle
from typing import Any

import numpy as np

FIRST_LEVEL = {
    "id", "version", "length", "metadata", "tracks", "dynamic_map_states", "map_features"
}  # fmt: skip
METADATA = {"metadrive_processed", "coordinate", "ts"}
OBJECT_TYPES = {
    *("VEHICLE", "PEDESTRIAN", "CYCLIST", "OTHER"),
    *("TRAFFIC_LIGHT", "TRAFFIC_BARRIER", "TRAFFIC_CONE", "TRAFFIC_OBJECT"),
}
LANE_KINDS = ("SURFACE_STREET", "SURFACE_UNSTRUCTURE", "UNKNOWN", "BIKE_LANE", "FREEWAY")
PLAIN = (int, float, str, bool, np.ndarray, dict, list, tuple, type(None), set)
OLD_NAMES = {
    ("numpy.core.multiarray", "_reconstruct"): ("numpy._core.multiarray", "_reconstruct"),
    ("numpy", "ndarray"): ("numpy", "ndarray"),
    ("numpy", "dtype"): ("numpy", "dtype"),
}


class _OldStack(pickle.Unpickler):
    """Knows what an old stack knows, by the names that it knows them by."""

    def find_class(self, module: str, name: str) -> Any:
        assert (module, name) in OLD_NAMES, f"{module}.{name} is not known to older stacks"
        return super().find_class(*OLD_NAMES[module, name])


def loaded(content: bytes) -> Any:
    return _OldStack(io.BytesIO(content)).load()


def check_sanity(scenario: Any) -> None:
    assert type(scenario) is dict
    assert set(scenario) >= FIRST_LEVEL
    _check_plain(scenario)
    length = scenario["length"]
    for name, thing in (scenario["tracks"] | scenario["dynamic_map_states"]).items():
        _check_object(name, thing, length)
    assert all({"position", "heading"} <= set(one["state"]) for one in scenario["tracks"].values())
    for feature in scenario["map_features"].values():
        if feature["type"].removeprefix("LANE_") in LANE_KINDS:
            assert isinstance(feature["polyline"], np.ndarray | list | tuple)
    assert set(scenario["metadata"]) >= METADATA
    assert scenario["metadata"]["ts"].shape == (length,)


def _check_plain(value: Any) -> None:
    assert isinstance(value, PLAIN), type(value)
    assert not isinstance(value, np.generic), type(value)
    if isinstance(value, dict):
        for key, item in value.items():
            _check_plain(key)
            _check_plain(item)
    elif isinstance(value, list | tuple | set):
        for item in value:
            _check_plain(item)


def _check_object(name: str, thing: Any, length: int) -> None:
    assert {"type", "state", "metadata"} <= set(thing)
    assert thing["type"] in OBJECT_TYPES
    assert thing["metadata"]["object_id"] == name
    assert "type" in thing["metadata"]
    for key, values in thing["state"].items():
        assert len(values) == length
        if not isinstance(values, np.ndarray):
            continue
        assert values.ndim == 1 or (values.ndim == 2 and values.shape[1] != 0)
        if "valid" not in thing["state"]:
            continue
        if key == "valid":
            assert values.sum() >= 1
        gone = ~thing["state"]["valid"].astype(bool)
        shown = values[..., :2] if key == "position" else values
        assert abs(shown[gone].sum()) < 1e-2, f"{name}: {key} where it is not valid"
