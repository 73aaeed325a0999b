"""An entrant who tries every address gets what is theirs, and no reference of the test split."""

import io
import zipfile
from typing import Any

import pytest
from django.contrib.auth.models import User
from django.http.response import HttpResponseBase
from django.test import Client
from django.urls import reverse

from arena.models import BenchmarkFile, Study
from arena.scenarios.exports.benchmarks import BENCHMARK_FILES
from arena.studies.services.opening import close_study
from augment.models import Augmentation, Benchmark, Scenario, Submission
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.running.entering import AcceptRequest, accept_submission
from augment.services.scenarios.pictures import store
from tests.api.tokens import program_of
from tests.entering import a_benchmark, entrant, packed, read, sent
from tests.journeys.blindness import every_view, fill
from tests.scenes import cone
from tests.study_rows import a_study, hang
from tests.web.cast import people, png

pytestmark = [pytest.mark.django_db, pytest.mark.slow]

OWN = {
    *("home", "password", "api-tokens", "submissions", "submission-new", "submission"),
    *("benchmarks", "benchmark", "benchmark-file", "api-submission"),
    *("login", "first", "healthz", "readyz"),
}
"""What may answer with content."""
SECRETS = (b"zanzibar", b"23.4567", b"quixotic", b"xylophone")
"""Parts of the references of the test split; another's system; a contestant of studies."""


@pytest.fixture
def benchmark() -> Benchmark:
    """Its test references have telling ids and places; its zip is written."""
    made = a_benchmark()
    of_test = made.items.filter(split="test").values("scenario")
    telling = Modification(added=(cone("zanzibar", 23.4567, 0.0),))
    assert Scenario.objects.filter(pk__in=of_test).update(
        reference=modification_to_document(telling)
    )
    assert BENCHMARK_FILES.perform(BenchmarkFile.objects.create(benchmark=made).pk)
    return made


@pytest.fixture
def study(benchmark: Benchmark) -> Study:
    """A study that is open and one that is closed, with pictures."""
    study = a_study(contestants=("xylophone", "bob", "cid"))
    for number, row in enumerate(Augmentation.objects.all()):
        hang(row, store(png(number)))
    return study


@pytest.fixture
def own(benchmark: Benchmark) -> Submission:
    """One's own; beside it another's, which was accepted."""
    theirs = read(sent(benchmark, entrant("fred"), packed({"name": "Quixotic"}, street_1=_ONE)))
    accept_submission(
        theirs, AcceptRequest(slug="quixotic", name="Quixotic", runs=True), actor=people()["admin"]
    )
    return read(sent(benchmark, entrant(), packed(street_1=_ONE)))


_ONE = modification_to_document(Modification(added=(cone("Agent9", 21.0, 0.0),)))


def codes_of(study: Study) -> set[str]:
    """Codes of a row of each kind, and the token of a picture."""
    row = study.matchups.earliest("pk")
    theirs = Augmentation.objects.filter(contestant__slug="quixotic").earliest("pk")
    scenario = Scenario.objects.filter(benchmark_items__split="test").earliest("pk")
    found: list[Any] = [study, row, theirs, theirs.job, theirs.contestant]
    found += [scenario, scenario.base_scene]
    found += [*Submission.objects.all(), *Benchmark.objects.all(), row.expert.person]
    return {str(one.code) for one in found}


def told(answer: HttpResponseBase) -> bytes:
    """All that an answer says, and what is packed in it."""
    body = answer.getvalue()
    if not zipfile.is_zipfile(io.BytesIO(body)):
        return body.lower()
    with zipfile.ZipFile(io.BytesIO(body)) as archive:
        return b"\n".join(archive.read(name) for name in archive.namelist()).lower()


@pytest.mark.parametrize("is_closed", [False, True])
def test_every_address_answers_an_entrant_with_their_own_alone(
    study: Study, own: Submission, is_closed: bool
) -> None:
    if is_closed:
        close_study(study=study)
    assert own.uploaded_by is not None
    page, program = Client(), program_of(own.uploaded_by)
    page.force_login(own.uploaded_by)
    answered, token = set(), study.matchups.earliest("pk").left_token
    for name, address in every_view():
        for code in codes_of(study):
            here = fill(address, code, token)
            asked = [page.get(here), program.get(here)]
            if name not in ("logout", "submission-withdraw"):
                asked += [program.post(here)]
            for answer in asked:
                said = told(answer)
                assert not [secret for secret in SECRETS if secret in said], here
            if 200 in [answer.status_code for answer in asked[:2]]:
                answered.add(name)
                assert name in OWN, here
            if "<uuid" not in address or all(one.status_code == 403 for one in asked):
                break  # roles are asked before any row
    whole = {"submissions", "submission", "api-submission", "benchmark", "benchmark-file"}
    assert {"home"} | whole <= answered
    own.refresh_from_db()
    assert not own.is_decided
    staff, of_test = Client(), Scenario.objects.filter(benchmark_items__split="test")
    staff.force_login(User.objects.get(username="the-admin"))
    page_of_staff = staff.get(reverse("scenario", args=[of_test.earliest("pk").code]))
    assert SECRETS[0] in told(page_of_staff), "else nothing was proved"
