"""What the source of a scene left open stands on the page of its scenarios."""

import re

import pytest

from augment.scene.recording import Note, SceneNoteKind, notes_to_document
from tests.jobs.rows import add_scenario
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

TOLD = (
    Note(kind=SceneNoteKind.SOME_SPEED_LIMITS, number=3, of=8),
    Note(kind=SceneNoteKind.FAR_PARTS_LEFT_OUT, number=4, value=150.0),
    Note(kind=SceneNoteKind.OBJECTS_LEFT_OUT, number=2, names=("building", "<b>vegetation</b>")),
    Note(kind=SceneNoteKind.NON_COMMERCIAL, names=("CC BY-NC-SA 4.0",)),
)


def notes_on_page(notes: tuple[Note, ...]) -> list[str]:
    scenario = add_scenario("street")
    scenario.base_scene.notes = notes_to_document(notes)
    scenario.base_scene.save()
    answer = signed_in(people()["admin"]).get(f"/scenarios/{scenario.code}/")
    page = answer.content.decode()
    found = re.search(r"<dt>Left open by the source</dt><dd><ul>(.*?)</ul>", page)
    return [] if found is None else re.findall(r"<li>(.*?)</li>", found[1])


def test_every_note_of_the_scene_stands_there_as_a_sentence() -> None:
    limits, far, objects, licence = notes_on_page(TOLD)
    assert limits.startswith("3 of 8 lanes have no speed limit")
    assert far == ("Parts of the map and objects more than 150 m from the ego were left out.")
    assert "building" in objects
    assert "&lt;b&gt;vegetation" in objects  # what a file says is text, never markup
    assert "CC BY-NC-SA 4.0" in licence
