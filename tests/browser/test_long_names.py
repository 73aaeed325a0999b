"""A name without a place to break stays on the page of a phone."""

from __future__ import annotations

from pathlib import Path

import pytest
from django.conf import settings
from playwright.sync_api import Browser

from tests.browser.booth import PHONE
from tests.browser.chromium import PATIENCE_MS

pytestmark = [pytest.mark.browser, pytest.mark.layout]
SHEETS = ("tokens", "base", "components")


@pytest.mark.parametrize("element", ["h1", "h2", "h3", "p"])
def test_a_long_name_breaks_instead_of_widening_the_page(browser: Browser, element: str) -> None:
    folder = Path(settings.BASE_DIR) / "static" / "css"
    styles = "".join((folder / f"{name}.css").read_text() for name in SHEETS)
    card = f"<div class='card'><{element}>{'n' * 120}</{element}></div>"
    page = browser.new_page(viewport=PHONE)
    page.set_default_timeout(PATIENCE_MS)
    page.set_content(f"<style>{styles}</style><main>{card}</main>")
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    page.close()
