"""Resources are the pages' own: same services, roles and bytes; lists in pages with ETags."""

from typing import Any

import pytest
from django.contrib.auth.models import User
from django.db import connection
from django.test import Client
from django.test.utils import CaptureQueriesContext
from django.urls import reverse

from arena.models import Invitation, Snapshot
from arena.people.links import revoke
from arena.people.services import make_first_link_token
from arena.results.services.ratings import open_early
from arena.results.services.ratings import rate_now as rate
from arena.site.api_urls import urlpatterns
from arena.studies.services.opening import close_study
from augment.models import Contestant, Event, GenerationJob
from augment.services.endpoints import (
    ContestantRequest,
    EndpointRequest,
    add_contestant,
    ensure_endpoint,
)
from tests.api.asking import error_of
from tests.api.tokens import program, program_of
from tests.jobs import rows
from tests.opening import open_study
from tests.study_rows import a_study, contestant, expert, matchups_of, picture, scenario, vote
from tests.web.cast import people, signed_in, world

pytestmark = pytest.mark.django_db

OF_EXPERTS = {
    *("api-first", "api-welcome", "api-studies", "api-matchups"),
    *("api-picture", "api-preferences", "api-reports", "api-votes"),
}
API = "/api/v1/"


def send(client: Client, path: str, **body: object) -> Any:
    return client.post(API + path, body, content_type="application/json")


def slugs(page: Any) -> list[str]:
    return [row["slug"] for row in page.json()["results"]]


# --- Lists -------------------------------------------------------------------------------------


def test_pages_lose_no_row_and_repeat_none_while_rows_are_added() -> None:
    study = a_study()
    asking = program_of(people()["researcher"])
    first = asking.get(API + "scenarios", {"limit": 4})
    study.scenarios.filter(slug="place-0").update(slug="a-new-first-one")
    second = asking.get(first.json()["next"])
    assert slugs(first) == ["place-0", "place-1", "place-2", "place-3"]
    assert slugs(second) == ["place-4", "place-5"]
    assert second.json()["next"] is None


def test_what_has_not_changed_is_304_and_what_has_is_not() -> None:
    job = rows.launch(scenarios=2, contestants=("reference",))
    asking = program_of(people()["researcher"])
    for path in ("jobs", f"jobs/{job.code}", f"jobs/{job.code}/progress"):
        tag = asking.get(API + path).headers["ETag"]
        again = asking.get(API + path, headers={"If-None-Match": tag})
        assert (again.status_code, again.content) == (304, b"")
    job.augmentations.update(state="failed", reason="x")
    assert asking.get(API + path, headers={"If-None-Match": tag}).status_code == 200


@pytest.mark.parametrize("path", ["jobs", "scenarios", "contestants", "studies"])
def test_a_list_asks_the_database_as_often_whatever_is_in_it(path: str) -> None:
    accounts = people()
    asking = program_of(accounts["admin"])
    rows.launch(scenarios=1, contestants=("reference",))
    study = a_study()
    few = _queries(asking, path)
    for number in range(3):
        expert(f"new-{number}")
        place, who = scenario(f"new-{number}"), contestant(f"new-{number}")
        picture(place, who)
    open_study(
        name="Round 2",
        contestants=list(study.contestants.values_list("slug", flat=True)),
        scenarios=[f"place-{number}" for number in range(6)],
        experts=["eva", "finn"],
        votes_per_expert=9,
        seed=1,
    )
    assert _queries(asking, path) == few


def _queries(client: Client, path: str) -> int:
    client.get(API + path)
    with CaptureQueriesContext(connection) as seen:
        assert client.get(API + path).status_code == 200
    return len(seen)


def test_a_contestant_is_told_in_full_to_staff_alone() -> None:
    ensure_endpoint(EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1"))
    add_contestant(
        ContestantRequest(
            slug="one", variant="otm", endpoint="here", model="m", options={"temperature": 0.7}
        )
    )
    accounts = people()
    address = reverse("api-contestants")
    assert signed_in(accounts["expert"]).get(address).status_code == 403
    (found,) = signed_in(accounts["researcher"]).get(address).json()["results"]
    assert (found["slug"], found["retired_at"]) == ("one", None)
    assert (found["options"], found["frozen_options"]) == ({"temperature": 0.7}, None)
    assert (found["endpoint"], found["model"], found["roles"]) == ("here", "m", {})


# --- Changes -----------------------------------------------------------------------------------


def test_a_job_is_launched_by_the_pages_own_service(
    django_capture_on_commit_callbacks: Any,
) -> None:
    rows.launch(scenarios=2, contestants=("reference",))
    asking = program_of(people()["admin"])
    known = slugs(asking.get(API + "scenarios"))
    chosen = {"contestants": ["reference"], "scenarios": known}
    assert send(asking, "jobs/estimate", **chosen).json()["rows"] == len(known)
    with django_capture_on_commit_callbacks() as later:
        answer = send(asking, "jobs", name="By API", samples=2, cap_calls=5, **chosen)
    assert answer.status_code == 201, answer.content
    assert len(later) == 1, "the messages are sent once all is written"
    job = GenerationJob.objects.get(code=answer.json()["code"])
    assert (job.name, job.samples, job.cap_calls) == ("By API", 2, 5)
    assert job.augmentations.count() == answer.json()["total"] == 2 * len(known)
    event = Event.objects.get(verb="launch", object_code=str(job.code))
    assert event.actor is not None


def test_links_let_in_once_and_only_with_a_password_that_holds() -> None:
    link = f"http://x/first/{make_first_link_token()}/"
    given = {"link": link, "username": "ada"}
    error_of(send(Client(), "first", **given, password="short"), 400, "refused")
    made = send(Client(), "first", **given, password="nine lives of a cat")
    admin = program(made.json()["token"])
    error_of(send(Client(), "first", **given, password="nine lives of a cat"), 410, "link_over")
    grace = send(admin, "people", username="grace", role="researcher").json()
    invited = {"link": grace["link"], "password": "a bird in the hand"}
    for weak in ({"link": grace["link"]}, invited | {"password": "1"}):
        error_of(send(Client(), "welcome", **weak), 400, "refused")
    researcher = program(send(Client(), "welcome", **invited).json()["token"])
    assert researcher.get(API + "jobs").status_code == 200
    error_of(send(Client(), "welcome", **invited), 410, "link_over")
    assert User.objects.get(username="grace").check_password("a bird in the hand")
    eva = send(admin, "people", username="eva", role="expert").json()
    expert = program(send(Client(), "welcome", link=eva["link"]).json()["token"])
    assert expert.get(API + "studies").status_code == 200
    assert expert.get(API + "jobs").status_code == 403
    revoke(invitation=Invitation.objects.get())
    assert expert.get(API + "studies").status_code == 401
    error_of(send(Client(), "welcome", link=eva["link"]), 410, "link_over")


# --- Blindness ---------------------------------------------------------------------------------


def address(name: str) -> str:
    here = {"code": "9e107d9d-372b-4682-86d0-5c1f9f3b2b1e", "name": "tool-calls", "form": "csv"}
    found = next(pattern for pattern in urlpatterns if pattern.name == name)
    wanted = found.pattern.converters
    return reverse(name, kwargs={part: here.get(part, "x") for part in wanted})


def test_an_expert_is_refused_everywhere_else_before_anything_is_looked_up() -> None:
    asking = program_of(people()["expert"])
    for pattern in urlpatterns:
        assert pattern.name is not None
        if pattern.name not in OF_EXPERTS:
            for method in (asking.get, asking.post):
                status = method(address(pattern.name)).status_code
                assert status in (403, 405), (pattern.name, status)


def test_an_experts_studies_tell_of_no_contestant() -> None:
    here = world()
    expert = program_of(here.expert)
    answer = expert.get(API + "studies")
    (line,) = answer.json()["results"]
    assert (line["planned"], line["voted"], line["left"]) == (9, 0, 9)
    of_both = {"code", "name", "state", "opened_at", "closed_at"}
    assert set(line) == of_both | {"planned", "voted", "skipped", "left"}
    assert program_of(people()["expert"]).get(API + "studies").json()["results"] == []


def test_a_researcher_reads_and_rates_and_changes_nothing_else() -> None:
    here = world()
    researcher = program_of(people()["researcher"])
    for path in ("jobs", f"studies/{here.study.code}/close", "people", "endpoints"):
        error_of(send(researcher, path), 403, "forbidden")
    close_study(study=here.study)
    assert send(researcher, f"studies/{here.study.code}/snapshots", rounds=100).status_code == 201


def test_results_of_an_open_study_need_an_early_look() -> None:
    here, accounts = world(), people()
    snapshot = rate(study=here.study, rounds=20, early=True)
    asking, rating = program_of(accounts["researcher"]), f"studies/{here.study.code}/snapshots"
    paths = [f"snapshots/{snapshot.code}", f"snapshots/{snapshot.code}/exports/leaderboard.csv"]
    for path in paths:
        error_of(asking.get(API + path), 403, "study_still_open")
    error_of(send(asking, rating), 403, "study_still_open")
    assert Snapshot.objects.count() == 1
    open_early(study=here.study, actor=accounts["researcher"])
    for path in paths:
        assert asking.get(API + path).status_code == 200
    assert send(asking, rating, rounds=100).json()["is_early"] is True
    error_of(program_of(accounts["admin"]).get(API + paths[0]), 403, "study_still_open")


def test_a_program_of_an_expert_sees_the_pictures_of_its_own_pairs_alone() -> None:
    here = world()
    own = here.study.matchups.filter(expert=here.expert)[0]
    other = here.study.matchups.exclude(expert=here.expert)[0]
    expert = program_of(here.expert)
    (pair, *_) = expert.get(API + "matchups", {"study": str(here.study.code)}).json()
    token = pair["a"].rpartition("/")[2]
    assert token == own.left_token
    picture = expert.get(f"{API}pictures/{token}")
    assert picture.content.startswith(b"\x89PNG")
    assert "ETag" not in picture.headers, "it would tell which pictures are alike"
    error_of(expert.get(f"{API}pictures/{other.left_token}"), 404, "not_found")


# --- Files -------------------------------------------------------------------------------------


def test_files_have_the_bytes_of_the_pages() -> None:
    here, admin = world(), people()["admin"]
    for matchup in matchups_of(here.study, "eva"):
        vote(matchup, "left")
    snapshot = rate(study=close_study(study=here.study), rounds=20)
    asking, page = program_of(admin), signed_in(admin)
    for name, form in (("leaderboard", "latex"), ("votes", "csv"), ("pairs", "svg")):
        program_file = asking.get(f"{API}snapshots/{snapshot.code}/exports/{name}.{form}")
        shown = page.get(f"/studies/{here.study.code}/rating/{name}.{form}")
        assert program_file.content == shown.content
        assert program_file.headers["Content-Type"] == shown.headers["Content-Type"]
    missing = asking.get(f"{API}snapshots/{snapshot.code}/exports/leaderboard.docx")
    error_of(missing, 404, "not_found")
    table = asking.get(f"{API}snapshots/{snapshot.code}").json()["table"]
    assert {row["slug"] for row in table["rows"]} == set(
        Contestant.objects.filter(studies=here.study).values_list("slug", flat=True)
    )
