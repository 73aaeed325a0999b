"""From an invitation to a blind ballot by pages alone: how long that takes a stranger's system."""

import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.browser.chromium import chromium
from tests.browser.hand import Hand
from tests.stack import Home

pytestmark = [pytest.mark.browser, pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(1200)]

OVER_MS = 300_000
MOST_S = 600
TASKS, VOTES = 10, 5
TITLE = "Crashes"
SYSTEM, SLUG_OF_SYSTEM = "Parked by a stranger", "parked-by-a-stranger"
STRANGER = Path(__file__).with_name("stranger.py")


def test_a_strangers_files_are_on_a_blind_ballot_in_ten_minutes(tmp_path: Path) -> None:
    home = Home.at(tmp_path / "h")
    home.folder.mkdir()

    def work(address: str) -> tuple[float, int, int]:
        with chromium() as browser:
            ada = Hand.at(browser, address)
            ada.become_admin(home)
            _publish(ada)
            began = time.monotonic()
            hands = _enter(ada, browser, tmp_path)
            clicks, fields = (sum(getattr(one, what) for one in hands) for what in _COUNTED)
            return time.monotonic() - began, clicks, fields

    with home.serving() as address, ThreadPoolExecutor(1) as pool:
        # Playwright wants a thread without an event loop.
        seconds, clicks, fields = pool.submit(work, address).result()
    print(f"\nentered and voted on in {seconds:.0f} s, {clicks} clicks, {fields} fields")
    assert seconds < MOST_S


_COUNTED = ("clicks", "fields")


def _publish(ada: Hand) -> None:
    """The benchmark, and what the reference makes of its scenarios: both there before."""
    ada.press("Scenarios")
    ada.press("Load the paper set")
    ada.sees("50 added")
    ada.press("Benchmarks")
    ada.press("New benchmark")
    for name, text in (("title", TITLE), ("scenarios", "crash-*")):
        ada.fill(name, text)
    ada.press("Make it")
    expect(ada.page.get_by_role("heading", name=f"{TASKS} tasks")).to_be_visible()
    ada.press("Jobs")
    ada.press("New job")
    ada.fill("name", "References")
    ada.tick_only("contestants", "reference")
    ada.tick_only("types", "avoid_crashed_cars")
    ada.click("[data-launch]")
    ada.sees("Finished", within_ms=OVER_MS)


def _enter(ada: Hand, browser: Browser, folder: Path) -> tuple[Hand, Hand, Hand]:
    enno, grace = (Hand.at(browser, ada.page.url) for _ in range(2))
    ada.press("People")
    ada.fill("username", "enno")
    ada.choose("role", "entrant")
    ada.click("section button.main")
    enno.page.goto(ada.page.locator("#link-1").input_value())
    enno.set_password()
    _submit(enno, folder)
    _accept(ada)
    link = ada.add_expert("grace")
    _open_study(ada)
    grace.page.goto(link)
    grace.press("Accept and start")
    seen: list[str] = []
    grace.page.on("response", lambda answer: seen.append(answer.url))
    grace.vote(VOTES)
    assert SYSTEM.lower() not in grace.page.content().lower()
    assert not [url for url in seen if SLUG_OF_SYSTEM in url]
    return ada, enno, grace


def _submit(enno: Hand, folder: Path) -> None:
    """Download, let the stranger's program run, send what it wrote."""
    handed_out, answers = folder / "benchmark.zip", folder / "answers.zip"
    enno.press(f"{TITLE}, version 1")
    with enno.page.expect_download() as download:
        enno.click("a[href$='/file/']")
    download.value.save_as(handed_out)
    # Isolated: no module of ours can be imported.
    command = [sys.executable, "-I", str(STRANGER), str(handed_out), str(answers)]
    subprocess.run(command, check=True, cwd=folder)
    enno.press("Submissions")
    enno.press("New submission")
    enno.send(answers)
    expect(enno.page.locator("[data-chosen] output")).to_contain_text("answers.zip")
    enno.press("Send it")
    enno.sees(f"{TASKS} of {TASKS} read", within_ms=OVER_MS)
    enno.sees("An admin decides next")


def _accept(ada: Hand) -> None:
    ada.press("Home")
    ada.press("See them")
    ada.press(SYSTEM)
    ada.press("Accept")
    ada.sees("Finished", within_ms=OVER_MS)


def _open_study(ada: Hand) -> None:
    ada.press("Studies")
    ada.press("New study")
    ada.fill("name", "First study")
    ada.tick_only("contestants", "reference", SLUG_OF_SYSTEM)
    ada.fill("votes_per_expert", str(VOTES))
    ada.sees(f"{VOTES} from each of 1 expert")
    ada.press("Open the study")
    expect(ada.page.get_by_role("heading", name="First study")).to_be_visible()
