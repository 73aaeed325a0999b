"""The log, every door through which results could be seen early, and marks of authors."""

import re
from datetime import UTC, datetime
from io import StringIO
from pathlib import Path

import pytest
from django.contrib.auth.models import User
from django.core.management import CommandError, call_command
from django.test import Client
from django.urls import reverse

from arena.models import Authorship, Snapshot, Study
from arena.people.links import mark_author
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from augment.models import Event
from tests import study_rows
from tests.board_rows import voted
from tests.study_rows import matchups_of, vote
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def _page(client: Client, **asked: str) -> str:
    return client.get(reverse("audit"), asked).content.decode()


def _acts() -> tuple[Client, Study]:
    """An opening by the machine, a closing by an admin, and something done to a scene."""
    accounts = people()
    study = close_study(study=study_rows.a_study(), actor=accounts["admin"])
    Event.objects.create(
        actor=accounts["researcher"],
        verb="import",
        object_kind="scene",
        object_code="a-street",
        after={"notes": "=1+1"},
    )
    return signed_in(accounts["admin"]), study


def test_acts_are_filtered() -> None:
    client, study = _acts()
    admin = Event.objects.get(verb="close").actor
    assert admin is not None
    everything = _page(client)
    assert all(word in everything for word in ("a-street", str(study.code), "the machine"))
    rows = {
        "actor": (str(admin.person.code), "closed"),
        "verb": ("close", "closed"),
        "object_kind": ("scene", "notes: =1+1"),
        "q": (str(study.code)[:13], str(study.code)),
    }
    for name, (value, shown) in rows.items():
        body = _page(client, **{name: value}).partition("<tbody>")[2]
        assert shown in body, name
        assert ("a-street" in body) == (name == "object_kind"), name


# --- Early looks -------------------------------------------------------------------------------


def test_a_command_shows_them_only_on_purpose_and_that_is_logged(
    tmp_path: Path, study: Study
) -> None:
    rate(study=study, early=True)
    looks = Event.objects.filter(verb="look early").order_by("pk")
    logged: list[object] = []
    to_file = ("--out", str(tmp_path / "file.csv"))
    for what, command in {
        "rating, printed": ("rate", "Round 1"),
        "leaderboard as csv": ("export", "leaderboard", "Round 1", *to_file),
        "votes as csv": ("export", "votes", "Round 1", *to_file),
    }.items():
        with pytest.raises(CommandError):
            call_command(*command, stdout=StringIO())
        assert [look.after for look in looks.all()] == logged
        call_command(*command, "--early", stdout=StringIO())
        logged.append({"what": what})
        assert [look.after for look in looks.all()] == logged


FRESH = re.compile(r'name="(csrfmiddlewaretoken|key)" value="[^"]+"|\?rating=[0-9a-f-]+')
"""What is another one on every page."""


def page(client: Client, study: Study, name: str = "study", tab: str = "") -> str:
    answer = client.get(reverse(name, args=[study.code, tab] if tab else [study.code]))
    assert answer.status_code == 200
    return " ".join(answer.content.decode().split())


def rated(study: Study, **more: object) -> Snapshot:
    """Rated at a time that is always the same, so that pages can be compared."""
    snapshot = rate(study=study, rounds=100, seed=2, **more)  # type: ignore[arg-type]
    study.snapshots.exclude(pk=snapshot.pk).delete()
    Snapshot.objects.update(made_at=datetime(2026, 11, 22, tzinfo=UTC))
    return snapshot


def mark(study: Study, username: str, slug: str) -> None:
    mark_author(study=study, expert=User.objects.get(username=username), contestant=slug)


# --- The page of the experts -------------------------------------------------------------------


def test_an_admin_marks_an_author_and_takes_it_back_by_plain_forms(
    study: Study, admin: Client
) -> None:
    assert '<option value="ann">' in page(admin, study)
    wanted, url = {"expert": "eva", "contestant": "ann"}, reverse("author", args=[study.code])
    answer = admin.post(url, wanted, follow=True).content.decode()
    assert "Expert 1 is marked as author of ann." in answer
    assert Authorship.objects.get().marked_by == User.objects.get(username="the-admin")
    assert 'name="back"' in answer
    admin.post(url, wanted | {"back": "1"})
    assert not Authorship.objects.exists()
    acts = Event.objects.filter(verb__endswith=" author", actor__username="the-admin")
    assert acts.count() == 2, "who took it back stands in the log as well"


# --- Results -----------------------------------------------------------------------------------


def test_staff_read_who_is_an_author(researcher: Client, study: Study) -> None:
    mark(study, "eva", "ann")
    study = voted(study)
    rated(study)
    raters = page(researcher, study, "results-tab", "raters")
    assert raters.count(">Author</span>") == 1
    assert "eva" not in raters
    assert "marked an author" in page(researcher, study, "results-tab", "log")


# --- Experts -----------------------------------------------------------------------------------


def test_while_voting_an_expert_sees_the_same_pages_as_without_a_mark(study: Study) -> None:
    eva = signed_in(User.objects.get(username="eva"))
    for matchup in matchups_of(study, "eva")[:2]:
        vote(matchup)
    page = f"/studies/{study.code}/vote/"
    addresses = ("/", page, f"/api/v1/matchups?study={study.code}&n=4")

    def seen() -> list[str]:
        return [FRESH.sub("", eva.get(address).content.decode()) for address in addresses]

    seen()  # the first showing is noted
    before = seen()
    for slug in ("ann", "bob"):
        mark(study, "eva", slug)
    assert seen() == before


def test_after_closing_an_expert_reads_the_same_table_as_without_a_mark(study: Study) -> None:
    study = voted(study)
    expert = signed_in(User.objects.get(username="eva"))
    tabs = ("table", "pairs", "types")

    def seen() -> list[str]:
        return [FRESH.sub("", page(expert, study, "results-tab", tab)) for tab in tabs]

    rated(study)
    before = seen()
    mark(study, "eva", "ann")
    rated(study)
    assert seen() == before
