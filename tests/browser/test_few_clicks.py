"""From an empty installation to a table in LaTeX: in how many clicks."""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.browser.booth import DESK, ready
from tests.browser.chromium import PATIENCE_MS, chromium
from tests.formats.av2_logs import write_log
from tests.processes import ROOT, wait_until
from tests.stack import Home

pytestmark = [pytest.mark.browser, pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(600)]


OVER_MS = 300_000
PASSWORD = "nine lives of a cat"


@dataclass(slots=True)
class Hand:
    """Acts on a page; an address that is typed or pasted counts as a field."""

    page: Page
    clicks: int = 0
    fields: int = 0

    @classmethod
    def at(cls, browser: Browser, address: str) -> "Hand":
        page = browser.new_context(viewport=DESK, base_url=address).new_page()
        page.set_default_timeout(PATIENCE_MS)
        return cls(page)

    def click(self, what: str | Locator) -> None:
        self.clicks += 1
        (self.page.locator(what) if isinstance(what, str) else what).click()

    def press(self, name: str) -> None:
        """A button or link by what it says."""
        says, page = re.compile(rf"^\s*{re.escape(name)}"), self.page
        found = page.locator("button, a, summary").filter(has_text=says, visible=True)
        self.click(found.first)

    def click_scene(self, x_m: float, y_m: float) -> None:
        """A place on the editor's stage, in its own metres."""
        self.clicks += 1
        self.page.mouse.click(
            *self.page.locator("svg.stage").evaluate(
                """(svg, at) => {
                    const p = new DOMPoint(...at).matrixTransform(svg.getScreenCTM());
                    return [p.x, p.y];
                }""",
                [x_m, y_m],
            )
        )

    def fill(self, name: str, text: str) -> None:
        self.fields += 1
        self.page.fill(f"[name={name}]", text)

    def send(self, file: Path) -> None:
        self.clicks += 1
        self.page.set_input_files("[name=file]", file)

    def sees(self, text: str, *, within_ms: int = PATIENCE_MS) -> None:
        expect(self.page.get_by_text(text).first).to_be_visible(timeout=within_ms)

    def become_admin(self, home: Home) -> None:
        """By the link that a new installation prints."""

        def printed() -> list[str]:
            return re.findall(r"/first/\S+", (home.folder / "serve.log").read_text())

        wait_until(lambda: bool(printed()), what="the link of the first admin is printed")
        self.page.goto(printed()[0])
        self.fill("username", "ada")
        self.fill("password", PASSWORD)
        self.click("button.main")
        expect(self.page.get_by_role("heading", name="First steps")).to_be_visible()

    def add_expert(self, username: str) -> str:
        """Return the link that signs them in."""
        self.press("People")
        self.fill("username", username)
        self.click("section button.main")
        return self.page.locator("#link-1").input_value()

    def close_and_export(self) -> str:
        """Return the table in LaTeX, from the page of a study."""
        self.press("Close the study")
        self.click("button[name=sure]")
        self.press("Export")
        with self.page.expect_download() as download:
            self.press("LaTeX")
        return Path(download.value.path()).read_text()


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


def test_a_model_in_four_variants_on_a_recording(tmp_path: Path) -> None:
    home = Home.at(tmp_path / "h")
    home.folder.mkdir()
    write_log(tmp_path / "log")
    packed = Path(shutil.make_archive(str(tmp_path / "log"), "zip", tmp_path, "log"))

    def work(address: str, model: str) -> tuple[Hand, str]:
        with chromium() as browser:
            ada = Hand.at(browser, address)
            ada.become_admin(home)
            _enter_model(ada, model)
            _draw_on_a_recording(ada, packed)
            ada.press("next: choose contestants")
            ada.press("Add them")
            ada.press("next: launch a job")
            ada.fill("name", "Round 1")
            ada.click("[data-launch]")
            ada.sees("Finished", within_ms=OVER_MS)
            return ada, _study(ada, browser)

    with home.serving() as address, stand_in_process(home) as model, ThreadPoolExecutor(1) as pool:
        # Playwright wants a thread without an event loop.
        ada, table = pool.submit(work, address, model).result()
    assert r"\toprule" in table
    assert "Reference" in table
    assert ada.clicks <= 24
    assert ada.fields <= 8


def _enter_model(ada: Hand, address: str) -> None:
    ada.press("Use mine")
    ada.fill("base_url", address)
    ada.press("Add the endpoint")
    expect(ada.page.locator("#listed-models option[value=fake-good]")).to_be_attached()
    ada.fill("model", "fake-good")
    ada.press("Add and probe it")
    ada.sees("It sees pictures", within_ms=OVER_MS)


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


def _study(ada: Hand, browser: Browser) -> str:
    link = ada.add_expert("grace")
    ada.press("Studies")
    ada.press("New study")
    ada.fill("name", "First study")
    ada.fill("votes_per_expert", "1")
    ada.sees("1 from each of 1 expert")
    ada.press("Open the study")
    expect(ada.page.get_by_role("heading", name="First study")).to_be_visible()
    grace = Hand.at(browser, ada.page.url)
    grace.page.goto(link)
    grace.press("Accept and start")
    grace.click("a[href*='/vote/']")
    ready(grace.page)
    grace.page.keyboard.press("1")
    grace.page.get_by_role("heading", name="You are done.").wait_for()
    ada.page.reload()
    return ada.close_and_export()
