"""Pages that wait for workers, an invitation that is accepted, and a board without a network."""

import time
from pathlib import Path

import pytest
from django.contrib.auth.models import User
from django.urls import reverse
from playwright.sync_api import Browser, Page, Route, expect
from pytest_django import Settings

from arena.models import BenchmarkFile
from arena.people.links import invite
from arena.results.exports.board_files import board_folder, write_folder
from arena.scenarios.exports.benchmarks import BENCHMARK_FILES
from augment.models import BaseScene, SceneUpload
from augment.services.benchmarks.benchmarks import BenchmarkRequest, make_benchmark
from augment.services.scenarios.pictures import draw_scene
from tests.board_rows import a_batch, a_board, newcomer, published, voted
from tests.browser.booth import PHONE, TOO_WIDE, Booth
from tests.browser.chromium import PATIENCE_MS
from tests.browser.test_voting_page import faults
from tests.jobs.rows import add_scenario
from tests.scenes import scene
from tests.services.test_benchmarks import add_street
from tests.web.cast import people

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


SLOW_S = 2
"""Longer than a person who has been here before needs to choose a file."""


@pytest.fixture
def scenes_page(bare_booth: Booth) -> Page:
    """A page that waits for the picture of its only scene."""
    people()
    add_scenario("street", scene=scene(), reference=None)
    return bare_booth.visit("the-researcher", reverse("scenes"), {})


def _after_a_while(route: Route) -> None:
    time.sleep(SLOW_S)
    route.continue_()


def _send(page: Page, tmp_path: Path) -> None:
    file = tmp_path / "drive.json"
    file.write_text("{}")
    with page.expect_response(f"**{reverse('scene-send')}"):
        page.set_input_files("[name=file]", file)
    assert SceneUpload.objects.get().name == "drive.json"


def test_a_file_that_is_chosen_before_the_script_is_there_is_sent(
    scenes_page: Page, tmp_path: Path
) -> None:
    scenes_page.route("**/drop*.js", _after_a_while)
    scenes_page.reload(wait_until="commit")
    _send(scenes_page, tmp_path)


def test_a_picture_appears_on_the_page_that_waits_for_it(scenes_page: Page) -> None:
    scenes_page.evaluate("isTheSamePage = true")
    expect(scenes_page.locator("#live img")).to_have_count(0)
    draw_scene(BaseScene.objects.get().pk)
    expect(scenes_page.locator("#live img")).to_have_count(1)
    expect(scenes_page.locator("#live[data-live]")).to_have_count(0)
    assert scenes_page.evaluate("isTheSamePage")


def test_what_was_said_of_a_start_makes_room_for_what_came_of_it(
    scenes_page: Page, settings: Settings, tmp_path: Path
) -> None:
    settings.MEDIA_ROOT = tmp_path
    add_street(1)
    row = make_benchmark(BenchmarkRequest(slug="s", title="Streets", scenarios=["street-*"]))
    scenes_page.goto(reverse("benchmark", args=[row.code]))
    scenes_page.get_by_role("button", name="Write it").click()
    expect(scenes_page.locator(".messages li").first).to_be_visible()
    BENCHMARK_FILES.perform(BenchmarkFile.objects.get().pk)
    expect(scenes_page.get_by_role("link", name="s-1.zip")).to_be_visible()
    expect(scenes_page.locator(".messages li")).to_have_count(0)


def test_the_button_of_an_invitation_leads_to_the_first_pair(booth: Booth) -> None:
    token = invite(study=booth.study, expert=User.objects.get(username="eva")).token
    context = booth.browser.new_context(base_url=booth.address, locale="de-DE")
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    page.goto(reverse("invitation", args=[token]))
    expect(page.get_by_role("heading", name="Sie sind eingeladen")).to_be_visible()
    page.get_by_role("button", name="Annehmen und beginnen").click()
    page.wait_for_url(f"**{reverse('vote', args=[booth.study.code])}")
    expect(page.get_by_role("button", name="A ist besser")).to_be_visible()
    context.close()


@pytest.mark.slow
def test_the_folder_opens_from_a_disk_with_the_network_off(
    browser: Browser, tmp_path: Path
) -> None:
    board = a_board()
    published(board, 1)
    newcomer("dot")
    voted(a_batch(board, "dot"), seed=2)
    published(board, 2)
    write_folder(board_folder(board), tmp_path / "site")
    context = browser.new_context(offline=True, viewport=PHONE, reduced_motion="reduce")
    page, asked = context.new_page(), list[str]()
    page.on("request", lambda request: asked.append(request.url))
    page.goto((tmp_path / "site" / "index.html").as_uri())
    assert page.locator("table.standings tbody tr").count() == 4
    assert page.locator("img").evaluate("image => image.naturalWidth") > 0
    assert page.evaluate(TOO_WIDE) <= 0
    assert faults(page) == []
    page.get_by_role("link", name="Table 1 of").click()
    assert page.locator("table.standings tbody tr").count() == 3
    assert all(address.startswith("file:///") for address in asked)
    assert not any("<script" in page.read_text() for page in (tmp_path / "site").glob("*.html"))
    context.close()
