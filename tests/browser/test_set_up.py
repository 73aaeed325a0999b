"""What scripts add where a study is set up: objects of an intent without a reload, and copying."""

import json

import pytest
from django.urls import reverse
from playwright.sync_api import Page, expect

from arena.people.services import create_person
from augment.models import BaseScene
from tests.browser.booth import Booth

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


def visit(booth: Booth, path: str, **how: object) -> Page:
    """A page by an admin, which remembers that it was not loaded anew."""
    create_person(username="ada", password="a password", role="admin")
    page = booth.visit("ada", path, dict(how))
    page.evaluate("window.stayed = true")
    return page


def add_a_walk(page: Page) -> None:
    """A bus, and a walk whose distance runs from it."""
    page.fill("[name=instruction]", "Somebody crosses before the bus.")
    page.select_option("[name=i_kind]", "vehicles")
    page.fill("[name=i_name]", "bus")
    page.get_by_role("button", name="One more object").click()
    asks = page.locator("[data-ask]")
    expect(asks).to_have_count(2)
    asks.nth(1).locator("[name=i_kind]").select_option("walk")
    asks.nth(1).locator("[name=i_anchor]").fill("bus")
    asks.nth(1).locator("[name=i_distance_m]").fill("4.5")


def test_objects_come_and_go_and_become_json_without_leaving_the_page(booth: Booth) -> None:
    scene = BaseScene.objects.earliest("pk")
    page = visit(booth, reverse("scenario-new", args=[scene.code]))
    add_a_walk(page)
    page.get_by_text("All of it as JSON", exact=True).click()
    page.get_by_role("button", name="Fields to JSON").click()
    text = page.locator("[name=intent]")
    expect(text).to_be_focused()
    requests = json.loads(text.input_value())["requests"]
    assert [one["kind"] for one in requests] == ["vehicles", "walk"]
    assert requests[1]["spot"]["anchor"] == "bus"
    page.get_by_role("button", name="JSON to fields").click()
    asks = page.locator("[data-ask]")
    expect(asks).to_have_count(2)
    expect(text).to_have_value("")
    expect(asks.nth(1).locator("[name=i_distance_m]")).to_have_value("4.5")
    asks.nth(1).get_by_role("button", name="Remove").click()
    expect(asks).to_have_count(1)
    expect(asks.locator("[name=i_name]")).to_have_value("bus")
    assert page.evaluate("window.stayed")
    assert page.input_value("[name=instruction]") == "Somebody crosses before the bus."
