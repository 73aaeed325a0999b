"""A submission: kept, read, decided; and what its contestant answers in a job."""

from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

import pytest
from django.contrib.auth.models import User
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.db import connection
from pytest_django import Settings

from augment.errors import AugmentError, Conflict, InvalidDocument
from augment.models import Contestant, Event, ModelCall, Submission
from augment.services.benchmarks.submissions import decline_submission, withdraw_submission
from augment.services.running.choosing import resolve_contestants
from augment.services.running.entering import AcceptRequest, accept_submission
from augment.services.running.jobs import JobRequest, launch
from augment.services.running.runner import AUGMENTATIONS
from tests.entering import ANSWERS, CARD, ONE_CONE, a_benchmark, entrant, packed, read, sent
from tests.jobs.rows import add_scenario

pytestmark = pytest.mark.django_db
committing = pytest.mark.django_db(transaction=True)


@pytest.fixture
def ada() -> User:
    return User.objects.create_user("ada")


def accepted(row: Submission, ada: User, *, runs: bool = False) -> Contestant:
    asked = AcceptRequest(slug="theirs", name="System A", runs=runs)
    return accept_submission(row, asked, actor=ada)[0]


def test_a_report_names_what_was_read_and_measures_practice_alone() -> None:
    benchmark = a_benchmark()
    row = read(sent(benchmark, entrant(), packed(**ANSWERS, street_9="{}")))
    assert (row.state, row.reason) == ("checked", "")
    found = {"read": 2, "refused": 1, "unreadable": 1, "missing": 0}
    assert row.summary["entries"] == found
    assert (row.summary["total"], row.title) == (4, CARD["name"])
    practice = benchmark.items.get(split="practice").scenario.slug
    for number in ("displacement", "wish"):
        assert [one["task"] for one in row.report["entries"] if number in one] == [practice]


@pytest.mark.parametrize("content", [b"no zip at all", b"PK\x05\x06" + bytes(18)])
def test_a_file_that_can_not_be_taken_at_all_fails_with_its_reason(content: bytes) -> None:
    row = read(sent(a_benchmark(), entrant(), ContentFile(content)))
    assert row.state == "failed"
    assert row.reason
    assert (row.report, row.summary) == (None, None)
    with pytest.raises(Conflict, match="before its report"):
        accepted(row, entrant("admin"))


@committing
def test_so_many_a_day_and_account_and_no_more(settings: Settings) -> None:
    settings.SUBMISSIONS_A_DAY = 2
    benchmark, enno = a_benchmark(), entrant()
    first = sent(benchmark, enno)
    withdraw_submission(sent(benchmark, enno), actor=enno)
    with pytest.raises(Conflict, match="You have sent 2 submissions to “streets@1”"):
        sent(benchmark, enno)
    assert len(default_storage.listdir("uploads")[1]) == 1, "neither withdrawn nor refused"
    sent(benchmark, entrant("fred"))
    a_day_ago = first.created_at - timedelta(days=1, seconds=5)
    Submission.objects.filter(pk=first.pk).update(created_at=a_day_ago)
    sent(benchmark, enno)


@committing
def test_of_two_at_once_the_second_finds_the_first(settings: Settings) -> None:
    settings.SUBMISSIONS_A_DAY = 1
    benchmark, enno = a_benchmark(), entrant()

    def send(_number: int) -> str:
        try:
            return sent(benchmark, enno).state
        except Conflict:
            return "refused"
        finally:
            connection.close()

    with ThreadPoolExecutor(4) as pool:
        assert sorted(pool.map(send, range(4))) == ["queued", *["refused"] * 3]


def test_a_decision_is_final_and_logged(ada: User) -> None:
    benchmark, enno = a_benchmark(), entrant()
    declined, withdrawn, kept = (
        read(sent(benchmark, enno, packed(street_1=ONE_CONE))) for _ in range(3)
    )
    with pytest.raises(InvalidDocument, match="reason"):
        decline_submission(declined, reason=" ", actor=ada)
    decline_submission(declined, reason="Another’s answers.", actor=ada)
    withdraw_submission(withdrawn, actor=enno)
    accepted(kept, ada)
    for row in (declined, withdrawn, kept):
        for act in (
            lambda row: withdraw_submission(row, actor=enno),
            lambda row: decline_submission(row, reason="No.", actor=ada),
            lambda row: accepted(row, ada),
        ):
            with pytest.raises(Conflict, match="decided already"):
                act(row)
    verbs = Event.objects.filter(object_kind="submission").exclude(verb="upload")
    assert sorted(verbs.values_list("verb", "actor__username")) == [
        *[("accepted", "ada"), ("declined", "ada"), ("withdrawn", "enno")]
    ]


def test_an_accepted_submission_answers_in_a_job_from_its_files(ada: User) -> None:
    benchmark = a_benchmark(scenarios=5)
    row = read(sent(benchmark, entrant()))
    asked = AcceptRequest(slug="theirs", name="System A", runs=True)
    contestant, job = accept_submission(row, asked, actor=ada)
    assert (contestant.kind, contestant.card) == ("submission", CARD)
    for pk in job.augmentations.values_list("pk", flat=True):
        AUGMENTATIONS.perform(pk)
    rows = job.augmentations.order_by("scenario__slug")
    assert [one.state for one in rows] == ["done", "done", "refused", *["unreadable"] * 2]
    assert [one["x_m"] for one in rows[0].modification["add"]] == [21.0]
    assert all(one.reason for one in rows[2:])
    assert not ModelCall.objects.exists()
    assert "theirs" not in resolve_contestants(["all"])


def test_a_job_beyond_its_answers_is_refused(ada: User) -> None:
    accepted(read(sent(a_benchmark(), entrant(), packed(street_1=ONE_CONE))), ada)
    add_scenario("elsewhere")
    for slugs, samples, reason in (
        (["street-1", "elsewhere"], 1, "answers its scenarios alone, not elsewhere"),
        (["street-1"], 2, "has 1 sample a scenario, not 2"),
    ):
        request = JobRequest(name="x", contestants=["theirs"], scenarios=slugs, samples=samples)
        with pytest.raises(AugmentError, match=reason):
            launch(request)
