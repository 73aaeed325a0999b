"""A recording that comes by a page: kept, read by a worker, drawn, kept as a scene."""

import zipfile
from io import BytesIO
from pathlib import Path

import pytest
from django.contrib.auth.models import User
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage

from augment.errors import InvalidDocument
from augment.models import BaseScene, Event, SceneUpload, UploadMoment
from augment.services.scenarios import uploads
from augment.services.scenarios.scene_imports import note_sentences
from tests.formats.av2_logs import write_log
from tests.formats.openscenario_files import CAR, ROADS, catalog, scenario
from tests.formats.test_archive import folder_as_zip

pytestmark = pytest.mark.django_db


@pytest.fixture
def log(tmp_path: Path) -> bytes:
    return folder_as_zip(tmp_path / "log.zip", write_log(tmp_path / "log")).read_bytes()


def sent(content: bytes, name: str = "log.zip", source: str = "") -> SceneUpload:
    return uploads.keep_upload(name=name, content=ContentFile(content), source=source)


def read(row: SceneUpload) -> SceneUpload:
    uploads.UPLOADS.perform(row.pk)
    row.refresh_from_db()
    return row


def looked_at(row: SceneUpload, frame: int) -> UploadMoment:
    moment = uploads.ask_for_moment(row, item="", frame=frame)
    uploads.MOMENTS.perform(moment.pk)
    moment.refresh_from_db()
    return moment


def test_a_zip_of_a_log_becomes_a_scene_at_the_moment_that_was_chosen(log: bytes) -> None:
    ada = User.objects.create_user("ada")
    row = read(sent(log))
    assert (row.state, row.format, row.reason) == ("read", "av2", "")
    assert [stop["frame"] for stop in row.tracks[0]["stops"]] == [0]  # 0.4 s of recording
    row.tracks[0]["stops"].append({"item": "", "frame": 2, "time_s": 0.2})
    row.save()
    moment = looked_at(row, 2)
    assert (moment.state, moment.reason) == ("drawn", "")
    # A second message finds nothing to do.
    assert not uploads.MOMENTS.perform(moment.pk)
    assert not uploads.UPLOADS.perform(row.pk)
    assert uploads.ask_for_moment(row, item="", frame=2) == moment
    with default_storage.open(moment.picture) as picture:
        assert picture.read(4) == b"\x89PNG"
    assert (moment.report["lanes"], moment.report["recorded_s"]) == (5, 0.2)
    assert any("limit" in note for note in note_sentences(moment.report["notes"]))
    uploads.ask_for_moment(row, item="", frame=2, slug="by-the-page", actor=ada)
    uploads.MOMENTS.perform(moment.pk)
    moment.refresh_from_db()
    kept = BaseScene.objects.get(slug="by-the-page")
    assert (moment.state, moment.scene) == ("kept", kept)
    assert len(kept.recording["times_s"]) == 3
    assert "step 2 of 5" in kept.provenance
    event = Event.objects.get(verb="import")
    assert (event.actor, event.after["frame"]) == (ada, 2)


def test_a_long_recording_offers_its_start(log: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uploads, "EVERY_S", 0.1)
    monkeypatch.setattr(uploads, "MOST_STOPS", 3)
    row = read(sent(log))
    assert [stop["frame"] for stop in row.tracks[0]["stops"]] == [0, 1, 2]
    assert row.is_cut
    states = row.moments.order_by("frame").values_list("frame", "state")
    assert list(states) == [(0, "drawn"), (1, "queued"), (2, "queued")]


def test_what_can_not_be_read_leaves_no_scene() -> None:
    for content, name, reason in (
        (b"hello", "notes.txt", "none of the formats"),
        (b"PK\x03\x04 and nothing", "log.zip", "is broken"),
        (b"{}", "scene.json", "none of the formats"),
        (b'{"format": "scenario-arena/scene"', "scene.json", "scene.json"),
    ):
        row = read(sent(content, name))
        assert (row.state, row.tracks) == ("failed", [])
        assert reason in row.reason
        assert not BaseScene.objects.exists()


def test_the_same_scene_is_kept_once_and_a_taken_name_says_so(log: bytes) -> None:
    BaseScene.objects.create(slug="taken", document={}, source="json", provenance="here")
    row = read(sent(log))
    moment = looked_at(row, 0)
    uploads.ask_for_moment(row, item="", frame=0, slug="taken")
    uploads.MOMENTS.perform(moment.pk)
    moment.refresh_from_db()
    assert moment.state == "drawn"
    assert "called 'taken' already" in moment.reason
    with pytest.raises(InvalidDocument, match="slug"):
        uploads.ask_for_moment(row, item="", frame=0, slug="Not A Slug")
    for slug in ("first", "second"):
        moment.state = "drawn"
        moment.save()
        uploads.ask_for_moment(row, item="", frame=0, slug=slug)
        uploads.MOMENTS.perform(moment.pk)
        moment.refresh_from_db()
        assert moment.scene.slug == "first"


def test_a_name_is_kept_in_plain_letters() -> None:
    for given, kept in (
        ("../../etc/passwd", "passwd"),
        ("a b/ü?.json", "json"),
        ("C:\\logs\\my log.zip", "my-log.zip"),
        ("...", "file"),
        ("x" * 200 + ".json", "x" * 60 + "x" * 35 + ".json"),
    ):
        assert uploads.plain_name(given) == kept


def test_a_zip_of_a_scenario_with_map_and_catalog_offers_each_ego() -> None:
    refers = '<CatalogReference catalogName="Cars" entryName="car"/>'
    files = {
        "pack/xosc/made.xosc": scenario(other=refers, logic="../xodr/roads.xodr"),
        "pack/xosc/Catalogs/cars.xosc": catalog(CAR),
        "pack/xodr/roads.xodr": ROADS,
    }
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w") as made:
        for name, text in files.items():
            made.writestr(name, text)
    row = read(sent(packed.getvalue(), "scenario.zip"))
    assert (row.state, row.format, row.reason) == ("read", "openscenario", "")
    assert [track["name"] for track in row.tracks] == ["Ego", "Other"]
    moment = uploads.ask_for_moment(row, item="Other", frame=0, slug="by-the-other")
    uploads.MOMENTS.perform(moment.pk)
    scene = BaseScene.objects.get(slug="by-the-other")
    assert scene.source_item == "Other"
    assert [agent["speed_mps"] for agent in scene.document["agents"]] == [10.0]
