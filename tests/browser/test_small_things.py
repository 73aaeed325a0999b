"""What once looked wrong while voting: panels, looking back, taps, and a network that is gone."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from tests.browser.booth import Booth, all_sent, press

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


def test_offline_is_said_as_soon_as_it_is_so_and_no_longer(booth: Booth) -> None:
    page = booth.enter()
    booth.look_ahead(page)
    told = page.locator("#saved")
    page.context.set_offline(True)
    expect(told).to_have_text("Offline. Kept in this browser and sent later: 0.")
    expect(page.locator("#said")).to_contain_text("Offline.")
    press(page, "1")
    expect(told).to_have_text("Offline. Kept in this browser and sent later: 1.")
    page.context.set_offline(False)
    all_sent(page, 1)
    assert booth.outcomes() == ["left"]
