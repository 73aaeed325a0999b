"""Opening, watching and closing a study by its pages."""

import pytest
from django.contrib.auth.models import User
from django.urls import reverse

from arena.models import Study
from arena.studies.pages import setup
from augment import tasks
from augment.models import Augmentation
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from tests import study_rows
from tests.scenes import vehicle
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def test_an_admin_opens_a_study_and_its_experts_can_vote() -> None:
    cast = study_rows.cast_of()
    sent = {"name": "Round 1", **cast, "votes_per_expert": 9, "seed": 4}
    answer = signed_in(people()["admin"]).post(reverse("study-new"), {**sent, "sure": "1"})
    study = Study.objects.get()
    assert answer.headers["Location"] == reverse("study", args=[study.code])
    assert (study.state, study.matchups.count()) == ("open", 18)


def test_what_cannot_be_planned_is_said_on_the_form_and_nothing_is_kept() -> None:
    cast = study_rows.cast_of()
    study_rows.contestant("new")
    sent = {"name": "Round 1", **cast, "contestants": ["ann", "new"], "votes_per_expert": 9}
    answer = signed_in(people()["admin"]).post(
        reverse("study-new"), {**sent, "seed": 4, "sure": "1"}
    )
    assert answer.status_code == 422
    assert "no picture yet of new" in answer.content.decode()
    assert 'value="Round 1"' in answer.content.decode()
    assert not Study.objects.exists()


def test_progress_is_shown_by_expert_and_says_nothing_of_who_leads() -> None:
    study = study_rows.a_study()
    for matchup in study_rows.matchups_of(study, "eva")[:4]:
        study_rows.vote(matchup)
    page = signed_in(people()["researcher"]).get(reverse("study", args=[study.code]))
    shown = page.content.decode()
    assert "4 of 9" in shown
    assert "4 of 18 votes" in shown
    assert "Elo" not in shown[shown.index("<main") :]
    assert "Close the study" not in shown
    assert "finn" not in shown, "researchers know experts by their pseudonyms"


def test_closing_rates_the_votes_once_and_shows_the_table() -> None:
    study = study_rows.a_study()
    for matchup in study_rows.matchups_of(study, "eva")[:2]:
        study_rows.vote(matchup)
    admin = signed_in(people()["admin"])
    for _ in range(2):
        answer = admin.post(reverse("study-close", args=[study.code]), {"sure": "1"}, follow=True)
        assert answer.redirect_chain[-1][0] == reverse("results", args=[study.code])
        assert "2 votes counted" in answer.content.decode()
        assert "Not enough votes to rank" in answer.content.decode()
    study.refresh_from_db()
    assert (study.state, study.snapshots.count()) == ("closed", 1)


def opened(**rules: object) -> tuple[int, str]:
    """What posting the form with these rules answers."""
    sent = {"name": "Round 1", **study_rows.cast_of(), "votes_per_expert": 12, "seed": 4}
    sent |= {"sure": "1"}
    answer = signed_in(people()["admin"]).post(reverse("study-new"), {**sent, **rules})
    return answer.status_code, " ".join(answer.content.decode().split())


def test_an_admin_hands_over_what_an_expert_has_not_judged() -> None:
    study = study_rows.a_study(experts=("eva", "finn", "gus"))
    admin = signed_in(people()["admin"])
    url = reverse("study-hand-over", args=[study.code])
    given = {"giver": "eva", "takers": ["finn", "gus"], "sure": "1"}
    said = admin.post(url, given, follow=True)
    assert "Handed over: finn 5, gus 4." in said.content.decode() or (
        "Handed over: finn 4, gus 5." in said.content.decode()
    )
    assert not study.matchups.filter(expert__username="eva").exists()
    again = admin.post(url, {"giver": "eva", "takers": ["finn"], "sure": "1"}, follow=True)
    assert "eva has nothing left to hand over." in again.content.decode()
    nobody = admin.post(url, {"giver": "finn"}, follow=True)
    assert "Choose who takes over." in nobody.content.decode()
    assert signed_in(User.objects.get(username="the-researcher")).post(url).status_code == 403


def test_attention_checks_are_drawn_by_a_worker_with_one_click(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    place = study_rows.scenario("with-reference")
    place.reference = modification_to_document(Modification(added=(vehicle("Agent2", 20.0, 0.0),)))
    place.save()
    study_rows.scenario("without")
    sent: list[int] = []
    monkeypatch.setattr(setup, "send_checks", sent.append)
    admin = people()["admin"]
    entered = {"name": "Half filled in", "draw": "1"}
    shown = signed_in(admin).post(reverse("study-new"), entered).content.decode()
    assert 'value="Half filled in"' in shown
    tasks.draw_checks(*sent)
    tasks.draw_checks(*sent)
    drawn = Augmentation.objects.get(contestant__kind="check")
    assert (drawn.scenario.slug, sent) == ("with-reference", [admin.pk])
