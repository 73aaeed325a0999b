"""The voting page: one vote per decision, nothing of who made what."""

import re

import pytest
from django.test import Client
from django.urls import reverse

from arena.models import Report, Vote
from arena.studies.services.opening import close_study
from tests import study_rows
from tests.web.ballots import ballot, following, page
from tests.web.cast import names_of_contestants, people, signed_in, status, world

pytestmark = pytest.mark.django_db


def test_a_press_saves_one_vote_and_leads_to_the_next_pair() -> None:
    here = world()
    expert, first = signed_in(here.expert), following(here)
    answer = expert.post(page(here), ballot(first, "right"))
    assert answer.status_code == 302
    assert answer.headers["Location"] == page(here)
    vote = Vote.objects.get()
    assert (vote.matchup, vote.outcome, vote.winner_id) == (first, "right", first.right_id)
    shown = expert.get(page(here)).content.decode()
    assert f'name="matchup" value="{following(here).code}"' in shown


def test_a_double_press_is_one_vote() -> None:
    here = world()
    expert, sent = signed_in(here.expert), ballot(following(here))
    assert [expert.post(page(here), sent).status_code for _ in range(2)] == [302, 302]
    assert Vote.objects.count() == 1


def test_going_back_and_pressing_again_keeps_the_first_vote_and_says_so() -> None:
    here = world()
    expert, first = signed_in(here.expert), following(here)
    expert.post(page(here), ballot(first, "left"))
    answer = expert.post(page(here), ballot(first, "right"), follow=True)
    assert Vote.objects.get().outcome == "left"
    assert "your first vote counts" in answer.content.decode()


def test_a_vote_for_somebody_elses_matchup_is_404_and_not_kept() -> None:
    here = world()
    others = study_rows.matchups_of(here.study, "finn")[0]
    assert signed_in(here.expert).post(page(here), ballot(others)).status_code == 404
    assert not Vote.objects.exists()


@pytest.mark.parametrize(
    "broken",
    [
        {"outcome": "both"},
        {"outcome": ""},
        {"outcome": "both_miss"},
        {"outcome": "", "skip": "bored"},
        {"skip": "other"},
        {"key": "7"},
        {"matchup": "7"},
        {"comment": "x" * 1001},
    ],
)
def test_what_is_no_answer_is_refused_with_the_pair_still_there(broken: dict[str, str]) -> None:
    here = world()
    sent = ballot(following(here)) | broken
    answer = signed_in(here.expert).post(page(here), sent)
    assert answer.status_code == 422
    assert "nothing was saved" in answer.content.decode()
    assert not Vote.objects.exists()


def test_a_vote_without_the_forms_token_is_refused() -> None:
    here = world()
    strict = Client(enforce_csrf_checks=True)
    strict.force_login(here.expert)
    answer = strict.post(page(here), ballot(following(here)))
    assert answer.status_code == 403
    assert "too old to be sent" in answer.content.decode()


def test_a_closed_study_is_said_kindly_and_takes_no_vote() -> None:
    here = world()
    expert, first = signed_in(here.expert), following(here)
    close_study(study=here.study)
    answer = expert.post(page(here), ballot(first), follow=True)
    assert answer.status_code == 200
    assert "This study is closed" in answer.content.decode()
    assert not Vote.objects.exists()


def test_the_last_vote_leads_to_the_thanks() -> None:
    here = world()
    for matchup in study_rows.matchups_of(here.study, "eva"):
        study_rows.vote(matchup)
    shown = signed_in(here.expert).get(page(here)).content.decode()
    assert "You are done." in shown
    assert "9 answers saved" in shown


def test_every_showing_has_a_key_of_its_own_and_is_never_cached() -> None:
    here, key = world(), r'name="key" value="([0-9a-f-]+)"'
    expert = signed_in(here.expert)
    answers = [expert.get(page(here)) for _ in range(2)]
    keys = {re.search(key, answer.content.decode())[1] for answer in answers}  # type: ignore[index]
    assert len(keys) == 2
    assert "no-store" in answers[0].headers["Cache-Control"]


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


def test_a_skip_keeps_its_reason_and_a_comment_goes_along() -> None:
    here = world()
    sent = ballot(following(here), "", skip="unclear", comment=" Which lane? ")
    signed_in(here.expert).post(page(here), sent)
    vote = Vote.objects.get()
    assert (vote.outcome, vote.reason, vote.comment) == ("skip", "unclear", "Which lane?")


def test_both_miss_is_offered_and_taken_where_the_study_asks_for_it() -> None:
    here = world()
    here.study.allow_both_miss = True
    here.study.save()
    expert = signed_in(here.expert)
    assert 'value="both_miss"' in expert.get(page(here)).content.decode()
    expert.post(page(here), ballot(following(here), "both_miss"))
    vote = Vote.objects.get()
    assert (vote.outcome, vote.both_miss) == ("equal", True)


def test_a_former_vote_is_shown_marked_and_replaced_without_a_script() -> None:
    here = world()
    expert, first = signed_in(here.expert), following(here)
    expert.post(page(here), ballot(first, "left", comment="hm"))
    old = Vote.objects.get()
    shown = expert.get(page(here), {"change": str(old.key)}).content.decode()
    assert f"Pair {first.position}: A. Choose again?" in shown
    assert re.search(r'value="left" aria-pressed="true"', shown)
    assert f'name="supersedes" value="{old.key}"' in shown
    assert ">hm</textarea>" in shown
    expert.post(page(here), ballot(first, "right", supersedes=str(old.key)))
    assert Vote.objects.get(superseded_by=None).outcome == "right"


def test_a_vote_that_is_not_ones_own_can_not_be_shown_for_a_change() -> None:
    here = world()
    theirs = study_rows.vote(study_rows.matchups_of(here.study, "finn")[0])
    shown = signed_in(here.expert).get(page(here), {"change": str(theirs.key)}).content.decode()
    assert str(following(here).code) in shown
    assert "supersedes" not in shown


def test_a_report_by_the_form_is_kept_and_leads_back() -> None:
    here = world()
    first = following(here)
    said = {"report": "picture_wrong", "report_side": "B", "report_comment": "a car floats"}
    sent = ballot(first, **said)
    url = reverse("vote-report", args=[here.study.code])
    answer = signed_in(here.expert).post(url, sent, follow=True)
    assert "Reported, thank you." in answer.content.decode()
    kept = Report.objects.get()
    assert (kept.matchup, kept.reason, kept.comment) == (first, "picture_wrong", "a car floats")
    assert (kept.side, kept.mark_x) == ("right", None)
    assert not Vote.objects.exists()
