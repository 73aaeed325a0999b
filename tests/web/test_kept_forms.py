"""What somebody typed before the session ended is kept over the sign-in."""

import html
import re

import pytest
from django.test import Client
from django.urls import reverse

from arena.models import Study
from arena.site.acts import SURE, TYPED
from tests.study_rows import a_study
from tests.web.cast import people

pytestmark = pytest.mark.django_db
FIELD = re.compile(r'<input type="hidden" name="(\w+)" value="([^"]*)">')


def fields(page: bytes) -> dict[str, str]:
    return {name: html.unescape(value) for name, value in FIELD.findall(page.decode())}


def test_a_form_that_was_sent_too_late_is_sent_after_signing_in() -> None:
    study, admin = a_study(), people()["admin"]
    admin.set_password("a good password")
    admin.save()
    client, page = Client(), reverse("study-cancel", args=[study.code])
    typed = {SURE: "1", TYPED: study.name, "why": "too <few> experts", "new_password1": "secret"}
    asked = client.post(page, typed)
    assert "What you typed is kept" in asked.content.decode()
    assert f'action="{reverse("login")}"' in asked.content.decode()
    assert "secret" not in asked.content.decode()
    sent = fields(asked.content) | {"username": admin.username}
    wrong = client.post(reverse("login"), sent | {"password": "wrong"})
    assert fields(wrong.content)["kept_form"] == sent["kept_form"]
    offered = client.post(reverse("login"), sent | {"password": "a good password"})
    again = fields(offered.content)
    assert f'action="{page}"' in offered.content.decode()
    client.post(page, again)
    assert Study.objects.get().state == "cancelled"
