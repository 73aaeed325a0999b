"""What a page of voting weighs: the scripts and styles that a real Chromium loads for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from urllib.parse import urlsplit

from playwright.sync_api import Page, Response

from bench.rivals.label_studio.server import EMAIL, PASSWORD, Studio
from bench.rivals.ours import Arena
from tests.browser.chromium import chromium


@dataclass(frozen=True, slots=True, kw_only=True)
class Weight:
    """Bytes of scripts and styles as the browser runs them, uncompressed, and how many files."""

    scripts: int
    styles: int
    files: int

    @property
    def kb(self) -> float:
        return (self.scripts + self.styles) / 1000


def weigh(port: int, visit: Callable[[Page, str], None]) -> Weight:
    """Load the pages that a visit opens and weigh what came from the server itself.

    Args:
        port: Of the server; what other servers send is left out.
        visit: Signs in, then says by `page.goto` which page is weighed last; only the files of
            the last page count.
    """
    seen: dict[str, str] = {}

    def note(answer: Response) -> None:
        kind = answer.request.resource_type
        if kind == "document":
            seen.clear()
        if kind in {"script", "stylesheet"} and urlsplit(answer.url).port == port and answer.ok:
            seen[answer.url] = kind

    with chromium() as browser:
        page = browser.new_page()
        page.route("**/*", lambda route: route.continue_())  # switches the browser's cache off
        page.on("response", note)
        visit(page, f"http://127.0.0.1:{port}")
        page.wait_for_load_state("networkidle")
        sizes = [(kind, len(page.request.get(url).body())) for url, kind in seen.items()]
        browser.close()
    return Weight(
        scripts=sum(size for kind, size in sizes if kind == "script"),
        styles=sum(size for kind, size in sizes if kind == "stylesheet"),
        files=len(sizes),
    )


def of_ours(here: Arena) -> Weight:
    """The voting page, reached by an invitation."""

    def visit(page: Page, address: str) -> None:
        page.goto(f"{address}/invitation/{here.tokens[0]}/")
        page.click("main button.main")
        page.wait_for_url(f"{address}/studies/{here.study}/vote/")

    return weigh(here.port, visit)


def of_label_studio(here: Studio) -> Weight:
    """The labelling page of the project."""

    def visit(page: Page, address: str) -> None:
        page.goto(f"{address}/user/login/")
        page.fill("input[name=email]", EMAIL)
        page.fill("input[name=password]", PASSWORD)
        page.click("button[type=submit]")
        page.wait_for_load_state("networkidle")
        page.goto(f"{address}/projects/{here.project}/data?labeling=1")
        page.wait_for_timeout(3000)

    return weigh(here.port, visit)
