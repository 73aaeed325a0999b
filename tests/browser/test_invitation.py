"""A real browser accepts an invitation: its form must be allowed to say where it comes from."""

import pytest
from django.contrib.auth.models import User
from django.urls import reverse
from playwright.sync_api import expect

from arena.people.links import invite
from tests.browser.booth import Booth
from tests.browser.chromium import PATIENCE_MS

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


def test_the_button_of_an_invitation_leads_to_the_first_pair(booth: Booth) -> None:
    token = invite(study=booth.study, expert=User.objects.get(username="eva")).token
    context = booth.browser.new_context(base_url=booth.address, locale="de-DE")
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    page.goto(reverse("invitation", args=[token]))
    expect(page.get_by_role("heading", name="Sie sind eingeladen")).to_be_visible()
    page.get_by_role("button", name="Annehmen und beginnen").click()
    page.wait_for_url(f"**{reverse('vote', args=[booth.study.code])}")
    expect(page.get_by_role("button", name="A ist besser")).to_be_visible()
    context.close()
