"""A job's table: its rows follow as one scrolls, and whoever comes back finds the cell again."""

from urllib.parse import urlsplit

import pytest
from django.urls import reverse
from playwright.sync_api import Browser, expect

from tests.browser.held import hold
from tests.web.cast import people, signed_in
from tests.web.test_job_grid import large_job

pytestmark = [pytest.mark.browser, pytest.mark.django_db]
ROWS = 9


def test_rows_follow_as_one_scrolls(browser: Browser, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("arena.jobs.queries.CELLS", 4)
    job, reader = large_job(scenarios=ROWS, contestants=2), signed_in(people()["researcher"])
    path = reverse("job-tab", args=[job.code, "grid"])
    pages = {f"row={n}": reader.get(f"{path}?row={n}").content for n in range(2, ROWS // 2 + 2)}
    with hold(browser, path, reader.get(path).content) as held:
        page, rows = held.page, held.page.locator(".grid tbody tr")
        assert rows.count() == 2, "what could not be fetched leaves the link"
        page.route(
            "**/grid/?row=*",
            lambda route: route.fulfill(
                body=pages[urlsplit(route.request.url).query], content_type="text/html"
            ),
        )
        page.locator(".frozen").dispatch_event("scroll")
        expect(rows).to_have_count(ROWS)
        expect(page.locator("#more [rel=next]")).to_have_count(0)
        name = rows.nth(5).locator("a.cell").first.get_attribute("id")
        page.locator(f"#{name}").click()
        page.go_back()
        assert page.url.endswith(f"{path}?row=3#{name}")
