"""A board's exported folder opens from a disk without a network."""

from pathlib import Path

import pytest
from playwright.sync_api import Browser

from arena.results.exports.board_files import board_folder, write_folder
from tests.board_rows import a_batch, a_board, newcomer, published, voted
from tests.browser.booth import PHONE
from tests.browser.test_voting_page import faults

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]
TOO_WIDE = "document.documentElement.scrollWidth - document.documentElement.clientWidth"


def test_the_folder_opens_from_a_disk_with_the_network_off(
    browser: Browser, tmp_path: Path
) -> None:
    board = a_board()
    published(board, 1)
    newcomer("dot")
    voted(a_batch(board, "dot"), seed=2)
    published(board, 2)
    write_folder(board_folder(board), tmp_path / "site")
    context = browser.new_context(offline=True, viewport=PHONE, reduced_motion="reduce")
    page, asked = context.new_page(), list[str]()
    page.on("request", lambda request: asked.append(request.url))
    page.goto((tmp_path / "site" / "index.html").as_uri())
    assert page.locator("table.standings tbody tr").count() == 4
    assert page.locator("img").evaluate("image => image.naturalWidth") > 0
    assert page.evaluate(TOO_WIDE) <= 0
    assert faults(page) == []
    page.get_by_role("link", name="Table 1 of").click()
    assert page.locator("table.standings tbody tr").count() == 3
    assert all(address.startswith("file:///") for address in asked)
    assert not any("<script" in page.read_text() for page in (tmp_path / "site").glob("*.html"))
    context.close()
