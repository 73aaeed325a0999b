"""Sending a recording and choosing its moment, page by page; workers run in this process."""

import json
from tempfile import gettempdir

import pytest
from django.conf import LazySettings
from django.core.files.uploadedfile import SimpleUploadedFile
from django.test import Client
from django.urls import reverse

from augment.models import BaseScene, SceneUpload, UploadMoment
from augment.scene.codec import scene_to_document
from augment.services.scenarios import pictures, uploads
from tests.formats.openscenario_files import ROADS
from tests.jobs.rows import add_scenario
from tests.scenes import scene, vehicle
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db
STREET = json.dumps(scene_to_document(scene(agents=(vehicle("Agent2", 20.0, 0.0),)))).encode()


@pytest.fixture
def researcher() -> Client:
    return signed_in(people()["researcher"])


@pytest.fixture(autouse=True)
def working(monkeypatch: pytest.MonkeyPatch, django_capture_on_commit_callbacks: object) -> None:
    """What is sent to a worker is done at once."""
    monkeypatch.setattr("arena.scenarios.pages.uploads.enqueue_upload", uploads.UPLOADS.perform)
    monkeypatch.setattr("arena.scenarios.pages.uploads.enqueue_moment", uploads.MOMENTS.perform)
    for page in ("uploads", "editor"):
        monkeypatch.setattr(f"arena.scenarios.pages.{page}.enqueue_scene", pictures.draw_scene)
    monkeypatch.setattr("arena.shell.acts.transaction.on_commit", lambda done: done())


def send(client: Client, content: bytes = STREET, name: str = "street.json") -> str:
    file = SimpleUploadedFile(name, content)
    answer = client.post(reverse("scene-send"), {"file": file, "format": ""}, follow=True)
    return answer.content.decode()


def is_picture(client: Client, address: str) -> bool:
    answer = client.get(address)
    return b"".join(answer).startswith(b"\x89PNG")


def test_from_a_file_to_a_scene(researcher: Client) -> None:
    shown = send(researcher)
    moment = UploadMoment.objects.get()
    picture = reverse("picture", args=["moment", moment.code])
    assert picture in shown
    assert is_picture(researcher, picture)
    again = reverse("upload-show", args=[moment.upload.code])
    assert picture in researcher.post(again, {"stop": "0"}, follow=True).content.decode()
    assert "no such moment" in researcher.post(again, {"stop": "1"}, follow=True).content.decode()
    answer = researcher.post(
        again, {"stop": "0", "keep": "1", "name": "Hauptstraße Süd"}, follow=True
    )
    scene_row = BaseScene.objects.get()
    page = reverse("scene", args=[scene_row.code])
    assert (scene_row.slug, answer.redirect_chain[-1][0]) == ("hauptstrae-sud", page)
    for view in ("kept", "backdrop"):
        assert is_picture(researcher, reverse("picture", args=[view, scene_row.code]))
    assert "picture" in researcher.get(page).content.decode()


def test_the_ego_of_a_map_is_put_where_somebody_clicks(
    researcher: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = send(researcher, ROADS.encode(), "roads.xodr")
    upload = SceneUpload.objects.get()
    (moment,) = upload.moments.exclude(report=None)
    assert moment.report is not None
    # 240 by 180 m of the road in 1200 by 900 pixels; the ego stands at s = 200, in lane 1.
    assert ('id="places"' in shown, moment.item) == (True, "@1,1,200")
    form = shown.partition('name="place"')[0].rpartition("<form")[2]
    assert "keep" not in form, "what Enter in that field would press first"
    rows = moment.report["places"]["1,-1"]
    assert [rows[0], rows[-1]] == [[80.0, 1200.0, 432.0], [320.0, 0.0, 432.0]]

    def put(place: str) -> str:
        page = reverse("upload-show", args=[upload.code])
        answer = researcher.post(page, {"put": "1", "place": place}, follow=True)
        return answer.content.decode()

    assert "put on lane -2 of road 1, at s = 300 m" in put("1,-2,300")
    placed = UploadMoment.objects.get(item="@1,-2,300")
    assert (placed.state, placed.report and placed.report["lanes"]) == ("drawn", 3)
    assert 'value="1,-2,300"' in put(" 1,-2,300.0 "), "the same place once more"
    assert UploadMoment.objects.filter(item="@1,-2,300").count() == 1
    assert "unknown &#x27;9&#x27;; known: 1" in put("9,-1,5"), "a worker says so"
    for place in ("here", "1,-1", "1,-1,nan"):
        assert "no place; needs ROAD,LANE,S" in put(place) or "place: " in put(place)
    assert "characters that print" in put("1\0,-1,5")
    assert "too long" in put(f"{'1' * 200},-1,5")
    monkeypatch.setattr(uploads, "MOST_PLACES", upload.moments.count())
    assert "places of this map are drawn already" in put("1,-2,301")
    assert 'value="1,-2,300"' in put("1,-2,300"), "one of them"
    send(researcher)
    upload = SceneUpload.objects.get(name="street.json")
    assert "no map alone" in put("1,-2,300")


def test_several_files_become_uploads_of_their_own(researcher: Client) -> None:
    files = [SimpleUploadedFile("one.json", STREET), SimpleUploadedFile("two.txt", b"hello")]
    shown = researcher.post(reverse("scene-send"), {"file": files}, follow=True).content.decode()
    assert sorted(SceneUpload.objects.values_list("name", "state")) == [
        ("one.json", "read"),
        ("two.txt", "failed"),
    ]
    assert "one.json" in shown


def test_what_can_not_be_read_says_why(researcher: Client) -> None:
    shown = send(researcher, b"hello", "notes.txt")
    assert "Nothing was kept." in shown
    assert gettempdir() not in shown
    assert "none of the formats" in shown


def test_a_file_that_is_too_large_is_not_kept(researcher: Client, settings: LazySettings) -> None:
    settings.UPLOAD_MB = 1
    shown = send(researcher, b" " * 1_000_001)
    assert "files of at most 1 MB" in shown
    assert not SceneUpload.objects.exists()
    cut = {"file": SimpleUploadedFile("cut.json", STREET)}
    page = researcher.post(reverse("scene-send"), cut, headers={"X-Body-Cut": "1"}, follow=True)
    assert "files of at most 1 MB" in page.content.decode(), "the web server dropped the rest"
    assert not SceneUpload.objects.exists()
    assert "Use this moment" in send(researcher, STREET + b" " * (1_000_000 - len(STREET)))


def test_a_page_that_looks_again_asks_for_no_picture_anew(
    researcher: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    row, asked = add_scenario("street", scene=scene()).base_scene, list[int]()
    monkeypatch.setattr("arena.scenarios.pages.uploads.enqueue_scene", asked.append)
    page = reverse("scenes")
    researcher.get(page, headers={"X-Looks-Again": "1"})
    assert asked == []
    researcher.get(page)
    assert asked == [row.pk]
