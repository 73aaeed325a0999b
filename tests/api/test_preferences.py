"""POST /api/v1/preferences: how somebody votes, kept on the account."""

from typing import Any

import pytest
from django.contrib.auth.models import User
from django.test import Client

from arena.voting.queries.keys import voting_preferences
from tests.study_rows import expert

pytestmark = [pytest.mark.django_db, pytest.mark.urls("tests.api.urls")]


@pytest.fixture
def eva() -> User:
    return expert("eva")


def post(user: User, body: object) -> Any:
    client = Client()
    client.force_login(user)
    return client.post("/api/v1/preferences", body, content_type="application/json")


def test_a_key_of_ones_own_replaces_the_usual_ones_and_nothing_else_has_it(eva: User) -> None:
    keys = post(eva, {"keys": {"a": "J", "zoom": "e"}}).json()["keys"]
    assert (keys["a"], keys["zoom"], keys["e"]) == (["j"], ["e"], ["2"])
    assert keys["b"] == ["3", "b"]
    assert voting_preferences(eva).keys == keys


@pytest.mark.parametrize(
    "keys",
    [{"a": "x", "b": "x"}, {"a": "s"}, {"a": ""}, {"a": " "}, {"a": "ab"}, {"fly": "x"}, {"a": 1}],
)
def test_keys_that_can_not_be_told_apart_are_refused_and_nothing_is_kept(
    eva: User, keys: dict[str, str]
) -> None:
    answer = post(eva, {"keys": keys, "legend": False})
    assert answer.status_code == 422
    assert "keys" in answer.json()["error"]["fields"]
    assert voting_preferences(eva).as_json()["legend"] is True


def test_nobody_signed_in_has_preferences() -> None:
    answer = Client().post("/api/v1/preferences", {}, content_type="application/json")
    assert answer.status_code == 401
