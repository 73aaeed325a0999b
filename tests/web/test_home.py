"""Home says to each role what is next, and the switch of themes is remembered."""

import pytest
from django.contrib.auth.models import User
from django.urls import reverse

from arena.models import Person
from arena.people.services import create_person
from arena.studies.services.opening import close_study
from tests import study_rows
from tests.web.cast import people, signed_in, world

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


def test_an_admin_is_led_by_steps_that_the_demo_can_do_until_a_study_is_closed() -> None:
    admin = signed_in(create_person(username="ada", password=None, role="admin"))

    def use_demo(name: str) -> str:
        return admin.post(reverse("first-step", args=[name]), follow=True).content.decode()

    offered = "Use the demo’s"
    assert admin.get("/").content.decode().count(offered) == 6
    assert use_demo("contestants").count(offered) == 4, "with the stand-in that they ask"
    assert use_demo("scenarios").count(offered) == 3
    assert "of 80 are settled" in use_demo("job")
    assert "No job is finished yet" in use_demo("study")
    close_study(study=study_rows.a_study())
    assert offered not in admin.get("/").content.decode()


def test_a_bar_says_what_comes_next_until_a_study_is_closed() -> None:
    admin = signed_in(create_person(username="ada", password=None, role="admin"))

    def shown() -> str:
        return " ".join(admin.get(reverse("jobs")).content.decode().split())

    first = reverse("endpoint-new")
    assert "0 of 6 steps," in shown()
    assert f'<a href="{first}">next: say where language models answer</a>' in shown()
    close_study(study=study_rows.a_study())
    assert "next:" not in shown()


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
