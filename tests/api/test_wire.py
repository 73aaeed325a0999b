from __future__ import annotations

import uuid
from typing import Any

import pytest
from django.contrib.auth.models import Group, User
from django.test import Client
from pytest_django import DjangoAssertNumQueries

from arena.models import Study, Vote
from arena.services.studies import close_study
from augment.models import Contestant, GenerationJob
from tests.study_rows import a_study, expert, matchups_of, vote

pytestmark = [pytest.mark.django_db, pytest.mark.urls("tests.api.urls")]


@pytest.fixture
def study() -> Study:
    return a_study()


def signed_in(username: str) -> Client:
    client = Client()
    client.force_login(User.objects.get(username=username))
    return client


def post(client: Client, body: object) -> Any:
    return client.post("/api/v1/votes", body, content_type="application/json")


def body_for(given: Any, letter: str = "A", **more: object) -> dict[str, object]:
    return {"key": str(uuid.uuid4()), "matchup": str(given.code), "outcome": letter, **more}


def error_of(response: Any, status: int, code: str) -> dict[str, Any]:
    """The one shape of every error."""
    assert response.status_code == status, response.content
    assert list(response.json()) == ["error"]
    error: dict[str, Any] = response.json()["error"]
    assert error["code"] == code
    assert error["message"]
    return error


def test_the_next_matchups_have_tokens_and_nothing_else(study: Study) -> None:
    response = signed_in("eva").get(f"/api/v1/matchups?study={study.code}")
    mine = matchups_of(study, "eva")[:4]
    assert response.json() == [
        {
            "matchup": str(matchup.code),
            "position": matchup.position,
            "instruction": matchup.scenario.instruction,
            "a": f"/i/{matchup.left_token}",
            "b": f"/i/{matchup.right_token}",
        }
        for matchup in mine
    ]
    assert "no-store" in response["Cache-Control"]
    assert all(matchup.served_at for matchup in matchups_of(study, "eva")[:4])


def test_n_asks_for_fewer_or_more(study: Study) -> None:
    client = signed_in("eva")
    assert len(client.get(f"/api/v1/matchups?study={study.code}&n=1").json()) == 1
    assert len(client.get(f"/api/v1/matchups?study={study.code}&n=12").json()) == 9


@pytest.mark.parametrize(("letter", "stored"), [("A", "left"), ("E", "equal"), ("B", "right")])
def test_a_vote_is_stored_and_answered_with_what_comes_next(
    study: Study, letter: str, stored: str
) -> None:
    first, second, *_ = matchups_of(study, "eva")
    answer = post(signed_in("eva"), body_for(first, letter, ms_visible=5100)).json()
    assert answer["saved"] == 1
    assert answer["next"][0]["matchup"] == str(second.code)
    assert len(answer["next"]) == 4
    kept = Vote.objects.get()
    assert (kept.matchup, kept.outcome, kept.ms_visible) == (first, stored, 5100)


def test_the_same_key_again_is_answered_the_same(study: Study) -> None:
    body = body_for(matchups_of(study, "eva")[0])
    client = signed_in("eva")
    first, again = post(client, body), post(client, body)
    assert (again.status_code, again.json()) == (200, first.json())
    assert Vote.objects.count() == 1


def test_a_decided_matchup_answers_409_with_the_stored_letter(study: Study) -> None:
    matchup = matchups_of(study, "eva")[0]
    vote(matchup, "right")
    error = error_of(post(signed_in("eva"), body_for(matchup)), 409, "already_decided")
    assert error["outcome"] == "B"


def test_a_change_names_the_vote_that_it_supersedes(study: Study) -> None:
    matchup = matchups_of(study, "eva")[0]
    first = vote(matchup, "right")
    changed = post(signed_in("eva"), body_for(matchup, "E", supersedes=str(first.key)))
    assert changed.json()["saved"] == 1
    assert Vote.objects.count() == 2


def test_somebody_elses_matchup_answers_404_like_one_that_does_not_exist(study: Study) -> None:
    theirs = matchups_of(study, "finn")[0]
    client = signed_in("eva")
    real = error_of(post(client, body_for(theirs)), 404, "not_found")
    body = body_for(theirs, matchup=str(uuid.uuid4()))
    assert error_of(post(client, body), 404, "not_found") == real
    assert not Vote.objects.exists()


def test_a_study_of_others_answers_404(study: Study) -> None:
    expert("gus")
    for code in (study.code, uuid.uuid4()):
        error_of(signed_in("gus").get(f"/api/v1/matchups?study={code}"), 404, "not_found")


def test_a_closed_study_answers_410_and_still_confirms_what_it_has(study: Study) -> None:
    first, second, *_ = matchups_of(study, "eva")
    client = signed_in("eva")
    body = body_for(first)
    post(client, body)
    close_study(study=study)
    error_of(post(client, body_for(second)), 410, "study_not_open")
    error_of(client.get(f"/api/v1/matchups?study={study.code}"), 410, "study_not_open")
    assert post(client, body).json() == {"saved": 1, "next": []}


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"outcome": "left"}, "outcome"),
        ({"outcome": None}, "outcome"),
        ({"key": "1"}, "key"),
        ({"key": 5}, "key"),
        ({"matchup": 5}, "matchup"),
        ({"supersedes": 5}, "supersedes"),
        ({"matchup": None}, "matchup"),
        ({"supersedes": "x"}, "supersedes"),
        ({"ms_visible": -1}, "ms_visible"),
        ({"ms_visible": "12"}, "ms_visible"),
        ({"ms_visible": 2**31}, "ms_visible"),
        ({"expert": "finn"}, "expert"),
    ],
)
def test_a_bad_body_answers_422_with_the_field(
    study: Study, changes: dict[str, object], field: str
) -> None:
    body = {**body_for(matchups_of(study, "eva")[0]), **changes}
    error = error_of(post(signed_in("eva"), body), 422, "invalid")
    assert list(error["fields"]) == [field]
    assert not Vote.objects.exists()


@pytest.mark.parametrize("raw", ["{", "[]", '"text"', "null", "3"])
def test_a_body_that_is_no_object_answers_422(study: Study, raw: str) -> None:
    response = signed_in("eva").post("/api/v1/votes", raw, content_type="application/json")
    assert "body" in error_of(response, 422, "invalid")["fields"]


def test_a_body_too_deep_or_too_long_to_read_is_refused(study: Study) -> None:
    client = signed_in("eva")
    error = error_of(post(client, "[" * 100_000), 422, "invalid")
    assert "nested too deeply" in error["fields"]["body"][0]
    error_of(post(client, '{"key": "' + "x" * 3_000_000 + '"}'), 413, "too_large")


@pytest.mark.parametrize(
    "query", ["", "study=x", "study={code}&n=0", "study={code}&n=x", "study={code}&m=1"]
)
def test_a_bad_question_answers_422(study: Study, query: str) -> None:
    address = f"/api/v1/matchups?{query.format(code=study.code)}"
    assert error_of(signed_in("eva").get(address), 422, "invalid")["fields"]


def test_without_a_session_the_answer_is_401(study: Study) -> None:
    client = Client()
    error_of(client.get(f"/api/v1/matchups?study={study.code}"), 401, "signed_out")
    error_of(post(client, body_for(matchups_of(study, "eva")[0])), 401, "signed_out")


@pytest.mark.parametrize("role", ["analyst", "admin"])
def test_who_was_given_another_role_no_longer_votes(study: Study, role: str) -> None:
    User.objects.get(username="eva").groups.add(Group.objects.get_or_create(name=role)[0])
    client = signed_in("eva")
    error_of(post(client, body_for(matchups_of(study, "eva")[0])), 403, "forbidden")
    error_of(client.get(f"/api/v1/matchups?study={study.code}"), 403, "forbidden")
    assert not Vote.objects.exists()


def test_a_vote_from_another_site_answers_403(study: Study) -> None:
    client = Client(enforce_csrf_checks=True)
    matchup = matchups_of(study, "eva")[0]
    client.force_login(matchup.expert)
    error_of(post(client, body_for(matchup)), 403, "forbidden")


def test_other_methods_and_forms_are_refused_in_the_same_shape(study: Study) -> None:
    client = signed_in("eva")
    error_of(client.get("/api/v1/votes"), 405, "method_not_allowed")
    error_of(client.post("/api/v1/votes", {"key": "1"}), 415, "unsupported_media_type")


def test_no_answer_betrays_a_contestant() -> None:
    study = a_study(contestants=("ann-otm", "bob-tqa", "cid-vqa"))
    client = signed_in("eva")
    secrets = {str(value) for row in Contestant.objects.values() for value in row.values()}
    secrets |= set(GenerationJob.objects.values_list("name", flat=True))
    for matchup in study.matchups.select_related("left", "right"):
        for side in (matchup.left, matchup.right):
            secrets |= {str(side.code), side.image}
    secrets = {text for text in secrets if len(text) > 4}
    said = [client.get(f"/api/v1/matchups?study={study.code}&n=9").content.decode()]
    for matchup in matchups_of(study, "eva"):
        said.append(post(client, body_for(matchup)).content.decode())
        said.append(post(client, body_for(matchup)).content.decode())
    assert [text for text in secrets if any(text in answer for answer in said)] == []


def test_a_vote_on_the_wire_costs_few_queries(
    study: Study, django_assert_max_num_queries: DjangoAssertNumQueries
) -> None:
    client = signed_in("eva")
    body = body_for(matchups_of(study, "eva")[0])
    with django_assert_max_num_queries(14):
        post(client, body)
