"""What a person does at a browser, counted: clicks and fields; and the ways every journey goes."""

import re
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Browser, Locator, Page, expect

from tests.browser.booth import DESK, ready
from tests.browser.chromium import PATIENCE_MS
from tests.processes import wait_until
from tests.stack import Home

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

    def tick_only(self, name: str, *values: str) -> None:
        """Change those boxes that are not as they should be."""
        for box in self.page.locator(f"[name={name}]").all():
            if box.is_checked() != (box.get_attribute("value") in values):
                self.click(box)

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

    def vote(self, votes: int) -> None:
        """All pairs of the only study, from the start page on."""
        self.click("a[href*='/vote/']")
        for number in range(votes):
            expect(self.page.locator("#place")).to_have_text(str(number + 1))
            ready(self.page)
            self.page.keyboard.press(str(number % 3 + 1))
        self.page.get_by_role("heading", name="You are done.").wait_for()

    def close_and_export(self) -> str:
        """Return the table in LaTeX, from the page of a study."""
        self.press("Close the study")
        self.click("button[name=sure]")
        self.press("Export")
        with self.page.expect_download() as download:
            self.press("LaTeX")
        return Path(download.value.path()).read_text()
