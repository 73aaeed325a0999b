"""Opening, watching and closing a study by its pages."""

from __future__ import annotations

import pytest
from django.urls import reverse

from arena.models import Study
from tests import study_rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def test_an_admin_opens_a_study_and_its_experts_can_vote() -> None:
    cast = study_rows.cast_of()
    sent = {
        "name": "Round 1",
        **cast,
        "votes_per_expert": 9,
        "seed": 4,
    }
    answer = signed_in(people()["admin"]).post(reverse("study-new"), sent)
    study = Study.objects.get()
    assert answer.headers["Location"] == reverse("study", args=[study.code])
    assert (study.state, study.matchups.count()) == ("open", 18)


def test_what_cannot_be_planned_is_said_on_the_form_and_nothing_is_kept() -> None:
    cast = study_rows.cast_of()
    study_rows.contestant("new")
    sent = {"name": "Round 1", **cast, "contestants": ["ann", "new"], "votes_per_expert": 9}
    answer = signed_in(people()["admin"]).post(reverse("study-new"), {**sent, "seed": 4})
    assert answer.status_code == 422
    assert "no picture yet of new" in answer.content.decode()
    assert 'value="Round 1"' in answer.content.decode()
    assert not Study.objects.exists()


def test_progress_is_shown_by_expert_and_says_nothing_of_who_leads() -> None:
    study = study_rows.a_study()
    for matchup in study_rows.matchups_of(study, "eva")[:4]:
        study_rows.vote(matchup)
    page = signed_in(people()["analyst"]).get(reverse("study", args=[study.code]))
    shown = page.content.decode()
    assert "4 of 9" in shown
    assert "4 of 18 votes" in shown
    assert "Elo" not in shown
    assert "Close the study" not in shown


def test_closing_is_for_admins_and_leads_to_the_results() -> None:
    study = study_rows.a_study()
    admin = signed_in(people()["admin"])
    answer = admin.post(reverse("study-close", args=[study.code]), follow=True)
    assert reverse("results", args=[study.code]) in answer.content.decode()
    study.refresh_from_db()
    assert study.state == "closed"
