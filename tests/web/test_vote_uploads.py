"""Votes that come as a file by a page."""

import pytest
from django.core.files.uploadedfile import SimpleUploadedFile
from django.http import HttpResponse
from django.urls import reverse

from arena.models import ImportedVote, Study
from arena.studies.pages import setup
from augment.models import Event
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

FINE = b"model_a,model_b,winner,judge,item\nann,bob,model_a,j1,i1\nbob,ann,tie,j2,i2\n"


def _send(content: bytes, *, file: str = "votes.csv", name: str = "Elsewhere") -> HttpResponse:
    admin = people()["admin"]
    sent = {"name": name, "file": SimpleUploadedFile(file, content)}
    answer = signed_in(admin).post(reverse("import-votes"), sent)
    assert isinstance(answer, HttpResponse)
    return answer


def test_a_file_becomes_a_closed_study_of_whoever_sent_it() -> None:
    answer = _send(FINE)
    study = Study.objects.get()
    assert answer.headers["Location"] == reverse("results", args=[study.code])
    assert (study.name, study.state, ImportedVote.objects.count()) == ("Elsewhere", "closed", 2)
    event = Event.objects.get(verb="import votes")
    assert event.actor is not None
    assert event.actor.username == "the-admin"


def test_a_file_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(setup, "MOST_MB", 0)
    answer = _send(FINE)
    assert answer.status_code == 422
    assert "Send a smaller one" in answer.content.decode()
    assert not Study.objects.exists()


def test_a_name_that_climbs_out_of_its_folder_stays_in_it() -> None:
    _send(b"model_a,model_b,winner\nann,bob,tie\n", file="../../etc/passwd")
    assert Study.objects.get().vote_file.name == "passwd"
