"""Sessions are Django's own, read by a query of ours."""

from __future__ import annotations

from datetime import timedelta

import pytest
from django.contrib.sessions.models import Session
from django.test import Client
from django.urls import reverse
from django.utils import timezone
from pytest_django import DjangoAssertNumQueries

from arena.config.sessions import SessionStore
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def is_let_in(client: Client) -> bool:
    return client.get(reverse("home")).status_code == 200


def test_a_session_that_is_over_lets_nobody_in() -> None:
    client = signed_in(people()["expert"])
    assert is_let_in(client)
    Session.objects.update(expire_date=timezone.now() - timedelta(seconds=1))
    assert not is_let_in(client)


def test_a_session_that_was_deleted_lets_nobody_in() -> None:
    client = signed_in(people()["expert"])
    Session.objects.all().delete()
    assert not is_let_in(client)


def test_what_was_written_is_read_by_one_query(
    django_assert_num_queries: DjangoAssertNumQueries,
) -> None:
    written = SessionStore()
    written["colour"] = "green"
    written.create()
    written.save()
    with django_assert_num_queries(1):
        assert SessionStore(written.session_key)["colour"] == "green"


def test_a_key_that_nobody_was_given_is_not_taken_over() -> None:
    found = SessionStore("a" * 32)
    assert found.get("colour") is None
    found["colour"] = "green"
    found.save()
    assert found.session_key != "a" * 32
