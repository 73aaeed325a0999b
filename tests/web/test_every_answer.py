"""What holds on every page: headers, faults, words, language, home."""

import sqlite3
from typing import Any

import pytest
from django.conf import LazySettings
from django.contrib.auth.models import User
from django.db import OperationalError
from django.http import HttpRequest, HttpResponse
from django.test import Client, RequestFactory
from django.urls import include, path, reverse
from django.utils.translation import override
from django.views.decorators.csrf import csrf_exempt
from pytest_django import DjangoAssertNumQueries

from arena.api.access import make_api_token
from arena.config.faults import answer_broken
from arena.config.middleware import FaultMiddleware
from arena.models import Person, Snapshot, Study
from arena.people.links import invite
from arena.people.services import create_person
from arena.results.queries.votes import Filters
from arena.results.services.ratings import RATINGS, plan_snapshot
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from arena.studies.services.taking_part import hand_over
from augment.errors import Conflict
from augment.models import Event
from augment.services.running import jobs
from augment.services.running.budget import Caps
from augment.services.running.jobs import JobRequest
from tests import study_rows
from tests.jobs import rows
from tests.study_rows import vote_all
from tests.web.cast import people, signed_in, world

pytestmark = pytest.mark.django_db


GONE = "/studies/00000000-0000-4000-8000-000000000000/"


def broken(request: HttpRequest) -> HttpResponse:
    raise RuntimeError("on purpose")


urlpatterns = [path("broken/", csrf_exempt(broken)), path("", include("arena.config.urls"))]
handler404 = "arena.config.faults.answer_missing"
handler500 = "arena.config.faults.answer_broken"


@pytest.mark.urls(__name__)
def test_pages_the_wire_and_errors_are_kept_by_nobody(admin: Client) -> None:
    admin.raise_request_exception = False
    for address, status in {
        **{"/": 200, "/jobs/": 200, GONE: 404, "/jobs": 301, "/logout/": 405, "/label/x/": 404},
        **{"/broken/": 500, "/api/v1/matchups": 403, "/api/v1/votes": 403},
        "/api/v1/nothing": 404,
    }.items():
        answer = admin.get(address)
        assert answer.status_code == status, address
        check_kept_by_nobody(answer)
        assert "private" in answer["Cache-Control"], address


def check_kept_by_nobody(answer: Any) -> None:
    assert "no-store" in answer["Cache-Control"]
    assert "camera=()" in answer["Permissions-Policy"]
    assert "geolocation=()" in answer["Permissions-Policy"]


def test_redirects_and_refusals_before_any_page_say_so_as_well(settings: LazySettings) -> None:
    forged = Client(enforce_csrf_checks=True).post(reverse("login"), {"username": "eva"})
    unknown = Client().get("/", HTTP_HOST="elsewhere.example")
    settings.SECURE_SSL_REDIRECT = True
    secured = Client().get("/")
    assert [one.status_code for one in (forged, unknown, secured)] == [403, 400, 301]
    for answer in (forged, unknown, secured):
        check_kept_by_nobody(answer)


def test_pictures_and_static_files_keep_their_own(settings: LazySettings) -> None:
    settings.WHITENOISE_USE_FINDERS = True  # here nothing is collected
    some = world()
    matchup = some.study.matchups.filter(expert=some.expert)[0]
    picture = signed_in(some.expert).get(reverse("matchup-image", args=[matchup.left_token]))
    b"".join(picture)  # closes its file
    assert picture["Cache-Control"] == "private, max-age=31536000, immutable"
    script = Client().get("/static/js/vote.js")
    assert (script.status_code, bool(b"".join(script))) == (200, True)
    assert "public" in script["Cache-Control"]
    assert "no-store" not in script["Cache-Control"]
    assert "camera=()" in picture["Permissions-Policy"]
    assert "camera=()" in script["Permissions-Policy"]


def test_a_missing_or_refused_page_has_our_own_words_and_allows_its_own_files_alone(
    accounts: dict[str, User],
) -> None:
    expert = signed_in(accounts["expert"])
    for address, status, words in (
        ("/nowhere/", 404, "There is nothing here"),
        ("/jobs/", 403, "not for your account"),
        ("/", 200, ""),
    ):
        answer = expert.get(address)
        assert (answer.status_code, words in answer.content.decode()) == (status, True), address
        policy = answer.headers["Content-Security-Policy"]
        assert ("default-src 'none'" in policy, "unsafe" in policy) == (True, False), address


def test_the_database_is_never_asked_for_what_postgresql_has_no_text_for(
    django_assert_num_queries: DjangoAssertNumQueries,
) -> None:
    for address in (
        *("/enrol/a%00b/", "/i/%00", "/shared/%00/", "/shared/boards/%00/"),
        *("/api/v1/pictures/%00", "/contestants/new/?model=%00", "/scenarios/?q=a%00"),
    ):
        with django_assert_num_queries(0):
            assert Client().get(address).status_code == 404, address


@pytest.mark.parametrize(("code", "status"), [(None, 503), (5, 503), (13, 503), (1, 500)])
def test_a_database_that_is_gone_for_a_moment_is_asked_again_later(
    code: int | None, status: int
) -> None:
    """Without SQLite's code it is PostgreSQL, started anew for example; 1 is a wrong statement."""
    fault = OperationalError("the connection is closed")
    fault.__cause__ = sqlite3.OperationalError()
    if code is not None:
        fault.__cause__.sqlite_errorcode = code
    answer = FaultMiddleware(answer_broken).process_exception(RequestFactory().get("/"), fault)
    assert (500 if answer is None else answer.status_code) == status
    assert answer is None or answer.headers["Retry-After"]


def test_the_page_for_our_own_fault_asks_no_database() -> None:
    answer = answer_broken(RequestFactory().get("/"))
    assert answer.status_code == 500
    assert "Something broke on our side" in answer.content.decode()


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


def test_files_are_the_same_in_every_language(researcher: Client, study: Study) -> None:
    rate(study=vote_all(study), rounds=20)
    for form in ("csv", "json", "latex"):
        address = reverse("results-export", args=[study.code, "leaderboard", form])
        english, german = (
            researcher.get(address, HTTP_ACCEPT_LANGUAGE=wish).getvalue() for wish in ("en", "de")
        )
        assert english == german
        assert english


def test_voting_is_german(study: Study) -> None:
    client = signed_in(study.experts.get(username="eva"))
    for name in ("vote", "vote-skipped"):
        answer = client.get(reverse(name, args=[study.code]), **GERMAN)  # type: ignore[arg-type]
        assert answer.headers["Content-Language"] == "de"
        assert '<html lang="de"' in answer.content.decode()
        assert "Abmelden" in answer.content.decode()


def test_pages_of_the_staff_are_english(admin: Client) -> None:
    for address in ("/", "/jobs/", "/studies/new/", "/people/"):
        answer = admin.get(address, **GERMAN)  # type: ignore[arg-type]
        page = answer.content.decode()
        assert answer.headers["Content-Language"] == "en", address
        assert '<html lang="en"' in page
        assert "Signed in as an admin" in page
        assert 'name="language"' not in page


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

    offered, bar = "Use the demo’s", admin.get(reverse("jobs")).content.decode()
    assert "0 of 6 steps," in bar
    first = reverse("endpoint-new")
    assert f'<a href="{first}">next: say where language models answer</a>' in bar
    assert admin.get("/").content.decode().count(offered) == 6
    assert use_demo("contestants").count(offered) == 4, "with the stand-in that they ask"
    assert use_demo("scenarios").count(offered) == 3
    assert "of 80 are settled" in use_demo("job")
    assert "No job is finished yet" in use_demo("study")
    close_study(study=study_rows.a_study())
    assert offered not in admin.get("/").content.decode()
    assert "next:" not in admin.get(reverse("jobs")).content.decode(), "nor does a bar elsewhere"


def test_the_theme_is_kept_with_the_person_and_leads_back_but_never_elsewhere() -> None:
    expert = people()["expert"]
    client = signed_in(expert)
    for address in ("https://elsewhere.example/", "//elsewhere", "-1", "jobs"):
        answer = client.post(reverse("theme"), {"theme": "pink", "next": address})
        assert answer.headers["Location"] == "/", address
    assert Person.objects.get(user=expert).preferences == {}
    answer = client.post(reverse("theme"), {"theme": "dark", "next": "/?here"})
    assert answer.headers["Location"] == "/?here"
    assert Person.objects.get(user=expert).preferences == {"theme": "dark"}
    assert 'data-theme="dark"' in home(expert)


def test_a_voter_is_refused_in_the_language_of_the_request() -> None:
    expert = study_rows.expert("eva")
    with override("de"), pytest.raises(Conflict) as german:
        make_api_token(owner=expert, name="x", role="expert", days=2)
    with override("en"), pytest.raises(Conflict) as english:
        make_api_token(owner=expert, name="x", role="expert", days=2)
    assert str(german.value) != str(english.value)
    assert str(english.value) == "A token works for 1, 7, 30, 90, 365 days, not 2."


def test_nothing_that_is_stored_is_german(study: Study) -> None:
    job = rows.launch()
    with override("de"):
        capped = jobs.launch(
            JobRequest(
                name="Capped",
                contestants=["reference"],
                scenarios=["street-1"],
                cap_calls=5,
                cap_tokens=900,
            )
        )
        jobs.pause(capped)
        jobs.resume(capped, higher=Caps(cap_calls=50))
        rows.leased(rows.only_row(job)).settle(rows.failed(), now=rows.NOON)
        invite(study=study, expert=study.experts.get(username="eva"))
        hand_over(study=study, username="eva", to=["finn"])
        snapshot = plan_snapshot(study=study, early=True, filters=Filters(experts=("nobody",)))
        RATINGS.perform(snapshot.pk)
    snapshot.refresh_from_db()
    assert snapshot.state == Snapshot.State.FAILED
    assert snapshot.reason.startswith("Unknown expert 'nobody'. Known: ")
    raised = Event.objects.get(verb="resume")
    assert raised.before == {"state": "paused", "cap": "5 calls, 900 tokens"}
    assert raised.after is not None
    assert raised.after["cap"] == "50 calls, 900 tokens"
    kept = " ".join(str((line.before, line.after)) for line in Event.objects.all())
    assert not any(word in kept for word in ("Aufrufe", "Studie", "„", "unbekannt"))
