"""Caps on the pages: entered at launch, shown beside what is used, raised where a job stopped."""

from decimal import Decimal

import pytest
from django.urls import reverse

from arena.templatetags.marks import usd
from augment.models import GenerationJob
from augment.services.running import runner
from augment.services.running.budget import Caps
from tests.jobs.models import Model, llama_job
from tests.jobs.rows import add_scenario, only_row
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def page_of(job: GenerationJob, role: str = "admin") -> str:
    answer = signed_in(people()[role]).get(reverse("job-tab", args=[job.code, "money"]))
    return " ".join(answer.content.decode().split())


def ran(job: GenerationJob, model: Model | None = None) -> GenerationJob:
    runner.Augmentations(model or Model()).perform(only_row(job).pk)
    job.refresh_from_db()
    return job


def test_the_page_shows_what_is_spent_beside_the_cap() -> None:
    shown = page_of(ran(llama_job(price="2", caps=Caps(cap_usd=Decimal("0.5")))))
    assert "$0.0060" in shown
    assert "$0.50" in shown
    assert "unknown" not in shown


def test_a_stopped_job_is_raised_and_resumed_from_its_page() -> None:
    job = ran(llama_job(caps=Caps(cap_tokens=5)))
    admin = signed_in(people()["admin"])
    url, resume = reverse("job", args=[job.code]), reverse("job-resume", args=[job.code])
    shown = admin.get(url).content.decode()
    assert "Stopped at cap" in shown
    assert "Stopped at its cap." in shown
    progress = admin.get(reverse("job-progress", args=[job.code])).json()
    assert (progress["state"], progress["is_over"]) == ("stopped_at_cap", True)
    for wrong, sentence in (("3", "must be higher"), ("many", "A cap is a number")):
        assert sentence in admin.post(resume, {"cap_tokens": wrong}, follow=True).content.decode()
    job.refresh_from_db()
    assert (job.state, job.cap_tokens) == (GenerationJob.State.STOPPED_AT_CAP, 5)
    admin.post(resume, {"cap_tokens": "90000"})
    job.refresh_from_db()
    assert (job.state, job.cap_tokens) == (GenerationJob.State.RUNNING, 90_000)


@pytest.mark.parametrize(
    ("amount", "shown"),
    [
        (None, "unknown"),
        (Decimal(0), "$0.00"),
        (Decimal("1234.5"), "$1,234.50"),
        (Decimal("0.00345"), "$0.0034"),
        (Decimal("0.000000001"), "less than $0.0001"),
    ],
)
def test_an_amount_is_short_and_honest(amount: Decimal | None, shown: str) -> None:
    assert usd(amount) == shown


def test_an_estimate_launches_nothing_and_asks_for_no_name() -> None:
    ran(llama_job(price="1"))
    add_scenario("street")
    sent = {"contestants": ["llama"], "scenarios": ["street"], "estimate": "1"}
    admin = signed_in(people()["admin"])
    for cap, sentence in (("", "1–2"), ("0.002", "the job may stop early")):
        answer = admin.post(reverse("job-new"), sent | {"cap_usd": cap})
        assert answer.status_code == 200
        shown = " ".join(answer.content.decode().split())
        assert sentence in shown
        assert "This field is required" not in shown
    assert GenerationJob.objects.count() == 1
