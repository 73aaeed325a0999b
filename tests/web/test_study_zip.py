"""The whole study by a button: the folder of the command, and only of a study that is closed."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.urls import reverse
from pytest_django import Settings

from arena.models import EarlyLook, Study, Vote
from arena.services.ratings import rate
from arena.services.studies import close_study
from augment.models import Augmentation, GenerationJob
from tests.append_only import rewriting
from tests.exports.test_study_folder import PNG, export
from tests.study_rows import a_study, matchups_of, vote
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db(transaction=True)


@pytest.fixture
def closed(tmp_path: Path, settings: Settings) -> Study:
    """With a vote and a rating."""
    settings.MEDIA_ROOT = tmp_path / "media"
    made = a_study()
    vote(matchups_of(made, "eva")[0], "left")
    for row in Augmentation.objects.all():
        default_storage.save(row.image, ContentFile(PNG))
    GenerationJob.objects.update(state=GenerationJob.State.FINISHED)
    close_study(study=made)
    made.refresh_from_db()
    rate(study=made, rounds=20)
    return made


def test_the_button_gives_the_same_folder_as_one_zip(closed: Study, tmp_path: Path) -> None:
    admin = signed_in(people()["admin"])
    address = reverse("study-export", args=[closed.code])
    assert address in admin.get(reverse("results", args=[closed.code])).content.decode()
    packed = io.BytesIO(b"".join(admin.get(address)))
    with zipfile.ZipFile(packed) as archive:
        found = {name: archive.read(name) for name in archive.namelist()}
    assert found == export(closed, tmp_path / "out")


def test_the_button_opens_no_study_that_takes_votes(closed: Study) -> None:
    Study.objects.update(state=Study.State.OPEN)
    admin = people()["admin"]
    address = reverse("study-export", args=[closed.code])
    assert signed_in(admin).get(address).status_code == 403
    EarlyLook.objects.create(study=closed, user=admin)
    answer = signed_in(admin).get(address, follow=True)
    assert "is open; close it before it is exported" in answer.content.decode()


def test_a_rating_whose_votes_were_changed_by_hand_is_told(closed: Study) -> None:
    with rewriting(Vote):
        Vote.objects.update(ms_visible=1)
    address = reverse("study-export", args=[closed.code])
    answer = signed_in(people()["admin"]).get(address, follow=True)
    assert "are not those of this rating any more" in answer.content.decode()
