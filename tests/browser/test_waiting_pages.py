"""Pages that wait for workers show themselves anew and lose nothing of what is done on them."""

import time
from pathlib import Path

import pytest
from django.urls import reverse
from playwright.sync_api import Page, Route, expect
from pytest_django import Settings

from arena.models import BenchmarkFile
from arena.scenarios.exports.benchmarks import BENCHMARK_FILES
from augment.models import BaseScene, SceneUpload
from augment.services.benchmarks.benchmarks import BenchmarkRequest, make_benchmark
from augment.services.scenarios.pictures import draw_scene
from tests.browser.booth import Booth
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
