"""Requests that the API refuses, all in one shape."""

import pytest
from django.contrib.auth.models import Group, User
from django.test import Client

from arena.models import Study, Vote
from tests.api.asking import body_for, error_of, post, signed_in
from tests.study_rows import matchups_of

pytestmark = [pytest.mark.django_db, pytest.mark.urls("tests.api.urls")]


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
        ({"outcome": "skip"}, "reason"),
        ({"outcome": "skip", "reason": "bored"}, "reason"),
        ({"reason": "unclear"}, "reason"),
        ({"reason": "\ud800"}, "reason"),
        ({"\ud800": 1}, "\ud800"),
        ({"both_miss": True}, "both_miss"),
        ({"outcome": "E", "both_miss": True}, "both_miss"),
        ({"both_miss": 1}, "both_miss"),
        ({"comment": "x" * 1001}, "comment"),
        ({"comment": 5}, "comment"),
        ({"aids": ["glasses"]}, "aids"),
        ({"aids": ["replay"]}, "aids"),
        ({"aids": "zoom"}, "aids"),
        ({"n": 0}, "n"),
        ({"n": 13}, "n"),
    ],
)
def test_a_bad_body_answers_422_with_the_field(
    study: Study, changes: dict[str, object], field: str
) -> None:
    body = {**body_for(matchups_of(study, "eva")[0]), **changes}
    error = error_of(post(signed_in("eva"), body), 422, "invalid")
    assert list(error["fields"]) == [field]
    assert not Vote.objects.exists()


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


@pytest.mark.parametrize("role", ["researcher", "admin"])
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
