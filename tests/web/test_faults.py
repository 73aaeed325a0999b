"""Pages of faults look like the product, and nothing on any page is inline."""

import sqlite3

import pytest
from django.db import OperationalError
from django.test import Client, RequestFactory
from pytest_django import DjangoAssertNumQueries

from arena.config.faults import answer_broken
from arena.config.middleware import FaultMiddleware
from tests.web.cast import people, signed_in


@pytest.mark.django_db
def test_a_missing_page_is_said_in_the_products_own_words() -> None:
    answer = signed_in(people()["expert"]).get("/nowhere/")
    assert answer.status_code == 404
    assert "There is nothing here" in answer.content.decode()


@pytest.mark.django_db
@pytest.mark.parametrize(
    "address",
    [
        *(
            "/enrol/a%00b/",
            "/i/%00",
            "/shared/%00/",
            "/shared/boards/%00/",
            "/api/v1/pictures/%00",
        ),
        *("/contestants/new/?model=%00", "/scenarios/?q=a%00"),
    ],
)
def test_the_database_is_never_asked_for_what_postgresql_has_no_text_for(
    address: str, django_assert_num_queries: DjangoAssertNumQueries
) -> None:
    with django_assert_num_queries(0):
        assert Client().get(address).status_code == 404


@pytest.mark.django_db
def test_a_refused_page_is_said_in_the_products_own_words() -> None:
    answer = signed_in(people()["expert"]).get("/jobs/")
    assert "not for your account" in answer.content.decode()


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


@pytest.mark.django_db
def test_a_page_allows_nothing_but_its_own_files() -> None:
    policy = signed_in(people()["expert"]).get("/").headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
