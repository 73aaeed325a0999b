"""Accounts without a shell: the first admin, links, pauses, roles, and being forgotten."""

import re
from collections.abc import Callable

import pytest
from axes.models import AccessAttempt
from django.contrib.auth.models import User
from django.contrib.sessions.models import Session
from django.test import Client
from django.urls import reverse
from pytest_django import Settings

from arena.models import Study, Vote
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


def test_an_admin_makes_an_account_whose_owner_sets_the_password() -> None:
    admin = signed_in(people()["admin"])
    answer = admin.post(reverse("people"), {"username": "grace", "role": "researcher"})
    (link,) = re.findall(r"http://testserver(/welcome/[^/\"]+/)", answer.content.decode())
    guest = Client()
    assert "grace" in guest.get(link).content.decode()
    assert guest.post(link, TWICE).status_code == 302
    assert guest.get(reverse("jobs")).status_code == 200, "signed in, and a researcher"
    assert Client().get(link).status_code == 410, "it works once"
    assert can_sign_in("grace", PASSWORD)


def test_several_people_are_pasted_at_once_or_none_of_them() -> None:
    admin = signed_in(people()["admin"])
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


@pytest.mark.parametrize("token", ["", "x", "-", "0" * 32, "0" * 32 + "-abc-def", "ä-b-c"])
def test_what_is_no_link_is_over(token: str) -> None:
    assert Client().get(f"/welcome/{token or '-'}/").status_code == 410


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
