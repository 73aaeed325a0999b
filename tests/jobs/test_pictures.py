from __future__ import annotations

import hashlib
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from django.core.files.storage import default_storage
from pytest_django import Settings

from augment.scene.entities import Modification
from augment.services.scenarios.pictures import camera_of, original_picture, picture_of, store
from augment.services.scenarios.scenes import scene_of
from tests.jobs.rows import add_scenario

NAME = f"bev/{hashlib.sha256(b'png').hexdigest()}.png"
WORKERS = 4


def read(name: str) -> bytes:
    with default_storage.open(name) as file:
        return bytes(file.read())


def test_workers_with_the_same_picture_never_meet_half_of_it(
    settings: Settings, tmp_path: Path
) -> None:
    settings.MEDIA_ROOT = tmp_path
    for number in range(20):
        png = bytes([number]) * 3_000_000
        together = threading.Barrier(WORKERS)

        def store_and_read(
            _: int, png: bytes = png, together: threading.Barrier = together
        ) -> bool:
            together.wait()
            return read(store(png)) == png

        with ThreadPoolExecutor(WORKERS) as pool:
            assert all(pool.map(store_and_read, range(WORKERS)))
    assert len(default_storage.listdir("bev")[1]) == 20, "nothing else is left behind"


@pytest.mark.django_db
def test_the_original_picture_is_drawn_once_and_remembered() -> None:
    scenario = add_scenario("street")
    name = original_picture(scenario)
    assert read(name).startswith(b"\x89PNG")
    scenario.refresh_from_db()
    assert scenario.original_image == name
    assert name == picture_of(scene_of(scenario), Modification(), camera_of(scenario))
    assert original_picture(scenario) == name
