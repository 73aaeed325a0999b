"""The browser finds one family alone: the figures of its pages don't depend on the machine."""

from __future__ import annotations

import pytest
from PIL import ImageFont
from playwright.sync_api import Browser

from tests.browser.fonts import DEJAVU, LIBERATION, FontFamily

pytestmark = pytest.mark.browser
SIZE_PX = 100
TEXT = "Waymo illuminates"
STACKS = ["sans-serif", "Arial", "'Segoe UI', Roboto, 'Noto Sans', sans-serif", "'No Such Font'"]
WIDTH = """([text, size, stack]) => {
    const pen = document.createElement("canvas").getContext("2d");
    pen.font = `${size}px ${stack}`;
    return pen.measureText(text).width;
}"""


def width_of(family: FontFamily) -> float:
    """What the file of the family says, read by another library."""
    regular = {"DejaVu Sans": "DejaVuSans.ttf", "Liberation Sans": "LiberationSans-Regular.ttf"}
    font = ImageFont.truetype(str(family.folder / regular[family.name]), SIZE_PX)
    return font.getlength(TEXT)


def test_every_font_that_a_page_asks_for_is_the_one_that_is_there(browser: Browser) -> None:
    page = browser.new_page()
    widths = {stack: page.evaluate(WIDTH, [TEXT, SIZE_PX, stack]) for stack in STACKS}
    page.close()
    expected = [width_of(family) for family in (DEJAVU, LIBERATION)]
    assert expected[0] > 1.1 * expected[1]
    assert any(
        all(width == pytest.approx(one, rel=0.01) for width in widths.values()) for one in expected
    ), widths
