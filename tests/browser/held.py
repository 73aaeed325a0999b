"""A page of ours in a browser, its server played by the test: who is answered when."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from django.contrib.staticfiles import finders
from playwright.sync_api import Browser, Page, Request, Route

from tests.browser.booth import DESK
from tests.browser.chromium import PATIENCE_MS

SITE = "http://held.test"
_LOOK_MS = 20


@dataclass(slots=True, kw_only=True)
class Held:
    """The page, and what it posted, which waits for its answers.

    Attributes:
        errors: What its scripts did not catch.
    """

    page: Page
    posted: list[Route] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)

    def post(self, number: int) -> Route:
        """What was posted as that number; the page may have yet to do so."""
        for _ in range(PATIENCE_MS // _LOOK_MS):
            if len(self.posted) > number:
                break
            self.page.wait_for_timeout(_LOOK_MS)
        return self.posted[number]


@contextmanager
def hold(browser: Browser, path: str, html: bytes) -> Iterator[Held]:
    """A page at a path, its clock in the test's hands; what it fetches are static files alone.

    The page must not have failed in the end.
    """
    context = browser.new_context(viewport=DESK, base_url=SITE)
    context.set_default_timeout(PATIENCE_MS)
    made = Held(page=context.new_page())
    made.page.on("pageerror", lambda error: made.errors.append(str(error)))
    made.page.clock.install()

    def serve(route: Route, request: Request) -> None:
        asked = urlsplit(request.url).path
        if asked.startswith("/static/"):
            found = finders.find(asked.removeprefix("/static/"))
            assert isinstance(found, str)
            route.fulfill(path=found)
        elif request.method == "POST":
            made.posted.append(route)
        elif request.resource_type == "document":
            route.fulfill(body=html, content_type="text/html")
        else:
            route.fulfill(status=404)

    context.route("**/*", serve)
    made.page.goto(path)
    try:
        yield made
    finally:
        context.close()
    assert made.errors == []
