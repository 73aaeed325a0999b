"""Tokens: made and revoked on a page, kept as a hash, never more than their owner."""

from datetime import timedelta

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse
from django.utils import timezone
from pytest_django import DjangoAssertNumQueries

from arena.api import access as tokens
from arena.api.access import make_api_token
from arena.models import ApiToken
from arena.people.services import set_active, set_role
from arena.shell.accounts import effective_role
from augment.errors import UnknownName
from tests.api.asking import error_of
from tests.api.tokens import program, program_of, secret_of
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

STUDIES = "/api/v1/studies"


def role_at(client: Client) -> str | None:
    """What the API lets a client do."""
    if client.get(STUDIES).status_code != 200:
        return None
    if client.post(reverse("api-people")).status_code == 415:
        return "admin"
    return "researcher" if client.get(reverse("api-jobs")).status_code == 200 else "expert"


def test_the_page_shows_a_new_token_once_and_keeps_only_its_hash() -> None:
    admin = people()["admin"]
    page = signed_in(admin)
    given = {"name": "nightly export", "role": "researcher", "days": "7"}
    shown = page.post(reverse("api-tokens"), given).content.decode()
    row = ApiToken.objects.get()
    secret = shown.partition('id="secret" value="')[2].partition('"')[0]
    assert secret.startswith(tokens.PREFIX)
    assert role_at(program(secret)) == "researcher"
    stored = [str(value) for value in ApiToken.objects.values_list().get()]
    assert not any(secret in value for value in stored)
    listed = page.get(reverse("api-tokens")).content.decode()
    assert "nightly export" in listed
    assert secret not in listed
    assert row.expires_at - row.made_at == pytest.approx(
        timedelta(days=7), abs=timedelta(minutes=1)
    )


def test_nobody_revokes_somebody_elses() -> None:
    accounts = people()
    secret = secret_of(accounts["researcher"])
    token = ApiToken.objects.get()
    answer = signed_in(accounts["admin"]).post(reverse("api-token-revoke", args=[token.code]))
    assert answer.status_code == 404
    assert role_at(program(secret)) == "researcher"


def test_no_token_has_more_than_its_owner_and_staff_never_an_experts() -> None:
    accounts = people()
    for owner, role in {"researcher": "admin", "expert": "researcher", "admin": "expert"}.items():
        with pytest.raises(UnknownName):
            make_api_token(owner=accounts[owner], name="x", role=role, days=1)


@pytest.mark.parametrize(
    ("role", "owner", "opens"),
    [
        ("admin", "admin", "admin"),
        ("researcher", "admin", "researcher"),
        ("admin", "researcher", "researcher"),
        ("researcher", "researcher", "researcher"),
        ("admin", "expert", None),
        ("researcher", "expert", None),
        ("expert", "expert", "expert"),
        ("expert", "researcher", None),
        ("expert", "admin", None),
        ("admin", None, None),
    ],
)
def test_what_a_token_opens_follows_its_owner(
    role: str, owner: str | None, opens: str | None
) -> None:
    assert effective_role(role, owner) == opens


def test_a_demoted_owners_token_is_demoted_with_them() -> None:
    accounts = people()
    asking = program_of(accounts["admin"])
    assert role_at(asking) == "admin"
    another = api_admin()
    set_role(user=accounts["admin"], role="researcher", actor=another)
    assert role_at(asking) == "researcher"
    set_role(user=accounts["admin"], role="expert", actor=another)
    assert role_at(asking) is None


def api_admin() -> User:
    return User.objects.create_superuser("another")


def test_a_token_ends_at_its_time_or_when_its_owner_is_paused() -> None:
    accounts = people()
    asking, other = program_of(accounts["expert"]), program_of(accounts["researcher"])
    ApiToken.objects.update(expires_at=timezone.now() + timedelta(seconds=60))
    assert role_at(asking) == "expert"
    set_active(user=accounts["researcher"], is_active=False, actor=accounts["admin"])
    error_of(other.get(STUDIES), 401, "signed_out")
    ApiToken.objects.update(expires_at=timezone.now())
    error_of(asking.get(STUDIES), 401, "signed_out")


def test_a_wrong_token_is_401_even_beside_a_session() -> None:
    client = signed_in(people()["admin"])
    for header in ("Bearer", "Bearer ", "Bearer nonsense", "bearer arena_x"):
        answer = client.get(STUDIES, headers={"Authorization": header})
        error_of(answer, 401, "signed_out")
        assert answer.headers["WWW-Authenticate"] == "Bearer", header


def test_a_token_needs_no_csrf_token_and_a_session_does() -> None:
    admin = people()["admin"]
    person = {"username": "grace", "role": "expert"}
    browser = Client(enforce_csrf_checks=True)
    browser.force_login(admin)
    url = reverse("api-people")
    error_of(browser.post(url, person, content_type="application/json"), 403, "forbidden")
    made = program_of(admin).post(url, person, content_type="application/json")
    assert made.status_code == 201, made.content


def test_use_is_remembered_and_limited_by_role(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(tokens.REQUESTS, "expert", 3)
    accounts = people()
    asking, other = program_of(accounts["expert"]), program_of(accounts["researcher"])
    assert ApiToken.objects.exclude(last_used_at=None).count() == 0
    assert [asking.get(STUDIES).status_code for _ in range(4)] == [200, 200, 200, 429]
    refused = asking.get(STUDIES)
    error_of(refused, 429, "too_many_requests")
    assert refused.headers["Retry-After"] == "60"
    assert other.get(STUDIES).status_code == 200, "another token has its own count"
    ApiToken.objects.update(window_began_at=timezone.now() - timedelta(seconds=61))
    assert asking.get(STUDIES).status_code == 200, "a new window"
    assert ApiToken.objects.exclude(last_used_at=None).count() == 2


def test_a_request_is_counted_by_one_statement_so_that_none_between_is_refused(
    django_assert_num_queries: DjangoAssertNumQueries,
) -> None:
    secret = secret_of(people()["researcher"])
    role_at(program(secret))
    for began in (None, timezone.now() - timedelta(seconds=61), timezone.now()):
        ApiToken.objects.update(window_began_at=began)
        with django_assert_num_queries(3):  # the token with its owner, their roles, the count
            tokens.use_api_token(secret)
