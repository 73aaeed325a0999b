"""Pairs that move are voted on by keys alone: both sides in step, within a few hundred kB."""

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, expect
from pytest_django.live_server_helper import LiveServer

from tests.browser.booth import Booth, press, ready
from tests.moving import a_moving_study

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]
MOST_BYTES = 300_000

WATCH = """() => {
    window.firsts = [];
    let pressed = 0;
    addEventListener("keydown", () => { pressed = performance.now(); }, true);
    const look = () => {
        for (const canvas of document.querySelectorAll("canvas.reel:not([hidden])")) {
            if (!canvas.seen && pressed) firsts.push(performance.now() - pressed);
            canvas.seen = true;
        }
        requestAnimationFrame(look);
    };
    look();
}"""
"""Notes how long after a key a film's canvas is in a frame."""

PLACES = """() => [...document.querySelectorAll("canvas.reel")].map((canvas) => canvas.hidden)"""


@pytest.fixture
def moving(live_server: LiveServer, browser: Browser) -> Iterator[Booth]:
    made = Booth(
        address=live_server.url, browser=browser, study=a_moving_study(scenarios=3, votes=9)
    )
    yield made
    made.leave()


@pytest.mark.slow
def test_thirty_moving_pairs_by_keys(live_server: LiveServer, browser: Browser) -> None:
    booth = Booth(
        address=live_server.url, browser=browser, study=a_moving_study(scenarios=10, votes=30)
    )
    page = booth.visit("eva", "about:blank", {})
    sizes: dict[str, int] = {}
    page.on("response", lambda answer: note(answer, sizes))
    page.goto(booth.path)
    ready(page)
    page.evaluate(WATCH)
    for number in range(29):
        expect(page.locator("canvas.reel:not([hidden])")).to_have_count(2)
        press(page, "123"[number % 3])
    page.keyboard.press("1")
    expect(page.get_by_role("heading", name="You are done.")).to_be_visible()
    all_cast = booth.outcomes()
    assert all_cast == [("left", "equal", "right")[n % 3] for n in range(29)] + ["left"]
    print(sum(sizes.values()) / 30, "bytes a pair")
    assert sum(sizes.values()) / 30 <= MOST_BYTES
    booth.leave()


def note(answer: Any, sizes: dict[str, int]) -> None:
    if "/i/" in answer.url:
        sizes[answer.url] = int(answer.headers.get("content-length", 0))
