"""What every log has in common, however it was read."""

from typing import Any

import numpy as np
import pytest

from augment.formats.reading import Log, speeds
from augment.formats.road_map import RoadMap
from augment.scene.entities import AgentType
from augment.scene.recording import Track


def test_no_speed_is_taken_over_a_gap() -> None:
    times_s = np.array([0.0, 0.1, 0.2, 5.0, 5.1])
    x_m = np.array([0.0, 1.0, 2.0, 90.0, 90.5])
    found = speeds(times_s, np.column_stack([x_m, np.zeros(5)]))
    assert found == pytest.approx([10.0, 10.0, 10.0, 5.0, 5.0])


@pytest.mark.parametrize(
    ("kind", "speed_mps"), [(AgentType.TRAFFIC_CONE, 0.0), (AgentType.VEHICLE, 0.4)]
)
def test_cones_never_move_however_their_boxes_jitter(kind: AgentType, speed_mps: float) -> None:
    jittering = Track(
        agent_id="a", type=kind, length_m=0.4, width_m=0.4, states=np.array([[5.0, 0.0, 0.0, 0.4]])
    )
    rest: dict[str, Any] = {
        "world": "world", "title": "log", "licence": "none", "ego_size_m": (4.8, 2.0),
        "map_at": lambda _: RoadMap(place="map", segments=()),
    }  # fmt: skip
    log = Log(times_s=np.zeros(1), ego=np.zeros((1, 4)), tracks=(jittering,), **rest)
    found = log.reading_at(0, "a")
    assert [agent.speed_mps for agent in found.scene.agents] == [speed_mps]
