"""POST /api/v1/preferences: how somebody votes, kept on the account."""

from __future__ import annotations

from typing import Any

import pytest
from django.contrib.auth.models import User
from django.test import Client

from arena.queries.profiles import Theme
from arena.queries.voting_keys import USUAL_KEYS, voting_preferences
from arena.services.preferences import choose_theme
from tests.study_rows import expert

pytestmark = [pytest.mark.django_db, pytest.mark.urls("tests.api.urls")]


@pytest.fixture
def eva() -> User:
    return expert("eva")


def post(user: User, body: object) -> Any:
    client = Client()
    client.force_login(user)
    return client.post("/api/v1/preferences", body, content_type="application/json")


def test_at_first_everything_is_as_usual(eva: User) -> None:
    answer = post(eva, {})
    assert answer.status_code == 200
    assert answer.json() == {
        "keys": {action: list(keys) for action, keys in USUAL_KEYS.items()},
        "single_keys": True,
        "legend": True,
        "keep_zoom": False,
    }


def test_what_is_named_changes_and_the_rest_stays(eva: User) -> None:
    choose_theme(user=eva, theme=Theme.DARK)
    post(eva, {"legend": False})
    answer = post(eva, {"single_keys": False}).json()
    assert (answer["legend"], answer["single_keys"], answer["keep_zoom"]) == (False, False, False)
    eva.person.refresh_from_db()
    assert eva.person.preferences["theme"] == "dark"


def test_a_key_of_ones_own_replaces_the_usual_ones_and_nothing_else_has_it(eva: User) -> None:
    keys = post(eva, {"keys": {"a": "J", "zoom": "e"}}).json()["keys"]
    assert (keys["a"], keys["zoom"], keys["e"]) == (["j"], ["e"], ["2"])
    assert keys["b"] == ["3", "b"]
    assert voting_preferences(eva).keys == keys


def test_the_key_of_what_only_some_studies_have_gives_way_to_a_chosen_one(eva: User) -> None:
    keys = post(eva, {"keys": {"zoom": "t"}}).json()["keys"]
    assert (keys["zoom"], keys["text"]) == (["t"], [])
    keys = post(eva, {"keys": {"zoom": "t", "text": "x"}}).json()["keys"]
    assert (keys["zoom"], keys["text"]) == (["t"], ["x"])
    refused = post(eva, {"keys": {"zoom": "t", "text": "t"}})
    assert refused.status_code == 422
    said = refused.json()["error"]["fields"]["keys"]
    assert "'t' would do two things: Zoom, Text description." in said


def test_a_page_without_the_text_leaves_its_key_alone_unless_it_gives_it_away(eva: User) -> None:
    shown = {action: keys[0] for action, keys in USUAL_KEYS.items() if action != "text"}
    post(eva, {"keys": {**shown, "text": "k"}})
    assert post(eva, {"keys": {**shown, "zoom": "y"}}).json()["keys"]["text"] == ["k"]
    assert post(eva, {"keys": {**shown, "zoom": "k"}}).json()["keys"]["text"] == ["t"]


def test_the_usual_keys_come_back(eva: User) -> None:
    post(eva, {"keys": {"a": "j"}})
    assert post(eva, {"keys": {}}).json()["keys"]["a"] == ["1", "a"]


def test_keys_can_swap_places(eva: User) -> None:
    keys = post(eva, {"keys": {"a": "3", "b": "1"}}).json()["keys"]
    assert (keys["a"], keys["b"]) == (["3"], ["1"])


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


@pytest.mark.parametrize("body", [{"legend": 1}, {"loud": True}, {"keys": []}])
def test_what_is_no_preference_is_refused(eva: User, body: dict[str, object]) -> None:
    assert post(eva, body).status_code == 422


def test_nobody_signed_in_has_preferences() -> None:
    answer = Client().post("/api/v1/preferences", {}, content_type="application/json")
    assert answer.status_code == 401
