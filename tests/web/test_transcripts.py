"""The page of a transcript, its JSON, and the pictures that models were shown."""

import pytest
from django.urls import reverse

from augment.models import Augmentation
from augment.services.running import jobs, runner
from augment.services.running.jobs import JobRequest
from tests.jobs.models import Model, llama_job, reply
from tests.jobs.rows import only_row
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

EVIL = "<script>alert(1)</script>"


def ran(row: Augmentation, model: Model | None = None) -> Augmentation:
    runner.Augmentations(model or Model()).perform(row.pk, worker="w")
    row.refresh_from_db()
    return row


def page_of(row: Augmentation) -> str:
    answer = signed_in(people()["researcher"]).get(reverse("augmentation", args=[row.code]))
    assert answer.status_code == 200
    return " ".join(answer.content.decode().split())


def test_the_page_shows_role_tokens_cost_and_the_answer() -> None:
    shown = page_of(ran(only_row(llama_job(price="2"))))
    assert "Call 1, modifier" in shown
    assert "2,900 tokens in, 120 out" in shown
    assert "$0.0060" in shown
    assert "A parked car ahead." in shown
    assert "llama3.1-2407" in shown
    assert "Prompt version" in shown


def test_a_call_from_the_store_is_marked_and_leads_to_its_source() -> None:
    first = ran(only_row(llama_job(price="1")))
    job = jobs.launch(JobRequest(name="Again", contestants=["llama"], scenarios=["street-1"]))
    shown = page_of(ran(only_row(job)))
    assert "answered from the store" in shown
    source = f"{reverse('augmentation', args=[first.code])}#call-1-1"
    assert source in shown


def test_what_a_model_says_is_never_markup() -> None:
    shown = page_of(ran(only_row(llama_job()), Model(lambda request: reply(EVIL))))
    assert EVIL not in shown
    assert "&lt;script&gt;alert(1)" in shown


@pytest.mark.parametrize("digest", ["0" * 64, "0" * 63, "A" * 64, "secret_key"])
def test_no_other_file_is_given_out(digest: str) -> None:
    url = reverse("asked-image", args=[digest])
    assert signed_in(people()["admin"]).get(url).status_code == 404
