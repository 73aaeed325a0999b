"""POST /api/v1/preferences: how somebody votes, kept on the account."""

from typing import Any

import pytest
from django.contrib.auth.models import User
from django.test import Client

from arena.voting.queries.keys import voting_switches
from tests.study_rows import expert

pytestmark = [pytest.mark.django_db, pytest.mark.urls("tests.api.urls")]


@pytest.fixture
def eva() -> User:
    return expert("eva")


def post(user: User, body: object) -> Any:
    client = Client()
    client.force_login(user)
    return client.post("/api/v1/preferences", body, content_type="application/json")


def test_a_switch_is_kept_and_the_others_stay(eva: User) -> None:
    assert post(eva, {"legend": False}).json()["legend"] is False
    assert post(eva, {"keep_zoom": True}).json() == voting_switches(eva)
    usual = {"single_keys": True, "rings": True}
    assert voting_switches(eva) == {**usual, "legend": False, "keep_zoom": True}
    assert post(eva, {"legend": "no"}).status_code == 422


def test_nobody_signed_in_has_preferences() -> None:
    answer = Client().post("/api/v1/preferences", {}, content_type="application/json")
    assert answer.status_code == 401
