"""A voting booth: pages of one expert, driven as a person would, and the rows that come of it."""

from dataclasses import dataclass, field
from typing import Any

from django.conf import settings
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse
from playwright.sync_api import Browser, BrowserContext, Page, ViewportSize, expect

from arena.models import Matchup, Study, Vote
from augment.models import Augmentation
from augment.services.scenarios.pictures import store
from tests import study_rows
from tests.browser.chromium import PATIENCE_MS
from tests.web.cast import png

DESK = ViewportSize(width=1280, height=720)
PHONE = ViewportSize(width=390, height=844)
VIEW = {"px_per_m": 20.0, "ego_px": [300.0, 150.0], "width": 1200, "height": 300}
BOUNCE_MS = 210
"""A press sooner than this after a pair appeared is ignored, as the second of a double one."""

TOO_WIDE = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
"""How many pixels of a page are beyond its window."""

HERE = {"locale": "en-GB", "timezone_id": "UTC"}
"""Where the browser says that it is."""

HAS_LOADED = """tokens => {
    const loaded = performance.getEntriesByType("resource").map(({ name }) => name);
    return tokens.every((token) => loaded.some((name) => name.endsWith(`/i/${token}`)));
}"""


def furnish(*, scenarios: int = 6, votes: int = 9) -> Study:
    """An open study of three contestants with one expert, eva."""
    return hang(study_rows.a_study(scenarios=scenarios, votes_per_expert=votes, experts=("eva",)))


def hang(study: Study) -> Study:
    """Small pictures for all of a study, in the shape of the window that its plan names."""
    for number, augmentation in enumerate(Augmentation.objects.order_by("pk")):
        study_rows.hang(augmentation, store(png(number % 256, width=4, height=1)))
    study.matchups.update(original_image=store(png(255, width=4, height=1)), view=VIEW)
    return study


@dataclass(slots=True, kw_only=True)
class Booth:
    """Where eva votes."""

    address: str
    browser: Browser
    study: Study
    contexts: list[BrowserContext] = field(default_factory=list)

    def enter(self, **how: Any) -> Page:
        """A page of a browser that is signed in, a pair on it; `how` goes to the browser."""
        page = self.visit("eva", self.path, how)
        ready(page)
        return page

    def visit(self, who: str, path: str, how: dict[str, Any]) -> Page:
        """Any page, by whoever has that name."""
        context = self.browser.new_context(
            base_url=self.address, **{"viewport": DESK, **HERE, **how}
        )
        context.set_default_timeout(PATIENCE_MS)
        self.contexts.append(context)
        client = Client()
        client.force_login(User.objects.get(username=who))
        cookie = client.cookies[settings.SESSION_COOKIE_NAME].value
        context.add_cookies(
            [{"name": settings.SESSION_COOKIE_NAME, "value": cookie, "url": self.address}]
        )
        page = context.new_page()
        page.goto(path)
        return page

    @property
    def path(self) -> str:
        return reverse("vote", args=[self.study.code])

    def look_ahead(self, page: Page, *, pairs: int = 5) -> None:
        """Wait until the pair on the screen and those that follow it can be shown and flipped.

        The scene before the edit is asked for last, when both pictures of its pair are decoded.
        """
        first = int(page.inner_text("#place"))
        ahead = Matchup.objects.filter(
            study=self.study, expert__username="eva", position__range=(first, first + pairs - 1)
        )
        tokens = list(ahead.values_list("original_token", flat=True))
        page.wait_for_function(HAS_LOADED, arg=tokens)

    def votes(self) -> list[Vote]:
        """What counts, by position."""
        rows = Vote.objects.filter(matchup__study=self.study, superseded_by=None)
        return list(rows.select_related("matchup").order_by("matchup__position"))

    def outcomes(self) -> list[str]:
        return [vote.outcome for vote in self.votes()]

    def leave(self) -> None:
        for context in self.contexts:
            context.close()


def ready(page: Page) -> None:
    """Wait until the pair on the screen takes an answer."""
    page.wait_for_selector("body.is-live #vote:not([inert]) #answers:not([inert])")
    let_bounce(page)


def let_bounce(page: Page) -> None:
    """Wait until a press counts for the pair on the screen.

    The page counts from the frame that painted the pair, and on a busy machine that frame may come
    long after the answers were let free.
    """
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    page.wait_for_timeout(BOUNCE_MS)


def press(page: Page, key: str) -> None:
    """Vote by a key and wait until the next pair takes an answer."""
    here = page.inner_text("#place")
    page.keyboard.press(key)
    expect(page.locator("#place")).not_to_have_text(here)
    ready(page)


def all_sent(page: Page, saved: int) -> None:
    expect(page.locator("#saved")).to_have_text(f"Saved {saved}. Nothing waiting.")
