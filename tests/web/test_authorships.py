"""Authors on the pages: admins mark them, results say what it changes, experts see none of it."""

import re
from datetime import UTC, datetime

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from arena.models import Authorship, Snapshot, Study
from arena.people.links import mark_author
from arena.results.services.ratings import rate_now as rate
from augment.models import Event
from tests.full_study import Size, full_study
from tests.study_rows import a_study, matchups_of, vote
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

SIZE = Size(scenarios=8, experts=4, votes_per_expert=90)
FRESH = re.compile(r'name="(csrfmiddlewaretoken|key)" value="[^"]+"|\?rating=[0-9a-f-]+')
"""What is another one on every page."""
HEADING = "With and without votes of authors on their own contestants"


@pytest.fixture
def study() -> Study:
    return a_study()


@pytest.fixture
def admin() -> Client:
    return signed_in(people()["admin"])


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
    wanted = {"expert": "eva", "contestant": "ann"}
    url = reverse("author", args=[study.code])
    for _ in range(2):
        answer = admin.post(url, wanted, follow=True)
        assert "Expert 1 is marked as author of ann." in answer.content.decode()
    row = Authorship.objects.get()
    assert row.marked_by is not None
    assert row.marked_by.username == "the-admin"
    assert 'name="back"' in page(admin, study)
    for _ in range(2):
        admin.post(url, wanted | {"back": "1"})
    assert not Authorship.objects.exists()
    acts = Event.objects.filter(object_code=str(study.code)).order_by("pk")
    assert [one.verb for one in acts][-2:] == ["mark author", "take back author"]


# --- Results -----------------------------------------------------------------------------------


def test_staff_read_who_is_an_author() -> None:
    study = full_study(size=SIZE)
    researcher = signed_in(people()["researcher"])
    mark(study, "expert-1", "gpt-4o-otm")
    rated(study)
    raters = page(researcher, study, "results-tab", "raters")
    assert raters.count(">Author</span>") == 1
    assert "expert-1" not in raters
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


def test_after_closing_an_expert_reads_the_same_table_as_without_a_mark() -> None:
    study = full_study(size=SIZE)
    expert = signed_in(User.objects.get(username="expert-1"))
    tabs = ("table", "pairs", "types")

    def seen() -> list[str]:
        return [FRESH.sub("", page(expert, study, "results-tab", tab)) for tab in tabs]

    rated(study)
    before = seen()
    mark(study, "expert-1", "gpt-4o-otm")
    rated(study)
    assert seen() == before
