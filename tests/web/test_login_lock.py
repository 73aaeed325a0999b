"""Wrong passwords lock an account for the address they came from, and for nobody else."""

import pytest
from axes.models import AccessAttempt
from django.conf import LazySettings
from django.http import HttpResponse
from django.test import Client, RequestFactory
from django.urls import reverse

from arena.config.login import client_address
from tests.web.cast import people

pytestmark = pytest.mark.django_db


def attempt(password: str, username: str = "the-expert", **headers: str) -> HttpResponse:
    sent = {"username": username, "password": password}
    return Client().post(reverse("login"), sent, **headers)  # type: ignore[arg-type,return-value]


def test_five_wrong_passwords_lock_the_account_and_the_page_says_for_how_long() -> None:
    people()
    assert [attempt("wrong").status_code for _ in range(5)] == [200, 200, 200, 200, 429]
    answer = attempt("a password")
    page = " ".join(answer.content.decode().split())
    assert answer.status_code == 429
    assert "Too many wrong passwords" in page
    assert "for 15 minutes" in page


def test_a_name_that_no_account_can_have_is_not_stored() -> None:
    assert attempt("wrong", 151 * "x").status_code == 200
    assert not AccessAttempt.objects.exists()


def test_others_and_other_places_are_not_locked() -> None:
    people()
    for _ in range(5):
        attempt("wrong")
    assert attempt("a password", "the-researcher").status_code == 302
    assert attempt("a password", REMOTE_ADDR="192.0.2.7").status_code == 302


def test_a_right_password_wipes_the_count() -> None:
    people()
    for _ in range(2):
        assert [attempt("wrong").status_code for _ in range(4)] == [200] * 4
        assert attempt("a password").status_code == 302


def test_an_address_that_tries_one_account_after_the_other_is_locked_as_a_whole(
    settings: LazySettings,
) -> None:
    people()
    settings.ADDRESS_FAILURE_LIMIT = 6
    tried = [attempt("wrong", f"name-{number}").status_code for number in range(6)]
    assert tried == [200] * 5 + [429]
    assert attempt("a password").status_code == 429
    assert attempt("a password", REMOTE_ADDR="192.0.2.7").status_code == 302


def test_an_account_of_ones_own_does_not_wipe_the_count_of_the_address(
    settings: LazySettings,
) -> None:
    people()
    settings.ADDRESS_FAILURE_LIMIT = 6
    for number in range(5):
        assert attempt("wrong", f"name-{number}").status_code == 200
        assert attempt("a password").status_code == 302
    assert attempt("wrong", "name-5").status_code == 429


def test_a_made_up_header_does_not_open_the_lock() -> None:
    people()
    for number in range(5):
        answer = attempt("wrong", HTTP_X_FORWARDED_FOR=f"192.0.2.{number}")
    assert answer.status_code == 429


@pytest.mark.parametrize(
    ("proxies", "header", "expected"),
    [
        (0, "192.0.2.7", "127.0.0.1"),
        (1, "made up, 192.0.2.7", "192.0.2.7"),
        (2, "203.0.113.9, 192.0.2.7, 10.0.0.1", "192.0.2.7"),
        (2, "192.0.2.7", "127.0.0.1"),
        (1, "", None),
        (1, "unknown", None),
        (1, "2001:db8:1:2:3:4:5:6", "2001:db8:1:2::"),
        (1, "::ffff:192.0.2.7", "192.0.2.7"),
    ],
)
def test_the_address_is_the_one_that_our_own_proxies_saw(
    settings: LazySettings, proxies: int, header: str, expected: str | None
) -> None:
    settings.PROXIES = proxies
    request = RequestFactory().get("/", HTTP_X_FORWARDED_FOR=header)
    assert client_address(request) == expected
