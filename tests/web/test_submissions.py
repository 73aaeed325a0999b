"""Submissions page by page and by the API: entrants send theirs, admins decide."""

import json

import pytest
from django.core.files.uploadedfile import SimpleUploadedFile
from django.db.models import Model
from django.test import Client
from django.urls import reverse

from arena.results.exports.tables import leaderboard_table
from arena.results.exports.writers import leaderboard_json
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from augment.models import Benchmark, Contestant, GenerationJob, Submission
from augment.services.benchmarks.submissions import SUBMISSIONS
from tests.api.tokens import program_of
from tests.entering import ANSWERS, CARD, a_benchmark, entrant, packed, read, sent
from tests.study_rows import a_study, vote
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


NEW = "/submissions/new/"


def work_on(row: Model) -> None:
    """Do the work of a submission at once, and leave all else."""
    if isinstance(row, Submission):
        SUBMISSIONS.perform(row.pk)


@pytest.fixture(autouse=True)
def working(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is sent to a worker is done at once."""
    monkeypatch.setattr("arena.shell.sending.enqueue_row", work_on)
    monkeypatch.setattr("django.db.transaction.on_commit", lambda done, **_: done())


@pytest.fixture
def benchmark() -> Benchmark:
    return a_benchmark()


def zipped() -> SimpleUploadedFile:
    return SimpleUploadedFile("ours.zip", packed(**ANSWERS).read())


def page(client: Client, row: Submission) -> str:
    return client.get(reverse("submission", args=[row.code])).content.decode()


def test_an_entrant_sends_a_zip_and_reads_its_rejections_first(benchmark: Benchmark) -> None:
    enno = signed_in(entrant())
    assert "Enter your system" in enno.get("/").content.decode()
    answer = enno.post(NEW, {"benchmark": str(benchmark.code), "file": zipped()}, follow=True)
    shown = answer.content.decode()
    assert "2 of 4 read, 1 refused, 1 unreadable; mean displacement on practice" in shown
    rows = [shown.index(f'<th scope="row">{name}') for name in ("street-3", "street-4")]
    assert max(rows) < shown.index('<th scope="row">street-1')
    for said in ("street-4.json", "An admin decides next", "Withdraw", "DiffScene"):
        assert said in shown
    assert "Accept it" not in shown
    assert "1 submission waits" in signed_in(people()["admin"]).get("/").content.decode()


def test_what_can_not_be_sent_is_said_at_its_field(benchmark: Benchmark) -> None:
    enno = signed_in(entrant())
    changes: list[tuple[dict[str, object], str]] = [
        ({"file": SimpleUploadedFile("empty.zip", b"")}, "empty"),
        ({"file": ""}, "This field is required"),
        ({"benchmark": "00000000-0000-0000-0000-000000000000"}, "Select a valid choice"),
    ]
    for change, said in changes:
        answer = enno.post(NEW, {"benchmark": str(benchmark.code), "file": zipped()} | change)
        assert (answer.status_code, said in answer.content.decode()) == (422, True), said
    assert not Submission.objects.exists()


def test_an_admin_accepts_under_a_name_and_runs_it(benchmark: Benchmark) -> None:
    enno, admin = entrant(), signed_in(people()["admin"])
    row = read(sent(benchmark, enno))
    here = reverse("submission", args=[row.code])
    wanted = {"name": "System A", "runs": "on"}
    assert admin.post(here, wanted | {"name": ""}).status_code == 422
    answer = admin.post(here, wanted, follow=True)
    assert "“System A” is accepted" in answer.content.decode()
    assert GenerationJob.objects.get().augmentations.count() == 4
    contestant = Contestant.objects.get(slug="system-a")
    shown = admin.get(reverse("contestant", args=[contestant.code])).content.decode()
    assert all(word in shown for word in ("Submission.", "A. Author", "closed", "secret-net"))
    theirs = page(signed_in(enno), row)
    assert "It takes part in studies" in theirs
    assert reverse("contestant", args=[contestant.code]) not in theirs


def test_a_declined_entrant_reads_why_and_a_withdrawn_one_is_over(benchmark: Benchmark) -> None:
    enno, admin = entrant(), signed_in(people()["admin"])
    first, second = read(sent(benchmark, enno)), read(sent(benchmark, enno))
    decline = reverse("submission-decline", args=[first.code])
    assert "is empty" in admin.post(decline, {"reason": " "}, follow=True).content.decode()
    admin.post(decline, {"reason": "These are another’s answers."})
    assert "These are another’s answers." in page(signed_in(enno), first)
    withdraw = reverse("submission-withdraw", args=[second.code])
    assert admin.post(withdraw).status_code == 404, "nobody else's"
    assert "withdrawn" in signed_in(enno).post(withdraw, follow=True).content.decode()


def test_nobody_reads_anothers_submission_but_staff(benchmark: Benchmark) -> None:
    enno, accounts = entrant(), people()
    code = str(read(sent(benchmark, enno)).code)
    here = reverse("submission", args=[code])
    asked = (enno, entrant("fred"), accounts["expert"], accounts["researcher"])
    by_page = [signed_in(user).get(here).status_code for user in asked]
    by_program = [
        program_of(user).get(f"/api/v1/submissions/{code}").status_code for user in asked
    ]
    assert by_page == by_program == [200, 404, 403, 200]
    lists = [signed_in(user).get(reverse("submissions")).content.decode() for user in asked[:2]]
    assert [here in shown for shown in lists] == [True, False]


def test_a_program_sends_one_and_gets_its_report(benchmark: Benchmark) -> None:
    enno = program_of(entrant())
    body = {"file": zipped(), "benchmark": "streets"}
    made = enno.post("/api/v1/submissions", body)
    assert made.status_code == 202
    found = enno.get(f"/api/v1/submissions/{made.json()['code']}").json()
    assert (found["state"], found["benchmark"]) == ("checked", "streets@1")
    assert found["summary"]["entries"]["read"] == 2
    assert [one["status"] for one in found["report"]["entries"]] == [
        *["read", "read", "refused", "unreadable"]
    ]
    assert enno.post("/api/v1/submissions", body | {"benchmark": "none"}).status_code == 422


def test_its_card_stands_in_results_and_their_files_alone(admin: Client) -> None:
    study = a_study()
    Contestant.objects.filter(slug="ann").update(kind="submission", card=CARD)
    vote(study.matchups.earliest("pk"), "left")
    here = reverse("study", args=[study.code])
    assert "A. Author" not in admin.get(here).content.decode()
    close_study(study=study)
    study.refresh_from_db()
    snapshot = rate(study=study, rounds=20)
    shown = admin.get(reverse("results", args=[study.code])).content.decode()
    assert "Ann: Submission" in shown
    assert all(word in shown for word in ("A. Author", "closed", "1.50 USD", "2026-11-20"))
    lines = json.loads(leaderboard_json(leaderboard_table(snapshot)))["standings"]
    assert {line["slug"]: line.get("card") for line in lines} == {
        **{"ann": CARD, "bob": None, "cid": None}
    }
    assert {line["kind"] for line in lines if line["slug"] == "ann"} == {"submission"}
