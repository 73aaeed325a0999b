"""Links: one at a time, kept as a hash, ended one by one, and never a way into another account.

Marks of authorship: who may be marked, once, logged, and taken back.
"""

from datetime import timedelta

import pytest
from django.contrib.auth.models import Group, User
from django.core.management import CommandError, call_command
from django.db import IntegrityError
from django.utils import timezone

from arena.errors import LinkOver, NotYours
from arena.models import Authorship, Invitation, Study
from arena.people.links import accept, invite, mark_author, revoke
from arena.studies.queries import author_pairs
from augment.errors import Conflict, UnknownName
from augment.models import Event
from tests.study_rows import contestant, expert

pytestmark = pytest.mark.django_db


def test_a_link_works_for_fourteen_days_is_kept_as_a_hash_and_every_act_is_logged(
    study: Study, eva: User
) -> None:
    fresh = invite(study=study, expert=eva, actor=None)
    lives = fresh.invitation.expires_at - timezone.now()
    assert timedelta(days=13, hours=23) < lives <= timedelta(days=14)
    kept = [str(value) for value in Invitation.objects.values_list().get()]
    assert accept(token=fresh.token).expert == eva
    revoke(invitation=fresh.invitation)
    lines = Event.objects.filter(object_kind="invitation").order_by("pk")
    assert [line.verb for line in lines] == ["invite", "accept", "revoke"]
    assert {line.object_code for line in lines} == {str(fresh.invitation.code)}
    kept += [f"{line.before}{line.after}" for line in lines]
    assert not any(fresh.token in value for value in kept)


def test_a_new_link_replaces_the_one_before(study: Study, eva: User) -> None:
    older, newer = (invite(study=study, expert=eva) for _ in range(2))
    his = invite(study=study, expert=User.objects.get(username="finn"))
    with pytest.raises(LinkOver):
        accept(token=older.token)
    assert accept(token=newer.token) == newer.invitation
    last = Event.objects.filter(verb="invite", object_code=newer.invitation.code).get()
    assert last.before == {"replaced": [str(older.invitation.code)]}
    revoke(invitation=newer.invitation)
    with pytest.raises(LinkOver):
        accept(token=newer.token)
    assert accept(token=his.token).expert.username == "finn"


def test_the_database_keeps_one_live_link_per_expert_and_study(study: Study, eva: User) -> None:
    row = invite(study=study, expert=eva).invitation
    row.pk, row.token_sha256 = None, "another"
    with pytest.raises(IntegrityError):
        row.save(force_insert=True)


@pytest.mark.parametrize("change", ["researcher", "admin", "switched off"])
def test_who_is_more_than_an_expert_or_nobody_by_now_is_not_let_in(
    study: Study, eva: User, change: str
) -> None:
    token = invite(study=study, expert=eva).token
    if change == "switched off":
        User.objects.filter(pk=eva.pk).update(is_active=False)
    else:
        eva.groups.add(Group.objects.get_or_create(name=change)[0])
        with pytest.raises(Conflict):
            invite(study=study, expert=eva)
    with pytest.raises(LinkOver):
        accept(token=token)


# --- Marks of authorship -----------------------------------------------------------------------

ACTS = ("mark author", "take back author")


def test_a_mark_says_who_made_it_and_when_and_so_does_the_log(study: Study, eva: User) -> None:
    actor = User.objects.create(username="root")
    mark_author(study=study, expert=eva, contestant="ann", actor=actor)
    row = Authorship.objects.get()
    assert (row.marked_by, row.contestant.slug) == (actor, "ann")
    logged = Event.objects.get(verb="mark author")
    assert (logged.actor, logged.object_code) == (actor, str(study.code))
    assert logged.after == {"expert": str(eva.person.code), "contestant": "ann"}
    assert logged.at >= row.marked_at
    assert author_pairs(study) == {(str(eva.person.code), "ann")}


def test_only_who_and_what_takes_part_can_be_marked(study: Study, eva: User) -> None:
    with pytest.raises(NotYours, match="greta does not take part"):
        mark_author(study=study, expert=expert("greta"), contestant="ann")
    contestant("zoe")
    with pytest.raises(UnknownName, match=r"'zoe'. Known: ann, bob, cid"):
        mark_author(study=study, expert=eva, contestant="zoe")
    assert not Event.objects.filter(verb__in=ACTS).exists()


def test_taking_back_is_logged_and_twice_changes_nothing_more(study: Study, eva: User) -> None:
    for is_author in (True, True, False, False):
        mark_author(study=study, expert=eva, contestant="ann", is_author=is_author)
    assert author_pairs(study) == frozenset()
    assert [line.verb for line in Event.objects.filter(verb__in=ACTS).order_by("pk")] == [*ACTS]


def test_the_command_marks_and_takes_back(
    study: Study, eva: User, capsys: pytest.CaptureFixture[str]
) -> None:
    call_command("mark_author", study.name, "eva", "ann")
    assert author_pairs(study) == {(str(eva.person.code), "ann")}
    call_command("mark_author", study.name, "eva", "ann", "--take-back")
    assert author_pairs(study) == frozenset()
    assert capsys.readouterr().out.splitlines() == [
        "eva is marked as author of ann.",
        "eva is not marked as author of ann.",
    ]
    assert [line.actor for line in Event.objects.filter(verb__in=ACTS)] == [None, None]
    for names, sentence in (
        (("ghost", "ann"), "Unknown expert of this study 'ghost'. Known: eva, finn."),
        (("eva", "zoe"), "Unknown contestant 'zoe'"),
    ):
        for more in ((), ("--take-back",)):
            with pytest.raises(CommandError, match=sentence):
                call_command("mark_author", study.name, *names, *more)
