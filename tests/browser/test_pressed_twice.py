"""A button that is pressed again while its answer is on its way."""

import pytest
from django.urls import reverse
from playwright.sync_api import Browser

from tests.browser.held import hold
from tests.web.cast import people, signed_in

pytestmark = [pytest.mark.browser, pytest.mark.django_db]
BETWEEN_MS = 300
"""So much later that the browser itself does not take them for one press."""


def test_a_form_is_sent_once(browser: Browser) -> None:
    path = reverse("api-tokens")
    html = signed_in(people()["admin"]).get(path).content
    with hold(browser, path, html) as held:
        held.page.fill("[name=name]", "mine")
        box = held.page.get_by_role("button", name="Make the token").bounding_box()
        assert box is not None
        for _ in range(3):
            held.page.mouse.click(box["x"] + 5, box["y"] + 5)
            held.page.wait_for_timeout(BETWEEN_MS)
        assert len(held.posted) == 1
