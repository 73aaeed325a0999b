"""Accounts and links without a shell: the first admin, invitations, locks, pauses, roles."""

import logging
import re
from collections.abc import Callable

import pytest
from axes.models import AccessAttempt
from django.conf import LazySettings
from django.contrib.auth.models import User
from django.contrib.sessions.models import Session
from django.http import HttpResponse
from django.test import Client, RequestFactory
from django.urls import reverse
from django.utils import timezone
from pytest_django import Settings

from arena.api.access import make_api_token
from arena.config.login import client_address
from arena.config.logs import HideKeys
from arena.models import Invitation, Study, Vote
from arena.people.links import invite
from arena.people.queries import find_admins
from arena.people.services import (
    LINK_LIVES_S,
    accept_welcome,
    create_person,
    make_first_link_token,
    make_welcome_token,
    set_active,
    set_role,
)
from arena.studies.services.taking_part import forget_identity
from augment.errors import Conflict
from augment.models import Event
from tests.study_rows import a_study, matchups_of, vote
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


PASSWORD = "nine lives of a cat"
TWICE = {"new_password1": PASSWORD, "new_password2": PASSWORD}


def can_sign_in(username: str, password: str) -> bool:
    answer = Client().post(reverse("login"), {"username": username, "password": password})
    return answer.status_code == 302


def first(token: str) -> int:
    """What the printed link answers to a name and a password."""
    given = {"code": token, "username": "eve", "password": PASSWORD}
    return Client().post(reverse("first", args=[token]), given).status_code


def test_an_empty_installation_opens_on_the_page_of_the_first_admin_once() -> None:
    token, client = make_first_link_token(), Client()
    shown = client.get("/", follow=True)
    assert shown.redirect_chain[-1][0] == reverse("first")
    for wrong in ({"password": "short"}, {"code": f"{token}x"}):
        given = {"code": f"http://x/first/{token}/", "username": "ada", "password": PASSWORD}
        assert client.post(reverse("first"), given | wrong).status_code == 200
        assert not User.objects.exists()
    assert client.post(reverse("first"), given).status_code == 302
    assert client.get(reverse("people")).status_code == 200, "signed in, and an admin"
    assert make_first_link_token() is None
    assert Client().get(reverse("login")).status_code == 200
    assert [first(str(token)), Client().get(reverse("first")).status_code] == [410, 410]


def test_a_forged_or_old_first_link_opens_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    token = make_first_link_token()
    assert token is not None
    assert first(token[:-1] + ("A" if token[-1] != "A" else "B")) == 410
    monkeypatch.setattr("arena.people.services.LINK_LIVES_S", -LINK_LIVES_S)
    assert first(token) == 410


def test_an_admin_makes_an_account_whose_owner_sets_the_password(admin: Client) -> None:
    answer = admin.post(reverse("people"), {"username": "grace", "role": "researcher"})
    (link,) = re.findall(r"http://testserver(/welcome/[^/\"]+/)", answer.content.decode())
    guest = Client()
    assert "grace" in guest.get(link).content.decode()
    assert guest.post(link, TWICE).status_code == 302
    assert guest.get(reverse("jobs")).status_code == 200, "signed in, and a researcher"
    assert Client().get(link).status_code == 410, "it works once"
    assert can_sign_in("grace", PASSWORD)


def test_several_people_are_pasted_at_once_or_none_of_them(admin: Client) -> None:
    pasted = "Grace Höpper\tNavy\r\nAda <ada@example.org>; bob, Builder\n\n李雷"
    answer = admin.post(reverse("people"), {"username": pasted, "role": "expert"})
    assert answer.content.decode().count('id="link-') == 4
    made = User.objects.filter(groups__name="expert").order_by("pk")[1:]
    assert list(made.values_list("username", "person__pseudonym"))[:3] == [
        ("Grace-Höpper", "Navy"),
        ("ada@example.org", made[1].person.pseudonym),
        ("bob", "Builder"),
    ]
    refused = admin.post(reverse("people"), {"username": "carl\nbob\ndora", "role": "expert"})
    assert "&#x27;bob&#x27;" in refused.content.decode()
    assert not User.objects.filter(username="carl").exists()


class FasterVisitor:
    """A rule for passwords that is asked while a link is used: meanwhile somebody else uses it."""

    def __init__(self, token: str) -> None:
        self._left = [token]

    def validate(self, password: str, user: User | None = None) -> None:
        if self._left:
            accept_welcome(token=self._left.pop(), password=PASSWORD)

    def get_help_text(self) -> str:
        return "anything"


def test_of_two_who_use_a_link_at_once_the_second_finds_it_used(settings: Settings) -> None:
    grace = create_person(username="grace", password=None, role="researcher")
    token = make_welcome_token(grace, actor=people()["admin"])
    settings.AUTH_PASSWORD_VALIDATORS = [
        {"NAME": f"{__name__}.FasterVisitor", "OPTIONS": {"token": token}}
    ]
    second = dict.fromkeys(TWICE, "the password of who was slower")
    assert Client().post(reverse("welcome", args=[token]), second).status_code == 410
    assert can_sign_in("grace", PASSWORD)


def test_what_is_no_link_is_over() -> None:
    for token in ("-", "x", "0" * 32, "0" * 32 + "-abc-def", "ä-b-c"):
        assert Client().get(f"/welcome/{token}/").status_code == 410, token
    guessed = reverse("invitation", args=["guessed"])
    assert [Client().get(guessed).status_code, Client().post(guessed).status_code] == [404, 404]


def change(actor: User, user: User, **given: str) -> None:
    signed_in(actor).post(reverse("person-change", args=[user.person.code]), given)
    user.refresh_from_db()


def test_a_paused_account_is_signed_out_and_can_go_on_later() -> None:
    accounts = people()
    expert = accounts["expert"]
    theirs = signed_in(expert)
    link = reverse("invitation", args=[invite(study=None, expert=expert).token])
    change(accounts["admin"], expert, act="pause")
    assert theirs.get(reverse("home")).status_code == 302
    assert Session.objects.count() == 1, "the admin's own"
    assert not can_sign_in("the-expert", "a password")
    change(accounts["admin"], expert, act="resume")
    assert can_sign_in("the-expert", "a password")
    assert Client().get(link).status_code == 410


def test_a_role_is_changed_for_another_and_logged() -> None:
    accounts = people()
    expert = accounts["expert"]
    change(accounts["admin"], expert, role="researcher")
    assert signed_in(expert).get(reverse("jobs")).status_code == 200
    (event,) = Event.objects.filter(verb="change role")
    assert (event.before, event.after) == ({"role": "expert"}, {"role": "researcher"})
    change(accounts["admin"], expert, role="king")
    assert {group.name for group in expert.groups.all()} == {"researcher"}


def test_nobody_pauses_demotes_or_forgets_themselves() -> None:
    admin = people()["admin"]
    change(admin, admin, act="pause")
    change(admin, admin, role="expert")
    signed_in(admin).post(reverse("person-forget", args=[admin.person.code]), {"sure": "1"})
    admin.refresh_from_db()
    assert (admin.username, admin.is_active, admin.is_superuser) == ("the-admin", True, True)


def test_who_is_forgotten_leaves_votes_and_no_name() -> None:
    study, admin = a_study(), people()["admin"]
    eva = study.experts.get(username="eva")
    vote(matchups_of(study, "eva")[0], "left")
    AccessAttempt.objects.create(username="eva", failures_since_start=1)
    pseudonym = eva.person.pseudonym
    url = reverse("person-forget", args=[eva.person.code])
    client = signed_in(admin)
    assert client.post(url).status_code == 200, "a question first"
    assert User.objects.filter(username="eva").exists()
    client.post(url, {"sure": "1"})
    eva.refresh_from_db()
    eva.person.refresh_from_db()
    assert eva.username.startswith("gone-")
    assert eva.person.pseudonym != pseudonym
    assert not eva.is_active
    assert Vote.objects.filter(expert=eva).count() == 1
    assert "eva" not in client.get(reverse("people")).content.decode()
    assert Study.objects.get().rules["experts"] == [eva.username, "finn"]
    assert not AccessAttempt.objects.exists()
    change(admin, eva, act="resume")
    assert not eva.is_active, "for good"
    assert "Forgotten" in client.get(reverse("people")).content.decode()


def test_two_admins_who_demote_each_other_leave_one() -> None:
    ada, bob = (create_person(username=name, password=None, role="admin") for name in ("a", "b"))
    set_role(user=bob, role="expert", actor=ada)
    acts: tuple[Callable[[], None], ...] = (
        lambda: set_role(user=ada, role="expert", actor=bob),
        lambda: set_active(user=ada, is_active=False, actor=bob),
        lambda: forget_identity(user=ada, actor=bob),
    )
    for act in acts:
        with pytest.raises(Conflict, match="not an admin any more"):
            act()
    assert list(find_admins()) == [ada]


def is_open(token: str) -> bool:
    return Client().get(reverse("welcome", args=[token])).status_code == 200


def test_the_newest_link_of_who_has_no_password_is_the_only_one() -> None:
    admin = people()["admin"]
    grace = create_person(username="grace", password=None, role="expert")
    first, second = (make_welcome_token(grace, actor=admin) for _ in range(2))
    assert (is_open(first), is_open(second)) == (False, True)
    assert Event.objects.filter(verb="make link", actor=admin).count() == 2
    set_role(user=grace, role="researcher", actor=admin)
    assert not is_open(second), "whoever had the link would get the new role"
    third = make_welcome_token(grace, actor=admin)
    set_active(user=grace, is_active=False, actor=admin)
    set_active(user=grace, is_active=True, actor=admin)
    assert not is_open(third)


def test_ones_own_password_needs_the_old_one() -> None:
    expert = people()["expert"]
    here, there = signed_in(expert), signed_in(expert)
    url = reverse("password")
    assert here.post(url, {"old_password": "wrong", **TWICE}).status_code == 200
    assert here.post(url, {"old_password": "a password", **TWICE}).status_code == 302
    assert here.get(reverse("home")).status_code == 200
    assert there.get(reverse("home")).status_code == 302, "other devices are signed out"


def invitation_of(study: Study, username: str = "eva") -> str:
    fresh = invite(
        study=study,
        expert=User.objects.get(username=username),
        actor=User.objects.filter(is_superuser=True).first(),
    )
    return reverse("invitation", args=[fresh.token])


def who(client: Client) -> str | None:
    key = client.session.get("_auth_user_id")
    return User.objects.get(pk=key).username if key else None


def text(page: bytes) -> str:
    return " ".join(page.decode().split())


def test_the_link_says_who_invites_to_what_and_its_button_alone_signs_in_for_thirty_days(
    study: Study,
) -> None:
    admin = people()["admin"]
    client, url = Client(), invitation_of(study)
    for answer in (client.get(url), client.head(url)):
        assert answer.status_code == 200
        assert answer.headers["Referrer-Policy"] == "strict-origin"
        assert "no-store" in answer.headers["Cache-Control"]
    page = text(client.get(url).content)
    expected = f"{admin.person.pseudonym} invites you to compare edited traffic scenes"
    assert expected in page
    assert "“Round 1”" in page
    assert who(client) is None
    assert Invitation.objects.get().used_at is None
    answer = client.post(url)
    assert answer.headers["Location"] == reverse("vote", args=[study.code])
    assert who(client) == "eva"
    assert client.session.get_expiry_age() == 30 * 24 * 3600
    assert Invitation.objects.get().used_at is not None


def test_a_second_device_takes_over_after_a_confirmation(study: Study) -> None:
    first, second, url = Client(), Client(), invitation_of(study)
    assert "signs you out on every other device" not in text(first.get(url).content)
    first.post(url)
    assert "signs you out on every other device" in text(second.get(url).content)
    assert first.get(reverse("home")).status_code == 200, "a look signs nobody out"
    second.post(url)
    assert [one.get(reverse("home")).status_code for one in (first, second)] == [302, 200]


def test_an_expert_from_the_list_of_people_comes_in_without_a_password(
    study: Study, admin: Client
) -> None:
    made = admin.post(reverse("people"), {"username": "grace", "role": "expert"})
    grace = User.objects.get(username="grace")
    pages = [made, admin.post(reverse("person-link", args=[grace.person.code]))]
    older, url = (re.findall(r'"(http://testserver/[^"]+)"', text(x.content))[0] for x in pages)
    assert Client().get(older).status_code == 410
    guest = Client()
    assert guest.post(url)["Location"] == reverse("home")
    assert not grace.has_usable_password()
    invitation_of(study)
    assert Client().get(url).status_code == 200, "another one's changes nothing"
    token = make_api_token(owner=grace, name="mine", role="expert", days=1).token
    admin.post(reverse("person-change", args=[grace.person.code]), {"act": "take-back"})
    token.refresh_from_db()
    assert token.revoked_at is not None
    assert guest.get(reverse("home")).status_code == 302
    assert Client().post(url).status_code == 410


def test_another_account_on_the_device_is_named_and_signed_out(
    study: Study, researcher: Client
) -> None:
    url = invitation_of(study)
    assert "You are signed in as the-researcher" in text(researcher.get(url).content)
    researcher.post(url)
    assert who(researcher) == "eva"


@pytest.mark.parametrize("column", ["expires_at", "revoked_at"])
def test_a_link_that_is_over_says_so(study: Study, column: str) -> None:
    client, url = Client(), invitation_of(study)
    Invitation.objects.update(**{column: timezone.now()})
    for answer in (client.get(url), client.post(url)):
        assert answer.status_code == 410
        assert "This link is no longer in use" in text(answer.content)
        assert answer.headers["Referrer-Policy"] == "strict-origin"
    assert who(client) is None


def test_an_admin_invites_once_for_all_and_sees_each_link_once(
    study: Study, admin: Client
) -> None:
    page = reverse("study", args=[study.code])
    assert "Invite 2 experts" in text(admin.get(page).content)
    answer = admin.post(reverse("invite", args=[study.code]))
    assert "no-store" in answer.headers["Cache-Control"]
    addresses = re.findall(r'value="(http://testserver/invitation/[^"]+)"', text(answer.content))
    assert len(addresses) == 2
    expert = Client()
    expert.post(addresses[0])
    assert who(expert) == "eva"
    listed = text(admin.get(page).content)
    assert "Invite 2" not in listed
    assert "/invitation/" not in listed
    again = admin.post(reverse("invite", args=[study.code]), follow=True)
    assert "Nobody was left to invite" in text(again.content)


def test_taking_a_link_back_signs_out_who_came_in_by_it(study: Study, admin: Client) -> None:
    came, url = Client(), invitation_of(study)
    came.post(url)
    by_password = signed_in(User.objects.get(username="eva"))
    answer = admin.post(reverse("revoke", args=[Invitation.objects.get().code]), follow=True)
    assert "The link was taken back." in text(answer.content)
    vote = reverse("vote", args=[study.code])
    assert came.get(vote).status_code == 302
    assert by_password.get(vote).status_code == 200
    assert Client().post(url).status_code == 410


def test_no_log_line_holds_a_key() -> None:
    paths = (
        "/invitation/aB-c_9/",
        "/welcome/aB-c_9/",
        "/enrol/aB-c_9/?PROLIFIC_PID=x&SESSION_ID=y",
    )
    line = logging.LogRecord("x", logging.INFO, "", 1, "GET %s %s %s", paths, None)
    assert HideKeys().filter(line)
    assert line.getMessage() == "GET /invitation/.../ /welcome/.../ /enrol/.../"


def attempt(password: str, username: str = "the-expert", **headers: str) -> HttpResponse:
    sent = {"username": username, "password": password}
    return Client().post(reverse("login"), sent, **headers)  # type: ignore[arg-type,return-value]


def test_five_wrong_passwords_lock_the_account_and_the_page_says_for_how_long() -> None:
    people()
    assert attempt("wrong", 151 * "x").status_code == 200
    assert not AccessAttempt.objects.exists(), "no account can have that name"
    assert [attempt("wrong").status_code for _ in range(5)] == [200, 200, 200, 200, 429]
    answer = attempt("a password")
    page = " ".join(answer.content.decode().split())
    assert answer.status_code == 429
    assert "Too many wrong passwords" in page
    assert "for 15 minutes" in page
    assert attempt("a password", "the-researcher").status_code == 302, "nobody else"
    assert attempt("a password", REMOTE_ADDR="192.0.2.7").status_code == 302, "from there alone"


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
