"""Pages of many pictures show small ones, which are made once and kept where pictures are."""

import io
from collections.abc import Iterator
from datetime import timedelta
from typing import Any

import pytest
from botocore.client import BaseClient
from django.core.files.storage import default_storage
from django.test import Client
from django.urls import reverse
from django.utils import timezone
from PIL import Image, UnidentifiedImageError
from pytest_django import Settings

from arena.config.env import read_media
from augment.render.bev import draw
from augment.render.camera import Camera, camera_for
from augment.render.canvas import shrink_png
from augment.scene.entities import Modification
from augment.services.judging import compute_once, delete_computed
from augment.services.scenarios.pictures import store
from augment.services.scenarios.thumbnails import find_box, shrink
from tests import scenes
from tests.buckets import Bucket, bucket
from tests.jobs.rows import add_scenario
from tests.web.cast import png


@pytest.fixture(scope="module")
def picture() -> bytes:
    scene = scenes.junction()
    return draw(scene, Modification(), camera_for(scene, None))


@pytest.fixture
def there(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bucket]:
    with bucket() as there:
        for name, value in there.environment.items():
            monkeypatch.setenv(name, value)
        media = read_media(there.environment["ARENA_MEDIA_URL"])
        settings.STORAGES = {**settings.STORAGES, "default": media}
        yield there


def read(name: str) -> bytes:
    with default_storage.open(name) as file:
        return bytes(file.read())


def test_a_thumbnail_is_made_once(picture: bytes) -> None:
    name = store(picture)
    small = shrink(name, 400)
    assert read(small) == shrink_png(picture, 400)
    default_storage.delete(name)
    assert shrink(name, 400) == small
    assert shrink(name, 800) == ""


def test_thumbnails_lie_in_a_bucket_whose_old_charts_are_found_by_one_request(
    picture: bytes, there: Bucket, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = shrink(store(picture), 400)
    assert read(small) == shrink_png(picture, 400)
    assert f"arena/{small}" in there.names()
    asked: list[str] = []
    ask: Any = BaseClient._make_api_call

    def note(client: BaseClient, operation: str, values: object) -> Any:
        asked.append(operation)
        return ask(client, operation, values)

    for number in range(3):
        compute_once("svg", bytes, number)
    monkeypatch.setattr(BaseClient, "_make_api_call", note)
    delete_computed(before=timezone.now() - timedelta(days=1))
    delete_computed(before=timezone.now() + timedelta(days=1))
    assert asked == [*2 * ["ListObjects"], *3 * ["DeleteObject"]]
    assert [name.split("/")[1] for name in there.names()] == ["bev", "thumbnails"]


@pytest.mark.django_db
def test_pages_ask_for_the_width_that_they_show(picture: bytes, researcher: Client) -> None:
    scenario = add_scenario("street")
    scenario.original_image = store(picture)
    scenario.save()
    address = reverse("picture", args=["original", scenario.code])
    sizes = {
        query: Image.open(io.BytesIO(b"".join(researcher.get(address + query)))).width
        for query in ("", "?v=1", "?width=400&v=1", "?width=800")
    }
    assert sizes == {"": 2400, "?v=1": 2400, "?width=400&v=1": 400, "?width=800": 800}
    for query in ("?width=2400", "?width=-1", "?width=400.0", "?width=x"):
        assert researcher.get(address + query).status_code == 404
    shown = researcher.get(reverse("scenarios")).content.decode()
    assert f"{address}?width=400&amp;v={scenario.original_image[-16:-4]} 400w" in shown


@pytest.mark.parametrize(
    ("x_m", "y_m", "box"),
    [
        (30.0, 0.0, (0.595, 0.29, 0.805, 0.71)),  # 6 m about the car, three wide as two high
        (59.0, 0.0, (0.79, 0.29, 1.0, 0.71)),  # at the right edge
        (30.0, 12.0, (0.595, 0.0, 0.805, 0.42)),  # and at the upper one
    ],
)
def test_a_thumbnail_of_a_change_lies_about_it_within_the_picture(
    x_m: float, y_m: float, box: tuple[float, ...]
) -> None:
    """The window is 120 m x 40 m with the ego 54 m from its left edge."""
    camera = Camera(x_min_m=-54, x_max_m=66, y_min_m=-20, y_max_m=20, px_per_m=10)
    assert find_box([scenes.vehicle("Added1", x_m, y_m)], camera) == box


def test_a_picture_of_very_many_pixels_is_refused_unread() -> None:
    with pytest.raises(ValueError, match="a picture of 8000 x 8000 pixels"):
        shrink_png(png(width=8_000, height=8_000), 400)


def test_nothing_but_a_png_is_opened() -> None:
    """Pillow hands PostScript to another program."""
    stream = io.BytesIO()
    Image.new("RGB", (8, 8)).save(stream, "EPS")
    with pytest.raises(UnidentifiedImageError):
        shrink_png(stream.getvalue(), 400)
