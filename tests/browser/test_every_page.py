"""Every page of the site, once each in one browser: axe, and a phone's width."""

from collections.abc import Callable

import pytest
from django.urls import reverse
from playwright.sync_api import BrowserContext, ConsoleMessage, Page, Route

from tests.browser.booth import PHONE, Booth, ready
from tests.browser.test_voting_page import faults
from tests.web.every_page import ShownPage, pages_of_a_rated_study, pages_of_an_open_study

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True), pytest.mark.slow]
OPENED = """() => {
  for (const one of document.querySelectorAll("details")) one.open = true;
  for (const one of document.querySelectorAll("[data-findings]"))
    one.innerHTML = "<li>A finding</li>".repeat(99);
}"""
SCROLLED = {"runOnly": {"type": "rule", "values": ["scrollable-region-focusable"]}}
TOO_WIDE = "document.documentElement.scrollWidth - document.documentElement.clientWidth"


@pytest.mark.parametrize("pages", [pages_of_an_open_study, pages_of_a_rated_study])
def test_axe_finds_nothing_and_nothing_is_wider_than_a_phone(
    bare_booth: Booth, pages: Callable[[], list[ShownPage]]
) -> None:
    shown = pages()
    wrong: dict[str, list[str]] = {}
    by_user: dict[str, BrowserContext] = {}
    for one in shown:
        told: list[ConsoleMessage] = []
        page = _tab(bare_booth, by_user, one, told)
        found = faults(page) + [line.text for line in told if "Permissions-Policy" in line.text]
        page.set_viewport_size(PHONE)
        if beyond := page.evaluate(TOO_WIDE):
            found.append(f"{beyond} px wider than a phone")
        page.evaluate(OPENED)
        found += faults(page, SCROLLED)
        if found:
            wrong[f"{one.name} for {one.user.username}"] = found
        page.close()
    assert not wrong, "\n".join(f"{name}: {found}" for name, found in wrong.items())


def _tab(
    booth: Booth, by_user: dict[str, BrowserContext], one: ShownPage, told: list[ConsoleMessage]
) -> Page:
    """A tab of its own, that stays where it is even if it would look again by itself."""
    who = one.user.username
    if who not in by_user:
        how = {"bypass_csp": True, "reduced_motion": "reduce"}
        by_user[who] = booth.visit(who, reverse("healthz"), how).context
    page = by_user[who].new_page()
    page.on("console", lambda line: told.append(line))
    page.goto(one.url)
    if page.locator("#answers").count():
        # The pair fades until it takes an answer.
        ready(page)
    page.route("**/*", _stay)
    return page


def _stay(route: Route) -> None:
    if route.request.is_navigation_request():
        route.abort()
    else:
        route.continue_()
