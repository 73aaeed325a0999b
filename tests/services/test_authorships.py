"""Marking experts as authors of contestants: who may be marked, once, logged, and taken back."""

import pytest
from django.contrib.auth.models import User
from django.core.management import CommandError, call_command

from arena.errors import NotYours
from arena.models import Authorship, Study
from arena.people.links import mark_author
from arena.studies.queries import author_pairs
from augment.errors import UnknownName
from augment.models import Event
from tests.study_rows import contestant, expert

pytestmark = pytest.mark.django_db

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


def test_taking_back_is_logged_and_doing_it_twice_changes_nothing_more(
    study: Study, eva: User
) -> None:
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
