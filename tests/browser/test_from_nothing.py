"""From an empty database to a rated table in LaTeX, without a shell.

The model is the stand-in, which runs in this process; its endpoint is entered on a page.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from augment.fake_llm.server import FakeServer, running
from tests.browser.booth import DESK, ready
from tests.browser.chromium import PATIENCE_MS, chromium
from tests.intents import intents
from tests.processes import wait_until
from tests.stack import Home

pytestmark = [
    pytest.mark.browser,
    pytest.mark.redis,
    pytest.mark.slow,
    pytest.mark.timeout(600),
]

PASSWORD = "nine lives of a cat"
VOTES = 6


@pytest.fixture
def model() -> Iterator[FakeServer]:
    with running(intents=intents) as serving:
        yield serving


def test_an_empty_house_ends_at_a_table(model: FakeServer, tmp_path: Path) -> None:
    home = Home.at(tmp_path / "h")
    home.folder.mkdir()
    with home.serving() as address, ThreadPoolExecutor(1) as pool:
        # Playwright wants a thread without an event loop.
        table = pool.submit(_work, home, address, model.url).result()
    assert r"\toprule" in table
    for name in ("Reference", "Rule placer", "fake-careless"):
        assert name in table


def _work(home: Home, address: str, model: str) -> str:
    with chromium() as browser:
        admin = _page(browser)
        _become_admin(admin, home, address)
        admin.goto(f"{address}/scenarios/")
        admin.click("button[value=paper]")
        expect(admin.get_by_text("50 added")).to_be_visible()
        _enter_contestant(admin, address, model)
        _run_job(admin, address)
        link = _invite(admin, address)
        study = _open_study(admin, address)
        _vote(browser, link)
        return _rate(admin, study)


def _page(browser: Browser) -> Page:
    page = browser.new_context(viewport=DESK).new_page()
    page.set_default_timeout(PATIENCE_MS)
    return page


def _become_admin(page: Page, home: Home, address: str) -> None:
    def printed() -> list[str]:
        return re.findall(r"/first/\S+", (home.folder / "serve.log").read_text())

    wait_until(lambda: bool(printed()), what="the link of the first admin is printed")
    page.goto(address + printed()[0])
    page.fill("[name=username]", "ada")
    _set_password(page)
    expect(page.get_by_role("heading", name="Overview")).to_be_visible()


def _set_password(page: Page) -> None:
    page.fill("[name=new_password1]", PASSWORD)
    page.fill("[name=new_password2]", PASSWORD)
    page.click("button.main")


def _enter_contestant(page: Page, address: str, model: str) -> None:
    page.goto(f"{address}/contestants/new/")
    given = {
        "slug": "careless-otm",
        "model": "fake-careless",
        "label": "stand-in",
        "base_url": model,
    }
    for name, value in given.items():
        page.fill(f"[name={name}]", value)
    page.select_option("[name=variant]", "otm")
    page.check("[name=is_simulated]")
    page.click("button.main.big")
    expect(page.locator("p.mono", has_text="careless-otm")).to_be_visible()


def _run_job(page: Page, address: str) -> None:
    page.goto(f"{address}/jobs/new/")
    page.fill("[name=name]", "Round 1")
    _choose(page)
    page.click("[data-launch]")
    expect(page.get_by_text("Finished").first).to_be_visible(timeout=240_000)


def _choose(page: Page) -> None:
    for slug in ("reference", "rule-placer", "careless-otm"):
        page.check(f"[name=contestants][value={slug}]")
    page.locator("[name=types][value=nudge_around_parked_vehicle]").check()


def _invite(page: Page, address: str) -> str:
    page.goto(f"{address}/people/")
    page.fill("[name=username]", "grace")
    page.click("section button.main")
    return page.locator("#link").input_value()


def _open_study(page: Page, address: str) -> str:
    page.goto(f"{address}/studies/new/")
    page.fill("[name=name]", "First study")
    page.check("[name=experts][value=grace]")
    _choose(page)
    page.fill("[name=votes_per_expert]", str(VOTES))
    for name in ("repeats", "checks"):
        page.fill(f"[name={name}]", "0")
    page.check("[name=allow_simulated]")
    page.click("button.main.big")
    page.click("button[name=sure]")
    expect(page.get_by_role("heading", name="First study")).to_be_visible()
    return re.sub(r"(/studies/[^/]+/).*", r"\1", page.url)


def _vote(browser: Browser, link: str) -> None:
    page = _page(browser)
    page.goto(link)
    _set_password(page)
    page.click("a[href*='/vote/']")
    for number in range(VOTES):
        expect(page.locator("#place")).to_have_text(str(number + 1))
        ready(page)
        page.keyboard.press(str(number % 3 + 1))
    page.get_by_role("heading", name="You are done.").wait_for()


def _rate(page: Page, study: str) -> str:
    page.goto(f"{study}close/")
    page.click("button[name=sure]")
    page.goto(f"{study}results/")
    page.get_by_text("Rate", exact=True).click()
    page.get_by_role("button", name="Rate now").click()
    expect(page.get_by_role("table").first).to_be_visible()
    answer = page.request.get(f"{study}results.latex")
    assert answer.ok
    return answer.text()
