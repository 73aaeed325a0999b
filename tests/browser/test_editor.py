"""The page on which changes are drawn, its server played by the test: who answers when."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

import pytest
from django.contrib.staticfiles import finders
from django.urls import reverse
from playwright.sync_api import Browser, Page, Request, Route, expect

from augment.services.scenarios.scene_pictures import draw_scene
from tests.browser.booth import DESK
from tests.browser.chromium import PATIENCE_MS
from tests.jobs.rows import add_scenario
from tests.scenes import scene
from tests.web.cast import people, signed_in

pytestmark = [pytest.mark.browser, pytest.mark.django_db]
SITE = "http://editor.test"
LATER_MS = 1_000
"""Longer than the page waits before it asks what a change is worth."""


@dataclass(slots=True, kw_only=True)
class Desk:
    """The page, and the checks that wait for their answers."""

    page: Page
    waiting: list[Route] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)

    def asked(self, number: int) -> dict[str, Any]:
        """What the check of that number was asked about; the page may have yet to ask it."""
        for _ in range(PATIENCE_MS // 20):
            if len(self.waiting) > number:
                break
            self.page.wait_for_timeout(20)
        found = self.waiting[number].request.post_data_json
        assert isinstance(found, dict)
        return found

    def answer(self, number: int, *, problem: str = "", y_m: float | None = None) -> None:
        """With a problem, or the change as it was sent, its objects moved aside."""
        change = self.asked(number)["modification"]
        if y_m is not None:
            change = change | {"add": [agent | {"y_m": y_m} for agent in change["add"]]}
        given = {"modification": change, "lines": [], "problem": problem}
        self.waiting[number].fulfill(json=given)

    def place_ahead(self) -> None:
        """A car, whose first check is answered."""
        self.answer(0)
        self.page.get_by_role("button", name="Place ahead").click()
        self.page.clock.run_for(LATER_MS)
        self.answer(1)

    def snap(self) -> None:
        self.page.get_by_role("button", name="Onto the centreline").click()

    def type_in(self, text: str) -> None:
        self.page.locator("summary", has_text="As JSON").click()
        self.page.fill("[name=modification]", text)
        self.page.locator("[name=modification]").blur()

    @property
    def y_m(self) -> float:
        return float(self.page.input_value("#n-y"))


@pytest.fixture
def desk(browser: Browser) -> Iterator[Desk]:
    scenario = add_scenario("street", scene=scene(), reference=None)
    draw_scene(scenario.base_scene_id)
    where = reverse("reference-edit", args=[scenario.code])
    html = signed_in(people()["analyst"]).get(where).content
    context = browser.new_context(viewport=DESK, base_url=SITE)
    context.set_default_timeout(PATIENCE_MS)
    made = Desk(page=context.new_page())
    made.page.on("pageerror", lambda error: made.errors.append(str(error)))
    made.page.clock.install()
    context.route("**/*", _server(html, made))
    made.page.goto(where)
    yield made
    context.close()
    assert made.errors == []


def _server(html: bytes, desk: Desk) -> Callable[[Route, Request], None]:
    def serve(route: Route, request: Request) -> None:
        path = urlsplit(request.url).path
        if path.startswith("/static/"):
            found = finders.find(path.removeprefix("/static/"))
            assert isinstance(found, str)
            route.fulfill(path=found)
        elif request.method == "POST":
            desk.waiting.append(route)
        elif request.resource_type == "document":
            route.fulfill(body=html, content_type="text/html")
        else:
            route.fulfill(status=404)

    return serve


def test_an_answer_never_undoes_what_was_done_after_its_question(desk: Desk) -> None:
    desk.place_ahead()
    desk.snap()
    assert desk.asked(2)["snap"] == "Added1"
    desk.page.locator("svg.stage").press("Shift+ArrowUp")
    desk.answer(2, y_m=-7.0)
    desk.page.clock.run_for(LATER_MS)
    assert desk.asked(3)["modification"]["add"][0]["y_m"] == 1.0
    assert desk.y_m == 1.0


def test_a_snap_right_after_a_change_is_not_lost(desk: Desk) -> None:
    desk.place_ahead()
    desk.page.locator("svg.stage").press("Shift+ArrowUp")
    desk.snap()
    desk.page.clock.run_for(LATER_MS)
    assert desk.asked(2)["snap"] == "Added1"
    desk.answer(2, y_m=0.0)
    expect(desk.page.locator("#n-y")).to_have_value("0")
    assert len(desk.waiting) == 3


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
    desk.waiting[2].fulfill(json={"modification": None, "lines": [], "problem": "not so"})
    expect(desk.page.locator("[data-findings]")).to_contain_text("not so")
    assert desk.page.input_value("[name=modification]") == json.dumps(change)
    desk.page.locator("svg.stage").press("Shift+ArrowUp")
    assert desk.y_m == 1.0


def test_an_unknown_class_is_shown_by_its_name(desk: Desk) -> None:
    desk.answer(0)
    size = {"length_m": 4, "width_m": 2}
    tram = {"id": "T", "type": 'a "tram"', "x_m": 9, "y_m": 0, "heading_rad": 0, **size}
    desk.type_in(json.dumps({"add": [tram]}))
    expect(desk.page.locator("[data-list]")).to_contain_text('a "tram"')
