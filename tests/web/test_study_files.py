"""Files of studies and benchmarks by buttons: a worker writes each, for whoever may have it."""

import io
import json
import zipfile
from pathlib import Path

import pytest
from django.contrib.auth.models import User
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.test import Client
from django.urls import reverse
from pytest_django import Settings

from arena.models import BenchmarkFile, EarlyLook, Study, StudyFile
from arena.results.exports.study_folder import STUDY_FILES
from arena.results.services.ratings import rate_now as rate
from arena.scenarios.exports.benchmarks import BENCHMARK_FILES
from arena.studies.services.opening import cancel_study, close_study
from augment.models import Augmentation, Benchmark, Event, GenerationJob
from augment.scene.codec import modification_from_document, modification_to_document
from augment.scene.entities import Modification
from tests.exports.conftest import without_charts
from tests.exports.test_study_folder import export
from tests.scenes import vehicle
from tests.services.test_benchmarks import add_street
from tests.study_rows import a_study, matchups_of, vote
from tests.web.cast import people, png, signed_in

pytestmark = pytest.mark.django_db(transaction=True)


@pytest.fixture
def closed(tmp_path: Path, settings: Settings) -> Study:
    """With a vote and a rating."""
    settings.MEDIA_ROOT = tmp_path / "media"
    made = a_study()
    vote(matchups_of(made, "eva")[0], "left")
    car = Modification(added=(vehicle("Added1", 12.0, 0.0),))
    Augmentation.objects.update(modification=modification_to_document(car))
    for row in Augmentation.objects.all():
        default_storage.save(row.image, ContentFile(png(90, width=12, height=8)))
    GenerationJob.objects.update(state=GenerationJob.State.FINISHED)
    close_study(study=made)
    made.refresh_from_db()
    rate(study=made, rounds=20)
    return made


def write(client: Client, study: Study, kind: str) -> StudyFile:
    """Press the button, and be the worker that it asks."""
    client.post(reverse("study-write", args=[study.code, kind]))
    row = StudyFile.objects.get(study=study, kind=kind)
    STUDY_FILES.perform(row.pk)
    row.refresh_from_db()
    return row


def content_of(client: Client, study: Study, kind: str) -> bytes:
    return b"".join(client.get(reverse("study-file", args=[study.code, kind])))


def shown(client: Client, study: Study) -> str:
    return client.get(reverse("study", args=[study.code])).content.decode()


@pytest.mark.slow
def test_a_worker_writes_the_folder_of_the_command_as_one_zip(
    closed: Study, tmp_path: Path, admin: Client
) -> None:
    assert reverse("study-write", args=[closed.code, "study"]) in shown(admin, closed)
    row = write(admin, closed, "study")
    assert reverse("study-file", args=[closed.code, "study"]) in shown(admin, closed)
    packed = content_of(admin, closed, "study")
    assert len(packed) == row.size_bytes
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        found = {name: archive.read(name) for name in archive.namelist()}
    assert found == export(closed, tmp_path / "out")
    assert Event.objects.get(verb="ask for a file").after == {"file": "study"}


def test_a_making_that_fails_says_why(closed: Study, admin: Client) -> None:
    GenerationJob.objects.update(state=GenerationJob.State.RUNNING)
    assert write(admin, closed, "study").state == "failed"
    assert "of this study still runs" in shown(admin, closed)
    GenerationJob.objects.update(state=GenerationJob.State.FINISHED)
    admin.post(reverse("study-write", args=[closed.code, "study"]))
    newest = StudyFile.objects.latest("pk")
    STUDY_FILES.perform(newest.pk)
    assert StudyFile.objects.get().state == "ready", "and the failed one is gone"


def test_a_worker_writes_the_zip_of_the_newest_rating(
    closed: Study, admin: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_charts(monkeypatch)
    assert write(admin, closed, "rating").state == "ready"
    address = reverse("results-export", args=[closed.code, "all", "zip"])
    assert content_of(admin, closed, "rating") == admin.get(address).content


def test_an_open_study_gives_away_no_results(closed: Study) -> None:
    Study.objects.update(state=Study.State.OPEN)
    accounts = people()
    admin, expert = signed_in(accounts["admin"]), signed_in(accounts["expert"])
    for kind in ("study", "rating"):
        for name in ("study-write", "study-file"):
            address = reverse(name, args=[closed.code, kind])
            answer = admin.post(address) if name == "study-write" else admin.get(address)
            assert answer.status_code == 403, (kind, name)
            assert address not in shown(admin, closed)
    assert "results-export" not in shown(admin, closed)
    assert write(admin, closed, "interplan").state == "ready", "which contestant drew what: staff"
    voter = signed_in(User.objects.get(username="eva"))
    for one in (expert, voter):
        address = reverse("study-file", args=[closed.code, "interplan"])
        assert one.get(address).status_code == 403


def test_whoever_looked_early_may_have_the_rating_but_not_the_whole(closed: Study) -> None:
    Study.objects.update(state=Study.State.OPEN)
    admin = people()["admin"]
    EarlyLook.objects.create(study=closed, user=admin)
    client = signed_in(admin)
    assert write(client, closed, "rating").state == "ready"
    client.post(reverse("study-write", args=[closed.code, "study"]))
    assert not StudyFile.objects.filter(kind="study").exists()
    assert "It is written once the study is closed" in shown(client, closed)
    other = signed_in(User.objects.get(username="the-researcher"))
    address = reverse("study-file", args=[closed.code, "rating"])
    assert other.get(address).status_code == 403, "each looks on their own account"
    client.post(reverse("study-write", args=[closed.code, "rating"]))
    cancel_study(study=closed)
    waiting = StudyFile.objects.latest("pk")
    STUDY_FILES.perform(waiting.pk)
    waiting.refresh_from_db()
    assert (waiting.state, "cancelled" in waiting.reason) == ("failed", True)


FORM = {**{"title": "Streets", "scenarios": "street-*"}, **{"practice": "40", "seed": "1"}}


def test_it_is_counted_made_written_and_got(settings: Settings, tmp_path: Path) -> None:
    settings.MEDIA_ROOT = tmp_path
    for number in range(1, 6):
        add_street(number)
    cast = people()
    admin, researcher = signed_in(cast["admin"]), signed_in(cast["researcher"])
    counted = admin.post(reverse("benchmark-new"), FORM | {"title": "", "estimate": "1"})
    counts = {
        label: (line["practice"], line["test"])
        for label, line in counted.context["counts"].items()
    }
    assert counts == {"Easy": (2, 3), "Medium": (0, 0), "Hard": (0, 0), "All": (2, 3)}
    assert not Benchmark.objects.exists()
    made = admin.post(reverse("benchmark-new"), FORM)
    row = Benchmark.objects.get()
    assert made["Location"] == reverse("benchmark", args=[row.code])
    assert 'id="live" data-live' in researcher.get(made["Location"]).content.decode()
    BENCHMARK_FILES.perform(BenchmarkFile.objects.get().pk)
    page = researcher.get(made["Location"]).content.decode()
    assert all(text in page for text in (row.checksum, "streets-1.zip", "5 tasks", "street-3"))
    answer = researcher.get(reverse("benchmark-file", args=[row.code]))
    check_no_test_reference(row, b"".join(answer), page)
    researcher.post(reverse("benchmark-retired", args=[row.code]))
    row.refresh_from_db()
    assert row.retired_at is None, "that is for admins"
    admin.post(reverse("benchmark-retired", args=[row.code]))
    assert "retired" in admin.get(reverse("benchmarks")).content.decode()


def check_no_test_reference(row: Benchmark, content: bytes, page: str) -> None:
    """No document of a reference of the test is in the zip or on the page, nor a number of it."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    practice = {item.scenario.slug for item in row.items.filter(split="practice")}
    assert len(practice) == 2
    references = {name for name in files if name.startswith("references/")}
    assert references == {f"references/{slug}.json" for slug in practice}
    for item in row.items.select_related("scenario"):
        (agent,) = modification_from_document(item.scenario.reference).added
        where = {name for name, written in files.items() if str(agent.x_m).encode() in written}
        slug = item.scenario.slug
        assert where == ({f"references/{slug}.json"} if slug in practice else set())
        whole = json.dumps((item.scenario.reference or {})["add"]).encode()
        assert not [name for name, written in files.items() if whole in written and not where]
        assert str(agent.x_m) not in page


def test_what_is_wrong_is_told_at_its_field(admin: Client) -> None:
    answer = admin.post(reverse("benchmark-new"), FORM | {"title": ""})
    assert answer.status_code == 422
    assert list(answer.context["form"].errors) == ["title"]
    answer = admin.post(reverse("benchmark-new"), FORM | {"scenarios": "no", "estimate": "1"})
    assert answer.status_code == 200
    assert "Unknown scenario" in answer.content.decode()
