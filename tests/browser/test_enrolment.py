"""Taking part by a link for everybody, in a browser that nobody has signed in."""

import pytest
from django.conf import settings
from django.test import Client
from playwright.sync_api import expect

from arena.models import Study
from arena.people.services import create_person
from arena.studies.services.taking_part import set_enrolment
from arena.voting.services.drawing import show_own_pictures
from augment.models import Augmentation
from tests.browser.booth import PHONE, Booth, ready
from tests.browser.test_voting_page import faults

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


def plan_with_hung_pictures(study: Study) -> None:
    """A booth's pictures are hung after its plan; what is planned now needs them in the rules."""
    images = {
        (scenario, contestant): image
        for scenario, contestant, image in Augmentation.objects.values_list(
            "scenario__slug", "contestant__slug", "image"
        )
    }
    for entry in study.rules["entries"]:
        entry["picture"] = images[entry["scenario"], entry["contestant"]]
    study.save()


def test_somebody_enrols_votes_and_gets_a_code(booth: Booth) -> None:
    plan_with_hung_pictures(booth.study)
    enrolment = set_enrolment(
        study=booth.study,
        rules={
            "consent": "I take part of my own free will.\n\nMy answers are kept.",
            "asks_for": "Your Prolific ID",
            "places": 2,
            "votes_each": 2,
            "drop_out_after_h": 24,
        },
    )
    context = booth.browser.new_context(
        base_url=booth.address, viewport=PHONE, color_scheme="dark", bypass_csp=True
    )
    booth.contexts.append(context)
    page = context.new_page()
    page.goto(f"/enrol/{enrolment.token}/?id=w-17")
    assert faults(page) == []
    expect(page.get_by_label("Your Prolific ID")).to_have_value("w-17")
    page.get_by_label("I have read this and agree").check()
    page.get_by_role("button", name="Take part").click()
    expect(page.get_by_text("Your next pictures are being drawn")).to_be_visible()
    show_own_pictures(booth.study)  # as workers would
    for pair in (1, 2):
        expect(page.locator("#place")).to_have_text(str(pair))
        ready(page)
        page.keyboard.press("2")
    expect(page.locator("[data-completion]")).to_have_text(enrolment.voters.get().completion_code)
    assert faults(page) == []

    client = Client()
    client.force_login(create_person(username="root", password=None, role="admin"))
    cookie = client.cookies[settings.SESSION_COOKIE_NAME].value
    context.clear_cookies()
    context.add_cookies(
        [{"name": settings.SESSION_COOKIE_NAME, "value": cookie, "url": booth.address}]
    )
    page.goto(f"/studies/{booth.study.code}/enrolment/")
    expect(page.get_by_text("1 of 2 places taken")).to_be_visible()
    assert faults(page) == []
