"""The whole round of a job by its pages: tried, launched, paused, resumed, retried, seen."""

import threading
from typing import Any

from playwright.sync_api import Page, expect

from tests.processes import wait_until

OVER_MS = 240_000
SCENARIOS = 6
CONTESTANTS = ("reference", "rule-placer", "careless-otm")
BROKE = "otm|stand-in|fake-quota"
ROWS = SCENARIOS * (len(CONTESTANTS) + 1)


def run_round(page: Page, gate: threading.Event) -> None:
    """A job of all contestants and a model that always fails; it ends at its transcript.

    Args:
        page: An admin's.
        gate: While it is closed, the model that works gives no answer.
    """
    _try_one(page)
    gate.clear()
    _launch_all(page)
    _pause(page, gate)
    _resume(page)
    _retry(page)
    _duplicate(page)


def _try_one(page: Page) -> None:
    page.goto("/jobs/new/")
    page.fill("[name=name]", "Round 1")
    page.get_by_text("Advanced").click()
    page.check(f"[name=cells][value='{BROKE}']")
    page.uncheck("[name=contestants][value=quantised-5m]")
    page.click("button[name=try]")
    expect(page.get_by_role("heading", name="Round 1, first try")).to_be_visible()
    _ends_in_part(page)
    expect(page.locator("a.cell")).to_have_count(len(CONTESTANTS) + 1)


def _launch_all(page: Page) -> None:
    page.click("#full")
    expect(page.locator("[name=name]")).to_have_value("Round 1")
    expect(page.locator("[name=scenarios]:checked")).to_have_count(SCENARIOS)
    expect(page.get_by_text("Cost expected")).to_be_visible()
    page.click("[data-launch]")
    expect(page.get_by_role("heading", name="Round 1", exact=True)).to_be_visible()


def _pause(page: Page, gate: threading.Event) -> None:
    """What is in flight ends; what waits at that moment goes on waiting."""
    page.click("#pause")
    expect(page.get_by_text("Paused: nothing new is started")).to_be_visible()
    gate.set()
    address = page.locator("#live").get_attribute("data-progress")

    def progress() -> dict[str, Any]:
        found: dict[str, Any] = page.request.get(str(address)).json()
        return found

    wait_until(lambda: not progress()["by_state"].get("running"), what="what is in flight ends")
    left = progress()
    assert left["state"] == "paused"
    assert left["by_state"]["queued"] > 0, "the gate kept it from ending"
    assert left["settled"] + left["by_state"]["queued"] == left["total"] == ROWS


def _resume(page: Page) -> None:
    page.click("#go-on")
    _ends_in_part(page)
    expect(page.get_by_text(f"{ROWS} of {ROWS} settled").first).to_be_visible()


def _retry(page: Page) -> None:
    page.get_by_role("link", name="Failures").click()
    expect(page.locator("#causes summary b").first).to_have_text(str(SCENARIOS))
    page.get_by_role("button", name=f"Retry {SCENARIOS} failed").click()
    expect(page.get_by_text("What failed is queued again.")).to_be_visible()
    _ends_in_part(page)
    expect(page.locator("a.cell img").first).to_be_visible()
    page.locator("a.cell", has_text="Failed").first.click()
    expect(page.get_by_text("Attempt 2.")).to_be_visible()
    page.go_back()


def _duplicate(page: Page) -> None:
    page.click("#duplicate")
    expect(page.locator("[name=name]")).to_have_value("Round 1 (2)")
    expect(page.locator("[name=contestants]:checked")).to_have_count(len(CONTESTANTS) + 1)
    expect(page.locator("[name=scenarios]:checked")).to_have_count(SCENARIOS)


def _ends_in_part(page: Page) -> None:
    badge = page.locator(".head .badge", has_text="Finished in part")
    expect(badge).to_be_visible(timeout=OVER_MS)
