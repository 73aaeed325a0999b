"""Voters' pages are English or German, by browser, switch and account; all others English."""

import pytest
from django.test import Client
from django.urls import reverse

from arena.models import Person
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from tests.study_rows import a_study, vote
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

GERMAN = {"HTTP_ACCEPT_LANGUAGE": "de-AT,de;q=0.9,en;q=0.8"}


def login_page(client: Client, **headers: str) -> str:
    return client.get(reverse("login"), **headers).content.decode()  # type: ignore[arg-type]


def test_the_browser_decides_before_anybody_has_chosen() -> None:
    people()
    assert '<html lang="de"' in login_page(Client(), **GERMAN)
    assert "Anmelden" in login_page(Client(), **GERMAN)
    for other in ("en", "fr"):
        assert "Sign in" in login_page(Client(), HTTP_ACCEPT_LANGUAGE=other)


def test_the_switch_is_kept_with_the_person_and_leads_back() -> None:
    expert = people()["expert"]
    client = signed_in(expert)
    answer = client.post(reverse("language"), {"language": "de", "next": "/?here"})
    assert answer.headers["Location"] == "/?here"
    assert Person.objects.get(user=expert).preferences == {"language": "de"}
    assert "Gerade ist nichts zu tun" in client.get("/").content.decode()
    client.post(reverse("language"), {"language": "en"})
    assert "Nothing to do right now" in client.get("/", **GERMAN).content.decode()  # type: ignore[arg-type]


def test_files_are_the_same_in_every_language() -> None:
    study = a_study()
    for matchup in study.matchups.all():
        vote(matchup)
    rate(study=close_study(study=study), rounds=20)
    reader = signed_in(people()["researcher"])
    for form in ("csv", "json", "latex"):
        address = reverse("results-export", args=[study.code, "leaderboard", form])
        english, german = (
            reader.get(address, HTTP_ACCEPT_LANGUAGE=wish).getvalue() for wish in ("en", "de")
        )
        assert english == german
        assert english


def test_voting_is_german() -> None:
    study = a_study()
    client = signed_in(study.experts.get(username="eva"))
    for name in ("vote", "vote-skipped"):
        answer = client.get(reverse(name, args=[study.code]), **GERMAN)  # type: ignore[arg-type]
        assert answer.headers["Content-Language"] == "de"
        assert '<html lang="de"' in answer.content.decode()
        assert "Abmelden" in answer.content.decode()


@pytest.mark.parametrize("address", ["/", "/jobs/", "/studies/new/", "/people/"])
def test_pages_of_the_staff_are_english(address: str) -> None:
    answer = signed_in(people()["admin"]).get(address, **GERMAN)  # type: ignore[arg-type]
    page = answer.content.decode()
    assert answer.headers["Content-Language"] == "en"
    assert '<html lang="en"' in page
    assert "Signed in as an admin" in page
    assert 'name="language"' not in page
