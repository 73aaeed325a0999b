"""What has no way back asks once more, with its numbers, and works by forms alone."""

import html
import re
from typing import Any

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from arena.jobs.services import open_labelling
from augment.models import GenerationJob
from tests import study_rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def text_of(answer: Any) -> str:
    plain = re.sub(r"<[^>]+>", " ", html.unescape(answer.content.decode()))
    return " ".join(plain.split())


def hidden_of(answer: Any) -> dict[str, list[str]]:
    """What the page sends along, as a browser would."""
    sent: dict[str, list[str]] = {}
    pattern = r'<input type="hidden" name="([^"]+)" value="([^"]*)">'
    for name, value in re.findall(pattern, answer.content.decode()):
        if name != "csrfmiddlewaretoken":
            sent.setdefault(name, []).append(html.unescape(value))
    return sent


def admin_of() -> Client:
    return signed_in(people()["admin"])


def test_closing_a_study_asks_and_says_what_will_be_missing() -> None:
    study = study_rows.a_study()
    first, second, *rest = study_rows.matchups_of(study, "eva")
    study_rows.vote(first, "skip", reason="unclear")
    for matchup in (second, *rest):
        study_rows.vote(matchup)
    admin, page = admin_of(), reverse("study-close", args=[study.code])
    assert page in admin.get(reverse("study", args=[study.code])).content.decode()
    for asked in (admin.get(page), admin.post(page)):
        assert asked.status_code == 200
        shown = text_of(asked)
        assert "Close the study “Round 1”?" in shown
        assert "Votes given: 8. Pairs skipped: 1. Still planned: 9." in shown
        study.refresh_from_db()
        assert study.state == "open"
    admin.post(page, {"sure": "1"})
    study.refresh_from_db()
    assert study.state == "closed"
    assert admin.get(page).status_code == 302, "a closed one asks nothing"


def test_every_question_is_for_admins_alone_and_no_crawler_acts() -> None:
    study = study_rows.a_study()
    job = GenerationJob.objects.all()[0]
    labelling = open_labelling(name="F", job=job, experts=["eva"], seed=1)
    researcher = signed_in(people()["researcher"])
    for name, row in (("study-close", study), ("job-cancel", job), ("labelling-close", labelling)):
        page = reverse(name, args=[row.code])
        assert researcher.get(page).status_code == 403
        assert researcher.post(page, {"sure": "1"}).status_code == 403
    admin = signed_in(User.objects.get(username="the-admin"))
    admin.get(reverse("study-close", args=[study.code]), {"sure": "1"})
    study.refresh_from_db()
    assert study.state == "open", "a GET never acts"
