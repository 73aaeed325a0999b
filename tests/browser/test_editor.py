"""The page on which changes are drawn, and what it makes of answers that come late."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pytest
from django.urls import reverse
from playwright.sync_api import Browser, Page, expect

from augment.services.scenarios.pictures import draw_scene
from tests.browser.held import Held, hold
from tests.jobs.rows import add_scenario
from tests.scenes import scene
from tests.web.cast import people, signed_in

pytestmark = [pytest.mark.browser, pytest.mark.django_db]
LATER_MS = 1_000
"""Longer than the page waits before it asks what a change is worth."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Desk:
    """The page, and the checks that wait for their answers."""

    held: Held

    @property
    def page(self) -> Page:
        return self.held.page

    def asked(self, number: int) -> dict[str, Any]:
        """What the check of that number was asked about."""
        found = self.held.post(number).request.post_data_json
        assert isinstance(found, dict)
        return found

    def answer(self, number: int, *, problem: str = "", y_m: float | None = None) -> None:
        """With a problem, or the change as it was sent, its objects moved aside."""
        change = self.asked(number)["modification"]
        if y_m is not None:
            change = change | {"add": [agent | {"y_m": y_m} for agent in change["add"]]}
        given = {"modification": change, "lines": [], "problem": problem}
        self.held.posted[number].fulfill(json=given)

    def place_ahead(self) -> None:
        """A car, whose first check is answered."""
        self.answer(0)
        self.page.get_by_role("button", name="Place ahead").click()
        self.page.clock.run_for(LATER_MS)
        self.answer(1)

    def snap(self) -> None:
        self.page.get_by_role("button", name="Onto the centreline").click()

    def type_in(self, text: str) -> None:
        self.page.locator("summary", has_text="The drawing as JSON").click()
        self.page.fill("[name=modification]", text)
        self.page.locator("[name=modification]").blur()

    @property
    def y_m(self) -> float:
        return float(self.page.input_value("#n-y_m"))


@pytest.fixture
def desk(browser: Browser) -> Iterator[Desk]:
    scenario = add_scenario("street", scene=scene(), reference=None)
    draw_scene(scenario.base_scene_id)
    path = reverse("scenario-edit", args=[scenario.code])
    html = signed_in(people()["researcher"]).get(path).content
    with hold(browser, path, html) as held:
        yield Desk(held=held)


def test_an_answer_never_undoes_what_was_done_after_its_question(desk: Desk) -> None:
    desk.place_ahead()
    desk.snap()
    assert desk.asked(2)["snap"] == "Added1"
    desk.page.locator("svg.stage").press("Shift+ArrowUp")
    desk.answer(2, y_m=-7.0)
    desk.page.clock.run_for(LATER_MS)
    assert desk.asked(3)["modification"]["add"][0]["y_m"] == 1.0
    assert desk.y_m == 1.0


def test_a_chosen_motion_is_asked_of_the_server_and_kept_by_later_edits(desk: Desk) -> None:
    desk.place_ahead()
    page = desk.page
    expect(page.locator("#n-within_m")).to_be_hidden()
    page.get_by_text("More of Added1").click()
    page.select_option("#n-preset", "hard_braking")
    wish = {"agent_id": "Added1", "preset": "hard_braking", "within_m": None, "number": None}
    assert desk.asked(2)["preset"] == wish
    change, motion = desk.asked(2)["modification"], {"speeds": [[1.0, 0.0]]}
    moving = change | {"add": [agent | {"motion": motion} for agent in change["add"]]}
    told = {"presets": {"Added1": wish | {"number": 6}}, "ways": {"Added1": [[20, 0], [28, 0]]}}
    desk.held.posted[2].fulfill(json=told | {"modification": moving, "lines": [], "problem": ""})
    expect(page.get_by_label("Brakes with (m/s²)")).to_have_value("6")
    expect(page.locator(".stage .moment")).to_have_count(2)
    page.fill("#n-within_m", "12")
    page.locator("#n-within_m").blur()
    assert desk.asked(3)["preset"] == wish | {"within_m": 12, "number": 6}
    page.locator("svg.stage").press("Shift+ArrowUp")
    page.clock.run_for(LATER_MS)
    assert desk.asked(4)["modification"]["add"][0]["motion"] == motion
    # Who is made to walk has no motion beside it.
    page.fill("#n-walk_x_m", "30")
    page.locator("#n-walk_x_m").blur()
    page.clock.run_for(LATER_MS)
    assert "motion" not in desk.asked(5)["modification"]["add"][0]


@pytest.mark.parametrize(
    "change",
    [
        {"add": 5},
        {"add": [None]},
        {"move": [{"id": "Agent2"}]},
        {"add": [{"id": "A", "x_m": 1, "y_m": 1, "heading_rad": 0, "length_m": "4"}]},
    ],
)
def test_what_is_no_modification_is_told_and_leaves_the_picture(
    desk: Desk, change: dict[str, Any]
) -> None:
    desk.place_ahead()
    desk.type_in(json.dumps(change))
    assert desk.asked(2)["modification"] == change
    desk.held.posted[2].fulfill(json={"modification": None, "lines": [], "problem": "not so"})
    expect(desk.page.locator("[data-findings]")).to_contain_text("not so")
    assert desk.page.input_value("[name=modification]") == json.dumps(change)
    desk.page.locator("svg.stage").press("Shift+ArrowUp")
    assert desk.y_m == 1.0
