"""From an empty installation to a table in LaTeX: in how many clicks."""

import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.browser.chromium import chromium
from tests.browser.hand import Hand
from tests.formats.av2_logs import write_log
from tests.processes import ROOT
from tests.stack import Home

pytestmark = [pytest.mark.browser, pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(600)]


OVER_MS = 300_000


@pytest.fixture
def home(tmp_path: Path) -> Home:
    made = Home.at(tmp_path / "h")
    made.folder.mkdir()
    return made


def _as_ada(home: Home, work: Callable[[Hand, Browser], str]) -> Hand:
    """The admin after all of the work, which ends at a table."""

    def all_of_it(address: str) -> tuple[Hand, str]:
        with chromium() as browser:
            ada = Hand.at(browser, address)
            ada.become_admin(home)
            return ada, work(ada, browser)

    with home.serving() as address, ThreadPoolExecutor(1) as pool:
        # Playwright wants a thread without an event loop.
        ada, table = pool.submit(all_of_it, address).result()
    assert r"\toprule" in table
    assert "Reference" in table
    return ada


def test_two_contestants_on_the_catalogue(home: Home) -> None:
    def work(ada: Hand, browser: Browser) -> str:
        ada.press("Scenarios")
        ada.press("Load the paper set")
        ada.sees("50 added")
        _run_job(ada)
        return _study(ada, browser, votes=5)

    ada = _as_ada(home, work)
    assert ada.clicks <= 25
    assert ada.fields <= 12


@contextmanager
def stand_in_process(home: Home) -> Iterator[str]:
    """The address of a stand-in server that knows the scenarios of a home."""
    command = [sys.executable, "manage.py", "fake_llm", "--port", "0"]
    with subprocess.Popen(
        command, cwd=ROOT, env=home.environment, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().split()[-1]
        finally:
            process.terminate()


def test_a_model_in_four_variants_on_a_recording(home: Home, tmp_path: Path) -> None:
    write_log(tmp_path / "log")
    packed = Path(shutil.make_archive(str(tmp_path / "log"), "zip", tmp_path, "log"))

    def work(ada: Hand, browser: Browser) -> str:
        ada.press("Use mine")
        ada.fill("base_url", address)
        ada.press("Add the endpoint")
        expect(ada.page.locator("#listed-models option[value=fake-good]")).to_be_attached()
        ada.fill("model", "fake-good")
        ada.press("Add and probe it")
        ada.sees("It sees pictures", within_ms=OVER_MS)
        _draw_on_a_recording(ada, packed)
        ada.press("next: choose contestants")
        ada.press("Add them")
        ada.press("next: launch a job")
        ada.fill("name", "Round 1")
        ada.click("[data-launch]")
        ada.sees("Finished", within_ms=OVER_MS)
        return _study(ada, browser, votes=1)

    with stand_in_process(home) as address:
        ada = _as_ada(home, work)
    assert ada.clicks <= 24
    assert ada.fields <= 8


def _draw_on_a_recording(ada: Hand, packed: Path) -> None:
    """A car, placed 15 m ahead of the ego by a click."""
    ada.press("next: make scenarios")
    ada.send(packed)
    ada.press("Use this moment")
    expect(ada.page.get_by_role("heading", name="log")).to_be_visible()
    ada.page.wait_for_load_state("networkidle")
    ada.press("Place by a click")
    ada.click_scene(15, 0.5)
    ada.press("Save the scenario")
    expect(ada.page.locator("img[src*='/pictures/reference/']")).to_be_visible()


def _run_job(ada: Hand) -> None:
    ada.press("Jobs")
    ada.press("New job")
    ada.fill("name", "Round 1")
    ada.tick_only("contestants", "reference", "quantised-5m")
    ada.click("[data-launch]")
    ada.sees("Finished", within_ms=OVER_MS)


def _study(ada: Hand, browser: Browser, *, votes: int) -> str:
    link = ada.add_expert("grace")
    ada.press("Studies")
    ada.press("New study")
    ada.fill("name", "First study")
    ada.fill("votes_per_expert", str(votes))
    ada.sees(f"{votes} from each of 1 expert")
    ada.press("Open the study")
    expect(ada.page.get_by_role("heading", name="First study")).to_be_visible()
    grace = Hand.at(browser, ada.page.url)
    grace.page.goto(link)
    grace.press("Accept and start")
    grace.vote(votes)
    ada.page.reload()
    return ada.close_and_export()
