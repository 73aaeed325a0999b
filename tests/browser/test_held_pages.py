"""Pages whose server is the test: late answers, clicks on a map, rows, double presses."""

import io
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from django.urls import reverse
from PIL import Image
from playwright.sync_api import Browser, FilePayload, Locator, Page, expect

from augment.models import SceneUpload, UploadMoment
from augment.services.scenarios.pictures import draw_scene
from tests.browser.booth import Booth
from tests.browser.held import Held, hold
from tests.entering import a_benchmark, entrant
from tests.jobs.rows import add_scenario
from tests.scenes import scene
from tests.web.cast import people, png, signed_in
from tests.web.test_jobs import large_job

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


@pytest.mark.slow
def test_an_answer_never_undoes_what_was_done_after_its_question(desk: Desk) -> None:
    desk.place_ahead()
    desk.snap()
    assert desk.asked(2)["snap"] == "Added1"
    desk.page.locator("svg.stage").press("Shift+ArrowUp")
    desk.answer(2, y_m=-7.0)
    desk.page.clock.run_for(LATER_MS)
    assert desk.asked(3)["modification"]["add"][0]["y_m"] == 1.0
    assert desk.y_m == 1.0


@pytest.mark.slow
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


@pytest.mark.slow
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


PLACES = {"1,-1": [[10.0, 100.0, 450.0], [12.0, 110.0, 450.0]], "1,1": [[10.0, 100.0, 415.0]]}


def test_a_click_sends_the_nearest_place_and_none_far_from_every_lane(browser: Browser) -> None:
    path = reverse("upload", args=[upload_of("@1,1,50").code])
    html = signed_in(people()["researcher"]).get(path).content
    picture = png(width=1200, height=900)
    with hold(browser, path, html) as held:
        held.page.route(
            "**/pictures/**", lambda route: route.fulfill(body=picture, content_type="image/png")
        )
        held.page.reload()
        shown = held.page.locator("#chosen")
        held.page.wait_for_function("document.getElementById('chosen').naturalWidth === 1200")
        shown.evaluate("image => image.scrollIntoView()")
        box = shown.bounding_box()
        assert box is not None
        for x, y in ((600, 450), (108, 445)):
            scale = box["width"] / 1200
            held.page.mouse.click(box["x"] + x * scale, box["y"] + y * scale)
        sent = parse_qs(held.post(0).request.post_data or "")
        assert (sent["place"], sent["put"]) == (["1,-1,12"], ["1"])
        assert len(held.posted) == 1


@pytest.mark.slow
def test_another_moment_brings_its_own_place(browser: Browser) -> None:
    upload = upload_of("@1,1,50", "@1,-1,10")
    path, researcher = reverse("upload", args=[upload.code]), signed_in(people()["researcher"])
    pages = [
        researcher.get(f"{path}?moment={moment.code}").content.decode()
        for moment in upload.moments.order_by("pk")
    ]
    with hold(browser, path, pages[0].encode()) as held:
        held.page.route("**/*moment=*", lambda route: route.fulfill(body=pages[1]))
        place = held.page.locator("#place")
        expect(place).to_have_value("1,1,50")
        held.page.locator("[name=stop]:not(:checked)").first.check()
        expect(place).to_have_value("1,-1,10")


# --- Private -----------------------------------------------------------------------------------


def upload_of(*items: str) -> SceneUpload:
    """A map of which each place has been drawn."""
    stops = [{"item": item, "frame": 0, "time_s": None} for item in items]
    upload = SceneUpload.objects.create(
        name="roads.xodr",
        size_bytes=1,
        state="read",
        format="opendrive",
        tracks=[{"name": items[0], "stops": stops}],
    )
    for item in items:
        UploadMoment.objects.create(
            upload=upload, item=item, state="drawn", picture="map.png", report={"places": PLACES}
        )
    return upload


ROWS = 9


@pytest.mark.slow
def test_rows_follow_as_one_scrolls(browser: Browser, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("arena.jobs.queries.CELLS", 4)
    job, reader = large_job(scenarios=ROWS, contestants=2), signed_in(people()["researcher"])
    path = reverse("job-tab", args=[job.code, "grid"])
    pages = {f"row={n}": reader.get(f"{path}?row={n}").content for n in range(2, ROWS // 2 + 2)}
    with hold(browser, path, reader.get(path).content) as held:
        page, rows = held.page, held.page.locator(".grid tbody tr")
        assert rows.count() == 2, "what could not be fetched leaves the link"
        page.route(
            "**/grid/?row=*",
            lambda route: route.fulfill(
                body=pages[urlsplit(route.request.url).query], content_type="text/html"
            ),
        )
        page.locator(".frozen").dispatch_event("scroll")
        expect(rows).to_have_count(ROWS)
        expect(page.locator("#more [rel=next]")).to_have_count(0)
        name = rows.nth(5).locator("a.cell").first.get_attribute("id")
        page.locator(f"#{name}").click()
        page.go_back()
        assert page.url.endswith(f"{path}?row=3#{name}")


BETWEEN_MS = 300
"""So much later that the browser itself does not take them for one press."""


def test_a_form_is_sent_once(browser: Browser) -> None:
    path = reverse("api-tokens")
    html = signed_in(people()["admin"]).get(path).content
    with hold(browser, path, html) as held:
        held.page.fill("[name=name]", "mine")
        box = held.page.get_by_role("button", name="Make the token").bounding_box()
        assert box is not None
        for _ in range(3):
            held.page.mouse.click(box["x"] + 5, box["y"] + 5)
            held.page.wait_for_timeout(BETWEEN_MS)
        assert len(held.posted) == 1


def test_a_file_is_named_before_it_is_sent_as_an_answer(browser: Browser) -> None:
    a_benchmark()
    path = reverse("submission-new")
    with hold(browser, path, signed_in(entrant()).get(path).content) as held:
        file = FilePayload(name="answers.zip", mimeType="application/zip", buffer=b"PK")
        held.page.set_input_files("[name=file]", file)
        expect(held.page.locator("[data-chosen] output")).to_have_text("answers.zip, 1 kB")
        assert held.posted == []


# --- A drawing, with the server that answers ---------------------------------------------------

RED = (218, 30, 40)


@pytest.mark.slow
@pytest.mark.django_db(transaction=True)
def test_what_is_drawn_lies_where_it_was_put_and_is_told(bare_booth: Booth) -> None:
    people()
    scenario = add_scenario("street", scene=scene(), reference=None)
    draw_scene(scenario.base_scene_id)
    page = bare_booth.visit("the-researcher", reverse("scenario-edit", args=[scenario.code]), {})
    stage = page.locator("svg.stage")
    expect(stage.locator("image")).to_be_attached()
    page.wait_for_load_state("networkidle")
    _lies_on_the_ego(page, stage)
    # By a click, 15 m ahead: what the numbers then say is where it was clicked.
    page.get_by_role("button", name="Place by a click").click()
    at = stage.evaluate(
        "(svg) => { const p = new DOMPoint(15, 0.5).matrixTransform("
        "svg.getScreenCTM()); return [p.x, p.y]; }"
    )
    page.mouse.click(*at)
    assert float(page.input_value("#n-x_m")) == pytest.approx(15.0, abs=0.1)
    assert float(page.input_value("#n-y_m")) == pytest.approx(-0.5, abs=0.1)
    # By keys and by the server's lane.
    stage.press("Shift+ArrowRight")
    assert float(page.input_value("#n-x_m")) == pytest.approx(16.0, abs=0.1)
    page.get_by_role("button", name="Undo").click()
    assert float(page.input_value("#n-x_m")) == pytest.approx(15.0, abs=0.1)
    page.get_by_role("button", name="Onto the centreline").click()
    expect(page.locator("#n-y_m")).to_have_value(re.compile(r"^-?0(\.0\d*)?$"))
    # By dragging, and by its handle.
    car = stage.locator("[data-agent=Added1]")
    _drag(page, car, dx=40)
    moved = float(page.input_value("#n-x_m"))
    assert moved > 16.0
    _drag(page, stage.locator("[data-handle=turn]"), dy=-60)
    assert float(page.input_value("#n-heading_deg")) > 20.0
    page.fill("#n-heading_deg", "0")
    page.press("#n-heading_deg", "Enter")
    expect(page.locator("[data-findings] li").first).to_be_visible()
    expect(page.locator("[data-statements]")).to_contain_text("in the own lane")


def _lies_on_the_ego(page: Page, stage: Locator) -> None:
    """A box of the ego's size at the ego's place covers the ego of the worker's picture."""
    page.locator("summary", has_text="As JSON").click()
    before = _red(stage)
    ego = {"id": "Added1", "type": "VEHICLE", "x_m": 0, "y_m": 0, "heading_rad": 0}
    size = {"width_m": 2.297, "length_m": 5.176}
    change = {"format": "scenario-arena/modification", "version": 1, "add": [ego | size]}
    field = page.locator("[name=modification]")
    field.fill(json.dumps(change))
    field.blur()
    placed, box = stage.locator("[data-agent=Added1] .body").bounding_box(), stage.bounding_box()
    assert placed is not None
    assert box is not None
    # The arrow of its speed, ahead of it, is red as well.
    front = int(placed["x"] + placed["width"] - box["x"])
    assert before[:, :front].sum() > 1_000
    assert _red(stage)[:, :front].sum() < 0.02 * before[:, :front].sum()
    page.get_by_role("button", name="Undo").click()
    expect(stage.locator("[data-agent=Added1]")).to_have_count(0)


def _red(stage: Locator) -> np.ndarray:
    """Which pixels of the stage are the ego's, (H, W)."""
    seen = np.asarray(Image.open(io.BytesIO(stage.screenshot())).convert("RGB")).astype(int)
    return np.asarray((abs(seen - RED) < 40).all(axis=2))


def _drag(page: Page, what: Locator, *, dx: float = 0.0, dy: float = 0.0) -> None:
    box = what.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + dx, y + dy, steps=4)
    page.mouse.up()
