"""Files of a study by buttons of its page: a worker writes each, for whoever may have it."""

import io
import zipfile
from pathlib import Path

import pytest
from django.contrib.auth.models import User
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.test import Client
from django.urls import reverse
from pytest_django import Settings

from arena.models import EarlyLook, Study, StudyFile
from arena.results.exports.study_folder import STUDY_FILES
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import cancel_study, close_study
from augment.models import Augmentation, Event, GenerationJob
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from tests.exports.test_study_folder import export
from tests.scenes import vehicle
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


def test_a_worker_writes_the_folder_of_the_command_as_one_zip(
    closed: Study, tmp_path: Path
) -> None:
    admin = signed_in(people()["admin"])
    address = reverse("study-file", args=[closed.code, "study"])
    assert reverse("study-write", args=[closed.code, "study"]) in shown(admin, closed)
    admin.post(reverse("study-write", args=[closed.code, "study"]))
    assert all(word in shown(admin, closed) for word in ("waits for a worker", "data-live"))
    assert admin.get(address).status_code == 404, "it is not there yet"
    row = write(admin, closed, "study")
    assert StudyFile.objects.count() == 1, "one that waits is asked for once more"
    assert address in shown(admin, closed)
    assert "data-live" not in shown(admin, closed)
    packed = content_of(admin, closed, "study")
    assert len(packed) == row.size_bytes
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        found = {name: archive.read(name) for name in archive.namelist()}
    assert found == export(closed, tmp_path / "out")
    assert Event.objects.get(verb="ask for a file").after == {"file": "study"}


def test_a_making_that_fails_says_why(closed: Study) -> None:
    admin = signed_in(people()["admin"])
    GenerationJob.objects.update(state=GenerationJob.State.RUNNING)
    assert write(admin, closed, "study").state == "failed"
    assert "of this study still runs" in shown(admin, closed)
    GenerationJob.objects.update(state=GenerationJob.State.FINISHED)
    admin.post(reverse("study-write", args=[closed.code, "study"]))
    newest = StudyFile.objects.latest("pk")
    STUDY_FILES.perform(newest.pk)
    assert StudyFile.objects.get().state == "ready", "and the failed one is gone"


def test_a_worker_writes_the_zip_of_the_newest_rating(closed: Study) -> None:
    admin = signed_in(people()["admin"])
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


def test_what_became_impossible_meanwhile_is_not_written(closed: Study) -> None:
    Study.objects.update(state=Study.State.OPEN)
    admin = people()["admin"]
    EarlyLook.objects.create(study=closed, user=admin)
    client = signed_in(admin)
    client.post(reverse("study-write", args=[closed.code, "rating"]))
    cancel_study(study=closed)
    row = StudyFile.objects.get()
    STUDY_FILES.perform(row.pk)
    row.refresh_from_db()
    assert (row.state, "cancelled" in row.reason) == ("failed", True)
