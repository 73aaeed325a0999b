"""Links: one at a time, kept as a hash, ended one by one, and never a way into another account."""

from datetime import timedelta

import pytest
from django.contrib.auth.models import Group, User
from django.db import IntegrityError
from django.utils import timezone

from arena.errors import LinkOver
from arena.models import Invitation, Study
from arena.people.links import accept, invite, revoke
from augment.errors import Conflict
from augment.models import Event

pytestmark = pytest.mark.django_db


def test_a_link_works_for_fourteen_days_and_is_kept_as_a_hash(study: Study, eva: User) -> None:
    fresh = invite(study=study, expert=eva)
    lives = fresh.invitation.expires_at - timezone.now()
    assert timedelta(days=13, hours=23) < lives <= timedelta(days=14)
    kept = [str(value) for value in Invitation.objects.values_list().get()]
    assert not any(fresh.token in value for value in kept)
    assert accept(token=fresh.token).expert == eva


def test_a_new_link_replaces_the_one_before(study: Study, eva: User) -> None:
    older, newer = (invite(study=study, expert=eva) for _ in range(2))
    with pytest.raises(LinkOver):
        accept(token=older.token)
    assert accept(token=newer.token) == newer.invitation
    last = Event.objects.filter(verb="invite").latest("pk")
    assert last.before == {"replaced": [str(older.invitation.code)]}


def test_the_database_keeps_one_live_link_per_expert_and_study(study: Study, eva: User) -> None:
    row = invite(study=study, expert=eva).invitation
    row.pk, row.token_sha256 = None, "another"
    with pytest.raises(IntegrityError):
        row.save(force_insert=True)


def test_links_are_taken_back_one_by_one(study: Study, eva: User) -> None:
    hers = invite(study=study, expert=eva)
    his = invite(study=study, expert=User.objects.get(username="finn"))
    revoke(invitation=hers.invitation)
    with pytest.raises(LinkOver):
        accept(token=hers.token)
    assert accept(token=his.token).expert.username == "finn"


@pytest.mark.parametrize("role", ["researcher", "admin"])
def test_who_became_more_than_an_expert_is_not_let_in(study: Study, eva: User, role: str) -> None:
    token = invite(study=study, expert=eva).token
    eva.groups.add(Group.objects.get_or_create(name=role)[0])
    with pytest.raises(LinkOver):
        accept(token=token)
    with pytest.raises(Conflict):
        invite(study=study, expert=eva)


def test_an_account_that_was_switched_off_is_not_let_in(study: Study, eva: User) -> None:
    token = invite(study=study, expert=eva).token
    User.objects.filter(pk=eva.pk).update(is_active=False)
    with pytest.raises(LinkOver):
        accept(token=token)


def test_every_act_is_logged_without_the_token(study: Study, eva: User) -> None:
    fresh = invite(study=study, expert=eva, actor=None)
    accept(token=fresh.token)
    revoke(invitation=fresh.invitation)
    lines = Event.objects.filter(object_kind="invitation").order_by("pk")
    assert [line.verb for line in lines] == ["invite", "accept", "revoke"]
    assert {line.object_code for line in lines} == {str(fresh.invitation.code)}
    assert not any(fresh.token in f"{line.before}{line.after}" for line in lines)
