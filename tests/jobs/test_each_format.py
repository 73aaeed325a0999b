"""The main job on a scene of each format: import, instruct, ask the stand-in, draw."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from django.core.files.storage import default_storage

from augment.fake_llm.server import FakeServer, running
from augment.formats.readers import READERS
from augment.llm.client import ChatClient
from augment.llm.openai_wire import OpenAIWire
from augment.models import Augmentation, Endpoint
from augment.scene.codec import intent_from_document, modification_from_document, scene_to_document
from augment.scene.intent import Intent
from augment.scene.lane_graph import LaneGraph
from augment.services.endpoints import contestants
from augment.services.endpoints.known_endpoints import ensure_endpoint
from augment.services.running import jobs, runner
from augment.services.scenarios.scene_imports import import_scene
from augment.services.scenarios.scenes import add_scenario, scene_of
from tests.formats.test_damaged import GOOD
from tests.scenes import junction

pytestmark = pytest.mark.django_db

AHEAD_M = {"av2": 27.0, "commonroad": 20.0}
"""Where something stands in the way at the usual place."""
USUAL_M = 14.0


def intent(ahead_m: float) -> dict[str, Any]:
    spot = {"distance": {"low_m": ahead_m}, "relation": "ahead", "lane": "own"}
    request = {"kind": "vehicles", "count": 1, "speed_mps": 0.0, "spot": spot}
    return {"format": "scenario-arena/intent", "version": 1, "requests": [request]}


def understood(instruction: str) -> Intent:
    """What the sentence of this test asks for."""
    return intent_from_document(intent(float(instruction.split()[3])))


@pytest.fixture(scope="module")
def server() -> Iterator[FakeServer]:
    with running(intents=understood) as serving:
        yield serving


@contextmanager
def opened(endpoint: Endpoint) -> Iterator[ChatClient]:
    with OpenAIWire(base_url=endpoint.base_url, api_key=None) as client:
        yield client


def made(name: str, root: Path) -> Path:
    if name != "json":
        return GOOD[name](root)
    file = root / "scene.json"
    file.write_text(json.dumps(scene_to_document(junction())))  # nobody drives there
    return file


@pytest.mark.parametrize("name", READERS)
def test_the_stand_in_edits_a_scene_of_each_format(
    name: str, server: FakeServer, tmp_path: Path
) -> None:
    ahead_m = AHEAD_M.get(name, USUAL_M)
    recorded = import_scene(path=made(name, tmp_path), slug="recorded")
    assert recorded.source == name
    ensure_endpoint(label="stand-in", base_url=server.url, is_simulated=True)
    contestants.add_contestant(
        slug="stand-in", variant="otm", endpoint="stand-in", model="fake-good"
    )
    for slug, keeps in (("kept", True), ("cleared", False)):
        add_scenario(
            scene="recorded",
            type="nudge_around_parked_vehicle",
            instruction=f"Park a vehicle {ahead_m} m ahead of the ego on its lane.",
            slug=slug,
            intent=intent(ahead_m),
            keep_traffic=keeps,
        )
    job = jobs.launch(name="R", contestants=["stand-in"], scenarios=["kept", "cleared"])
    pictures = set()
    for row in job.augmentations.all():
        assert runner.work_on(augmentation_pk=row.pk, worker="w", connect=opened)
        row.refresh_from_db()
        assert row.state == Augmentation.State.DONE, row.reason
        scene = scene_of(row.scenario)
        graph = LaneGraph(scene)
        assert scene.ego.lane_id is not None
        start = graph.lane(scene.ego.lane_id).centerline.project(0.0, 0.0)
        wanted = graph.along(scene.ego.lane_id, start.s_m, ahead_m)
        assert wanted is not None
        (car,) = modification_from_document(row.modification).added
        assert (car.x_m, car.y_m) == pytest.approx((wanted.pose.x_m, wanted.pose.y_m), abs=0.3)
        assert bool(scene.agents) == (row.scenario.slug == "kept" and name != "json")
        assert default_storage.size(row.image) > 5_000
        pictures.add(row.image)
    assert len(pictures) == (1 if name == "json" else 2), "the picture shows who is kept"
