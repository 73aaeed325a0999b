"""Inviting by pages: the link is shown once, a GET signs nobody in, the button does."""

import logging
import re

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse
from django.utils import timezone

from arena.api.access import make_api_token
from arena.config.logs import HideKeys
from arena.models import Invitation, Study
from arena.people.links import invite
from tests.study_rows import a_study
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


@pytest.fixture
def study() -> Study:
    return a_study()


def link(study: Study, username: str = "eva") -> str:
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


def test_opening_the_link_says_who_invites_to_what_and_signs_nobody_in(study: Study) -> None:
    admin = people()["admin"]
    client, url = Client(), link(study)
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


def test_the_button_signs_in_for_thirty_days_and_leads_to_the_first_pair(study: Study) -> None:
    client = Client()
    answer = client.post(link(study))
    assert answer.headers["Location"] == reverse("vote", args=[study.code])
    assert who(client) == "eva"
    assert client.session.get_expiry_age() == 30 * 24 * 3600
    assert Invitation.objects.get().used_at is not None


def test_a_second_device_takes_over_after_a_confirmation(study: Study) -> None:
    first, second, url = Client(), Client(), link(study)
    assert "signs you out on every other device" not in text(first.get(url).content)
    first.post(url)
    assert "signs you out on every other device" in text(second.get(url).content)
    assert first.get(reverse("home")).status_code == 200, "a look signs nobody out"
    second.post(url)
    assert [one.get(reverse("home")).status_code for one in (first, second)] == [302, 200]


def test_an_expert_from_the_list_of_people_comes_in_without_a_password(study: Study) -> None:
    admin = signed_in(people()["admin"])
    made = admin.post(reverse("people"), {"username": "grace", "role": "expert"})
    grace = User.objects.get(username="grace")
    pages = [made, admin.post(reverse("person-link", args=[grace.person.code]))]
    older, url = (re.findall(r'"(http://testserver/[^"]+)"', text(x.content))[0] for x in pages)
    assert Client().get(older).status_code == 410
    guest = Client()
    assert guest.post(url)["Location"] == reverse("home")
    assert not grace.has_usable_password()
    link(study)
    assert Client().get(url).status_code == 200, "another one's changes nothing"
    token = make_api_token(owner=grace, name="mine", role="expert", days=1).token
    admin.post(reverse("person-change", args=[grace.person.code]), {"act": "take-back"})
    token.refresh_from_db()
    assert token.revoked_at is not None
    assert guest.get(reverse("home")).status_code == 302
    assert Client().post(url).status_code == 410


def test_another_account_on_the_device_is_named_and_signed_out(study: Study) -> None:
    client = signed_in(people()["researcher"])
    url = link(study)
    assert "You are signed in as the-researcher" in text(client.get(url).content)
    client.post(url)
    assert who(client) == "eva"


@pytest.mark.parametrize("column", ["expires_at", "revoked_at"])
def test_a_link_that_is_over_says_so(study: Study, column: str) -> None:
    client, url = Client(), link(study)
    Invitation.objects.update(**{column: timezone.now()})
    for answer in (client.get(url), client.post(url)):
        assert answer.status_code == 410
        assert "This link is no longer in use" in text(answer.content)
        assert answer.headers["Referrer-Policy"] == "strict-origin"
    assert who(client) is None


def test_a_made_up_link_is_404(study: Study) -> None:
    url = reverse("invitation", args=["guessed"])
    assert Client().get(url).status_code == 404
    assert Client().post(url).status_code == 404


def test_an_admin_invites_once_for_all_and_sees_each_link_once(study: Study) -> None:
    admin = signed_in(people()["admin"])
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


def test_taking_a_link_back_signs_out_who_came_in_by_it(study: Study) -> None:
    came, url = Client(), link(study)
    came.post(url)
    by_password = signed_in(User.objects.get(username="eva"))
    admin = signed_in(people()["admin"])
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
