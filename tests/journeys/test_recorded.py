"""The main job on a recorded log: import, instruct, generate by real workers, find the car."""

import json
from pathlib import Path

import pytest

from augment.scene.codec import modification_from_document, scene_from_document
from augment.scene.lane_graph import LaneGraph
from tests.processes import machine

pytestmark = [pytest.mark.realdata, pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(600)]
INSTRUCTION = (
    "add a parked vehicle in front of ego at about 21.4 m, slightly towards the left lane boundary"
)

INTENT = {
    "format": "scenario-arena/intent",
    "version": 1,
    "requests": [
        {
            "kind": "vehicles",
            "count": 1,
            "speed_mps": 0.0,
            "spot": {
                "distance": {"low_m": 21.4},
                "relation": "ahead",
                "lane": "own",
                "lateral": {"target": "left lane boundary", "nearness": "slightly"},
            },
        }
    ],
}
"""What the instruction asks for, as somebody would enter it."""


def test_the_car_stands_where_the_sentence_says_on_the_real_road(
    realdata: Path, migrated: Path, tmp_path: Path
) -> None:
    (log,) = (realdata / "av2_sensor").iterdir()
    intent = tmp_path / "intent.json"
    intent.write_text(json.dumps(INTENT))
    with machine(database=migrated) as place:
        place.must_all(
            ("import_scene", "av2", str(log), "--frame", "0", "--slug", "pittsburgh"),
            (
                *("add_scenario", "--scene", "pittsburgh"),
                *("--type", "nudge_around_parked_vehicle"),
                *("--slug", "parked", "--instruction", INSTRUCTION, "--keep-traffic"),
                *("--intent", str(intent)),
            ),
        )
        redis, worker = place.redis(), place.worker()
        try:
            place.must(
                *("generate", "--contestants", "rule-placer", "--scenarios", "parked", "--wait")
            )
        finally:
            worker.stop()
            redis.stop()
        ((document, image),) = place.rows(
            "SELECT modification, image FROM augment_augmentation WHERE state = 'done'"
        )
        ((scene,),) = place.rows("SELECT document FROM augment_basescene")
        assert (place.media / image).stat().st_size > 10_000
    graph = LaneGraph(scene_from_document(json.loads(scene)))
    (car,) = modification_from_document(json.loads(document)).added
    start = graph.lane("Lane1").centerline.project(0.0, 0.0)
    wanted = graph.along("Lane1", start.s_m, 21.4)
    assert wanted is not None
    assert graph.under(car.x_m, car.y_m, car.heading_rad) == wanted.lane_id
    found = graph.lane(wanted.lane_id).centerline.project(car.x_m, car.y_m)
    assert found.s_m == pytest.approx(wanted.s_m, abs=0.1)
    assert 0.1 < found.d_m <= 1.5  # to the left, within what "slightly" may mean
    assert car.heading_rad == pytest.approx(wanted.pose.heading_rad, abs=0.02)
    assert car.speed_mps == 0.0
