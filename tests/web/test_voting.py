"""The voting page: one vote per decision, nothing of who made what."""

import re

import pytest
from django.urls import reverse

from arena.studies.services.opening import close_study
from tests import study_rows
from tests.web.ballots import following, page
from tests.web.cast import names_of_contestants, people, signed_in, status, world

pytestmark = pytest.mark.django_db


def test_a_closed_study_is_said_kindly() -> None:
    here = world()
    close_study(study=here.study)
    assert "This study is closed" in signed_in(here.expert).get(page(here)).content.decode()


def test_the_page_is_never_cached_and_offers_both_miss_where_the_study_asks_for_it() -> None:
    here = world()
    expert = signed_in(here.expert)
    assert 'value="both_miss"' not in expert.get(page(here)).content.decode()
    here.study.allow_both_miss = True
    here.study.save()
    answer = expert.get(page(here))
    assert 'value="both_miss"' in answer.content.decode()
    assert "no-store" in answer.headers["Cache-Control"]


@pytest.mark.parametrize("key", ["theirs", "7"])
def test_only_a_vote_of_ones_own_can_be_shown_for_a_change(key: str) -> None:
    here = world()
    theirs = study_rows.vote(study_rows.matchups_of(here.study, "finn")[0])
    asked = {"change": str(theirs.key) if key == "theirs" else key}
    shown = signed_in(here.expert).get(page(here), asked).content.decode()
    assert '"change": null' in shown


def test_the_last_vote_leads_to_the_thanks() -> None:
    here = world()
    for matchup in study_rows.matchups_of(here.study, "eva"):
        study_rows.vote(matchup)
    shown = signed_in(here.expert).get(page(here)).content.decode()
    assert "You are done." in shown
    assert "9 answers saved" in shown


def test_neither_page_nor_headers_tell_who_made_what() -> None:
    here = world()
    expert = signed_in(here.expert)
    for url in (page(here), reverse("home")):
        answer = expert.get(url)
        said = answer.content.decode() + str(answer.headers)
        leaked = [
            word for word in names_of_contestants() if re.search(rf"\b{re.escape(word)}\b", said)
        ]
        assert leaked == [], url
        assert not re.search(r"\b(model|LLM|generated|ground truth)\b", said, re.IGNORECASE), url


def test_a_picture_goes_out_bare_and_to_its_expert_alone() -> None:
    here = world()
    shown = following(here)
    url = reverse("matchup-image", args=[shown.left_token])
    answer = signed_in(here.expert).get(url)
    assert b"".join(answer).startswith(b"\x89PNG")
    assert answer.headers["Content-Type"] == "image/png"
    assert answer.headers["Cache-Control"] == "private, max-age=31536000, immutable"
    assert answer.headers["Content-Disposition"] == "inline"
    assert not {"ETag", "Last-Modified"} & set(answer.headers)
    other = study_rows.matchups_of(here.study, "finn")[0]
    theirs = reverse("matchup-image", args=[other.right_token])
    assert signed_in(here.expert).get(theirs).status_code == 404
    assert status(people()["admin"], theirs) == 200
    assert signed_in(here.expert).get(reverse("matchup-image", args=["x"])).status_code == 404
