"""What is sent three times at once, by a form or to the API, is made once."""

import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from typing import Any

import pytest
from django.core.files.uploadedfile import SimpleUploadedFile
from django.db import IntegrityError, connection
from django.db.models import Model
from django.test import Client
from django.urls import reverse
from django.utils import timezone

from arena.models import ApiToken, Enrolment, Person, Receipt, StudyDraft
from arena.shell import receipts
from arena.studies.services.taking_part import set_enrolment
from augment.models import GenerationJob, SceneUpload
from tests.api.asking import error_of
from tests.api.test_resources import STREET
from tests.api.tokens import secret_of
from tests.jobs.rows import add_kind, add_scenario
from tests.study_rows import a_study
from tests.web.cast import people
from tests.web.test_enrolments import RULES

pytestmark = [pytest.mark.django_db(transaction=True), pytest.mark.slow, pytest.mark.timeout(900)]

JOB = {"name": "Twice", "contestants": ["reference"], "scenarios": ["far"]}
UPLOAD = {"file": ("street.json", STREET), "format": ""}
PERSON = {"username": "bob", "role": "expert"}
TOKEN = {"name": "Mine", "role": "admin", "days": "7"}
Body = dict[str, Any]


@pytest.fixture
def enrolment() -> Enrolment:
    """A study that anybody may take part in, and what a job can be made of."""
    add_kind("reference")
    add_scenario("far")
    return set_enrolment(study=a_study(), rules=RULES)


def as_files(body: Body) -> Body:
    """The body, names with contents as files, which are read to their end once sent."""
    return {
        name: SimpleUploadedFile(*value) if isinstance(value, tuple) else value
        for name, value in body.items()
    }


def send_thrice(send: Callable[[], Any], makes: type[Model]) -> list[Any]:
    """Send at once, by three connections, what makes one row; returns the answers."""

    def send_apart(_: int) -> Any:
        try:
            return send()
        finally:
            connection.close()

    before = makes._default_manager.count()
    with ThreadPoolExecutor(3) as pool:
        answers = list(pool.map(send_apart, range(3)))
    assert makes._default_manager.count() == before + 1, answers[0].content[-300:]
    return answers


def test_a_form_counts_once_whatever_its_page_answers(enrolment: Enrolment, admin: Client) -> None:
    """Every page for a role goes the way of these: it leads elsewhere, or shows a key once."""
    agreed = {"agreed": "on", "agreed_sha256": enrolment.consent_sha256}
    code, token = [enrolment.study.code], [enrolment.token]
    forms: dict[str, tuple[str, Body, type[Model]]] = {
        "what a form makes": (reverse("job-new"), JOB, GenerationJob),
        "a button": (reverse("study-again", args=code), {}, StudyDraft),
        "a key that is shown once": (reverse("api-tokens"), TOKEN, ApiToken),
        "a file": (reverse("scene-send"), UPLOAD, SceneUpload),
        "nobody yet": (reverse("enrol", args=token), {"external_id": "w", **agreed}, Person),
    }
    for number, (name, (url, body, makes)) in enumerate(forms.items()):

        def send(name: str = name, url: str = url, body: Body = body, n: int = number) -> Any:
            client = Client()
            if name != "nobody yet":
                client.cookies = admin.cookies
            return client.post(url, as_files(body) | {"csrfmiddlewaretoken": f"{n:064d}"})

        answers = send_thrice(send, makes)
        assert name != "nobody yet" or {answer.status_code for answer in answers} == {302}


def test_an_operation_counts_once_and_is_answered_the_same(enrolment: Enrolment) -> None:
    headers = {"Authorization": f"Bearer {secret_of(people()['admin'])}"}
    operations: dict[str, tuple[Body, type[Model]]] = {
        "api-people": (PERSON, Person),
        "api-jobs": (JOB, GenerationJob),
        "api-uploads": (UPLOAD, SceneUpload),
    }
    for name, (body, makes) in operations.items():

        def send(name: str = name, body: Body = body) -> Any:
            client = Client(headers=headers | {"Idempotency-Key": name})
            if name == "api-uploads":
                return client.post(reverse(name), as_files(body))
            return client.post(reverse(name), body, content_type="application/json")

        answers = send_thrice(send, makes)
        assert len({answer.content for answer in answers}) == 1, name
        assert {answer.status_code for answer in answers} <= {201, 202}, name


def test_a_form_sent_again_shows_what_it_made_and_can_be_sent_once_more(
    enrolment: Enrolment, admin: Client
) -> None:
    page = admin.get(reverse("job-new")).content.decode()
    token = re.search(r'name="csrfmiddlewaretoken" value="(\w+)"', page)
    form = JOB | {"csrfmiddlewaretoken": token and token[1]}
    first = admin.post(reverse("job-new"), form)
    shown = admin.post(reverse("job-new"), form).content.decode()
    assert "This was sent already" in shown
    assert f'href="{first["Location"]}"' in shown
    hidden = re.findall(r'type="hidden" name="(\w+)" value="([^"]*)"', shown)
    assert admin.post(reverse("job-new"), dict(hidden)).status_code == 302
    assert GenerationJob.objects.filter(name="Twice").count() == 2
    changed = form | {"name": "Another"}
    assert admin.post(reverse("job-new"), changed).status_code == 302, "it is another form"


def test_who_waits_while_the_first_is_refused_comes_next(monkeypatch: pytest.MonkeyPatch) -> None:
    refusals, ask = iter([IntegrityError("it is there")]), Receipt.objects.get_or_create

    def refuse_once(**columns: Any) -> Any:
        for refusal in refusals:
            raise refusal
        return ask(**columns)

    monkeypatch.setattr(Receipt.objects, "get_or_create", refuse_once)
    assert receipts.answer_once("key", "body", lambda: "made", lambda _: (201, b"")) == "made"


def test_a_key_is_kept_a_day_and_its_answer_sealed() -> None:
    headers = {"Authorization": f"Bearer {secret_of(people()['admin'])}", "Idempotency-Key": "k"}
    client = Client(headers=headers)

    def send(path: str, body: Body) -> Any:
        return client.post(f"/api/v1/{path}", body, content_type="application/json")

    made = send("people", PERSON)
    receipt = Receipt.objects.get()
    assert made.json()["link"].encode()[-20:] not in bytes(receipt.answer)
    assert send("people", PERSON).content == made.content
    error_of(send("people", PERSON | {"role": "admin"}), 422, "key_reused")
    error_of(send("jobs", JOB), 422, "key_reused")
    Receipt.objects.update(received_at=timezone.now() - timedelta(hours=25))
    assert send("people", PERSON).status_code != 201, "the name is taken"
    assert not Receipt.objects.exists(), "what made nothing may be sent again"


def test_a_request_that_is_still_under_way_is_not_carried_out_again(
    admin: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(receipts, "WAIT_S", 0.0)
    form = TOKEN | {"csrfmiddlewaretoken": 64 * "a"}
    admin.post(reverse("api-tokens"), form)
    Receipt.objects.update(status=None)
    waiting = admin.post(reverse("api-tokens"), form)
    assert (waiting.status_code, ApiToken.objects.count()) == (409, 1)
    Receipt.objects.update(received_at=timezone.now() - timedelta(hours=1))
    assert admin.post(reverse("api-tokens"), form).status_code == 201, "its server died"
