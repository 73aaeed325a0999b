"""What the source of a scene left open stands on the page of its scenarios."""

import pytest

from tests.jobs.rows import add_scenario
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def test_a_note_of_the_scene_stands_on_the_page_as_a_sentence() -> None:
    earlier = {"kind": "objects_left_out", "number": 2, "names": ["<b>vegetation</b>"]}
    scenario = add_scenario("street")
    scenario.base_scene.notes = ["No lights.", earlier]
    scenario.base_scene.save()
    answer = signed_in(people()["admin"]).get(f"/scenarios/{scenario.code}/")
    page = answer.content.decode().partition("<dt>Left open by the source</dt>")[2]
    assert "<li>No lights.</li>" in page
    assert "Objects left out: 2, &lt;b&gt;vegetation" in page, "what a file says is text"
