"""Home says to each role what is next, and the switch of themes is remembered."""

from __future__ import annotations

import pytest
from django.contrib.auth.models import Group, User
from django.test import Client
from django.urls import reverse

from arena.models import Person
from arena.services.studies import close_study
from tests import study_rows
from tests.web.cast import names_of_contestants, people, signed_in, world

pytestmark = pytest.mark.django_db


def home(user: User) -> str:
    return signed_in(user).get("/").content.decode()


def test_an_expert_is_asked_to_start_then_to_continue_then_thanked() -> None:
    here = world()
    assert "Start voting" in home(here.expert)
    matchups = study_rows.matchups_of(here.study, "eva")
    study_rows.vote(matchups[0])
    shown = home(here.expert)
    assert "Continue voting" in shown
    assert "1 of 9 votes" in shown
    for matchup in matchups[1:]:
        study_rows.vote(matchup)
    shown = home(here.expert)
    assert "You are done" in shown
    assert "Continue voting" not in shown


def test_an_expert_without_a_study_has_nothing_to_do() -> None:
    assert "No study is open for you" in home(people()["expert"])


def test_an_analyst_sees_progress_of_running_studies_and_results_of_closed_ones() -> None:
    here, analyst = world(), people()["analyst"]
    running = home(analyst)
    assert "0 of 18 votes" in running
    assert "Read the results" not in running
    assert not [word for word in names_of_contestants() if word in running]
    close_study(study=here.study)
    assert "Read the results" in home(analyst)


def test_an_admin_is_led_from_an_empty_house_to_the_first_job() -> None:
    admin = people()["admin"]
    assert "is loaded by a button" in home(admin)
    world()
    shown = home(admin)
    assert "From a scenario to a rated table" in shown
    assert "7 scenarios" not in shown
    assert "8 scenarios are here" in shown


def test_the_theme_is_kept_with_the_person_and_leads_back() -> None:
    expert = people()["expert"]
    client = signed_in(expert)
    answer = client.post(reverse("theme"), {"theme": "dark", "next": "/?here"})
    assert answer.headers["Location"] == "/?here"
    assert Person.objects.get(user=expert).preferences == {"theme": "dark"}
    assert 'data-theme="dark"' in home(expert)


@pytest.mark.parametrize("address", ["https://elsewhere.example/", "//elsewhere", "-1", "jobs"])
def test_a_made_up_theme_or_a_foreign_address_changes_nothing(address: str) -> None:
    expert = people()["expert"]
    answer = signed_in(expert).post(reverse("theme"), {"theme": "pink", "next": address})
    assert answer.headers["Location"] == "/"
    assert Person.objects.get(user=expert).preferences == {}


def test_an_account_that_no_service_made_is_a_person_and_has_a_home() -> None:
    Person.objects.filter(user=people()["expert"]).update(pseudonym="Person 4000000")
    bare = User.objects.create_user("bare", password="a password", id=4_000_000)
    bare.groups.add(Group.objects.get(name="analyst"))
    assert f"Person 4000000 {bare.person.code.hex[:8]}" in home(bare)
    signed_in(bare).post(reverse("theme"), {"theme": "light"})
    assert 'data-theme="light"' in home(bare)


def test_a_wrong_password_is_said_and_the_name_kept() -> None:
    people()
    answer = Client().post(reverse("login"), {"username": "the-expert", "password": "wrong"})
    shown = answer.content.decode()
    assert "match an account" in shown
    assert 'value="the-expert"' in shown


def test_signing_out_takes_a_post() -> None:
    client = signed_in(people()["expert"])
    assert client.get(reverse("logout")).status_code == 405
    assert client.post(reverse("logout")).headers["Location"] == reverse("login")
    assert client.get("/").status_code == 302
