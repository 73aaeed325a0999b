"""Launching, watching, retrying and cancelling a job by its pages; caps, grid and a new one."""

import re
from collections.abc import Callable
from decimal import Decimal
from typing import Any

import pytest
from django.test import Client
from django.urls import reverse

from arena.templatetags.marks import usd
from augment.models import Augmentation, Contestant, Endpoint, EndpointModel, GenerationJob, Worker
from augment.services.running import jobs, runner
from augment.services.running.budget import Caps
from augment.services.running.entering import AcceptRequest, accept_submission
from augment.services.running.jobs import JobRequest
from augment.services.running.workers import Presence
from tests.entering import a_benchmark, entrant, read, sent
from tests.jobs import rows
from tests.jobs.models import Model, llama_job
from tests.jobs.rows import add_scenario, only_row
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


State = Augmentation.State
OnCommit = Callable[..., object]


def test_a_launched_job_has_a_row_per_contestant_and_scenario(
    django_capture_on_commit_callbacks: OnCommit, admin: Client
) -> None:
    rows.add_kind("reference")
    for slug in ("one", "two"):
        rows.add_scenario(slug)
    sent = {"name": "Night run", "contestants": ["reference"], "scenarios": ["one", "two"]}
    with django_capture_on_commit_callbacks() as waiting:  # type: ignore[attr-defined]
        answer = admin.post(reverse("job-new"), sent)
    job = GenerationJob.objects.get()
    assert answer.headers["Location"] == reverse("job", args=[job.code])
    assert job.augmentations.filter(state="queued").count() == 2
    assert len(waiting) == 1, "the rows are put on the queue once they are stored"


def test_the_page_groups_failures_by_their_reason_and_retries_them() -> None:
    job = rows.launch(scenarios=3)
    for row in job.augmentations.all():
        rows.leased(row).settle(rows.failed(), now=rows.NOON)
    admin, url = signed_in(people()["admin"]), reverse("job-tab", args=[job.code, "failures"])
    shown = admin.get(url).content.decode()
    assert shown.count("The wire broke") == 1
    assert "Retry 3 failed" in shown
    admin.post(reverse("job-retry", args=[job.code]))
    assert job.augmentations.filter(state=Augmentation.State.QUEUED).count() == 3


def test_a_job_is_paused_says_what_still_runs_and_is_resumed() -> None:
    job = rows.launch(scenarios=3)
    held = rows.leased(job.augmentations.all()[0])
    admin, url = signed_in(people()["admin"]), reverse("job", args=[job.code])
    answer = admin.post(reverse("job-pause", args=[job.code]), follow=True).content.decode()
    assert "Pausing, 1 running" in answer
    assert 'id="pause"' not in answer
    held.settle(rows.done(), now=rows.NOON)
    shown = admin.get(url).content.decode()
    assert "Paused" in shown
    assert "js/live.js" not in shown, "nothing moves"
    admin.post(reverse("job-resume", args=[job.code]))
    job.refresh_from_db()
    assert job.state == GenerationJob.State.RUNNING
    assert (
        "be resumed"
        in admin.post(reverse("job-resume", args=[job.code]), follow=True).content.decode()
    )


def test_a_job_that_is_cancelled_before_anything_ran_shows_its_grid() -> None:
    job, admin = rows.launch(), signed_in(people()["admin"])
    admin.post(reverse("job-cancel", args=[job.code]), {"sure": "1"})
    assert 'id="grid"' in admin.get(reverse("job", args=[job.code])).content.decode()


def test_progress_is_counted_and_not_sent_again_while_nothing_changes() -> None:
    job = rows.launch(scenarios=2)
    admin, url = signed_in(people()["admin"]), reverse("job-progress", args=[job.code])
    first = admin.get(url)
    body = first.json()
    assert (body["total"], body["settled"], body["is_over"]) == (2, 0, False)
    assert body["by_state"]["queued"] == 2
    same = admin.get(url, headers={"If-None-Match": first.headers["ETag"]})
    assert (same.status_code, same.content) == (304, b"")
    row = job.augmentations.all()[0]
    rows.leased(row).settle(rows.done(), now=rows.NOON)
    changed = admin.get(url, headers={"If-None-Match": first.headers["ETag"]})
    assert changed.json()["settled"] == 1


# --- Whether anybody works -----------------------------------------------------------------------


def test_a_page_with_waiting_work_says_since_when_no_worker_runs(researcher: Client) -> None:
    job = rows.launch()
    pages = [reverse("job", args=[job.code]), reverse("jobs")]

    def are_told(words: str) -> bool:
        return all(words in researcher.get(page).content.decode() for page in pages)

    assert are_told("No worker has been running yet.")
    Presence("here 1").beat()
    Worker.objects.update(seen_at=rows.NOON)
    assert are_told("No worker has been running since 20 November 2026, 12:00 UTC.")
    assert are_told("goes on as soon as one starts")
    progress = researcher.get(reverse("job-progress", args=[job.code])).json()
    assert not progress["is_worked_on"]


def money_of(job: GenerationJob, role: str = "admin") -> str:
    answer = signed_in(people()[role]).get(reverse("job-tab", args=[job.code, "money"]))
    return " ".join(answer.content.decode().split())


def run_one(job: GenerationJob, model: Model | None = None) -> GenerationJob:
    runner.Augmentations(model or Model()).perform(only_row(job).pk)
    job.refresh_from_db()
    return job


def test_the_page_shows_what_is_spent_beside_the_cap() -> None:
    shown = money_of(run_one(llama_job(price="2", caps=Caps(cap_usd=Decimal("0.5")))))
    assert "$0.0060" in shown
    assert "$0.50" in shown
    assert "unknown" not in shown


def test_a_stopped_job_is_raised_and_resumed_from_its_page(admin: Client) -> None:
    job = run_one(llama_job(caps=Caps(cap_tokens=5)))
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


def test_an_estimate_launches_nothing_and_asks_for_no_name(admin: Client) -> None:
    run_one(llama_job(price="1"))
    add_scenario("street")
    sent = {"contestants": ["llama"], "scenarios": ["street"], "estimate": "1"}
    for cap, sentence in (("", "1–2"), ("0.002", "the job may stop early")):
        answer = admin.post(reverse("job-new"), sent | {"cap_usd": cap})
        assert answer.status_code == 200
        shown = " ".join(answer.content.decode().split())
        assert sentence in shown
        assert "This field is required" not in shown
    assert GenerationJob.objects.count() == 1


CELL = re.compile(r'id="cell-')
Questions = Callable[[int], object]


def large_job(*, scenarios: int, contestants: int, samples: int = 1) -> GenerationJob:
    """A job that is over, with a row for every cell."""
    where, who = rows.add_many_scenarios(scenarios), rows.add_many_contestants(contestants)
    job = GenerationJob.objects.create(
        name="Large", samples=samples, state=GenerationJob.State.FINISHED
    )
    Augmentation.objects.bulk_create(
        (
            Augmentation(
                job=job,
                scenario=scenario,
                contestant=contestant,
                sample=sample,
                state=State.UNREADABLE,
                reason="no block",
            )
            for scenario in where
            for contestant in who
            for sample in range(1, samples + 1)
        ),
        batch_size=1000,
    )
    return job


def grid_of(researcher: Client, job: GenerationJob, query: str = "") -> str:
    return researcher.get(reverse("job-tab", args=[job.code, "grid"]) + query).content.decode()


@pytest.mark.slow
def test_ten_thousand_cells_cost_as_much_as_a_page_of_them(
    researcher: Client, django_assert_max_num_queries: Questions
) -> None:
    job = large_job(scenarios=100, contestants=20, samples=5)
    assert job.augmentations.count() == 10_000
    for query in ("", "?row=17", "?state=unreadable&q=street-09"):
        with django_assert_max_num_queries(16):  # type: ignore[attr-defined]
            found = grid_of(researcher, job, query)
        assert 0 < len(CELL.findall(found)) <= 300
        assert len(found) < 300_000


def test_every_cell_is_on_exactly_one_page(researcher: Client) -> None:
    job = large_job(scenarios=7, contestants=12, samples=12)
    seen: list[str] = []
    query: str | None = ""
    while query is not None:
        found = grid_of(researcher, job, query)
        seen += re.findall(r'id="cell-([0-9a-f-]+)"', found)
        following = re.search(r'href="([^"]*)" rel="next"', found)
        query = following and following[1]
    assert len(seen) == len(set(seen)) == 7 * 12 * 12


def test_the_grid_is_narrowed_by_word_and_state(researcher: Client) -> None:
    job = large_job(scenarios=3, contestants=2)
    first = job.augmentations.filter(scenario__slug="street-000").order_by("pk")[0]
    job.augmentations.filter(pk=first.pk).update(state=State.FAILED, reason="broke")
    everything = ["street-000", "street-002", "street-001"]  # two of one type, one of another
    for query, shown in {
        "?q=street-001": ["street-001"],
        "?state=failed": ["street-000"],
        "?state=failed&q=street-001": [],
        "?state=no-such-state&row=x&view=oil": everything,
        "?row=9999": everything,
    }.items():
        grid = grid_of(researcher, job, query).split('id="grid"')[1]
        found = re.findall(r'<th scope="row">\s*<a[^>]*>(street-\d+)</a>', grid)
        assert found == shown, query


ACCEPTED = AcceptRequest(slug="theirs", name="Theirs", runs=False)
OTM, VQA, FC = "otm|here|seer", "vqa|here|seer", "fc|here|seer"


@pytest.fixture
def models() -> Endpoint:
    site = Endpoint.objects.create(label="here", base_url="http://127.0.0.1:9/v1")
    EndpointModel.objects.create(endpoint=site, model="seer", vision=True)
    EndpointModel.objects.create(endpoint=site, model="blind", vision=False)
    EndpointModel.objects.create(endpoint=site, model="unknown")
    for slug in ("one", "two"):
        rows.add_scenario(slug)
    return site


def launch(admin: Client, **given: Any) -> str:
    sent = {"name": "Round 2", "scenarios": ["one", "two"], **given}
    return admin.post(reverse("job-new"), sent, follow=True).content.decode()


def test_impossible_cells_are_disabled_and_say_why_in_the_text(
    admin: Client, models: Endpoint
) -> None:
    shown = admin.get(reverse("job-new")).content.decode()
    boxes = dict(re.findall(r'name="cells" value="([^"]+)"( disabled)?', shown))
    assert {key for key, off in boxes.items() if off} == {
        f"{variant}|here|{model}"
        for variant in ("vqa", "fc+vqa", "fc-plus+vqa")
        for model in ("blind", "unknown")
    }
    assert shown.count("needs vision, and it sees text alone") == 3
    assert shown.count("nobody knows whether it sees pictures: probe it") == 3
    assert "is not one of the available choices" in launch(admin, cells=["vqa|here|blind"])
    assert not GenerationJob.objects.exists()


def test_whoever_can_not_run_on_every_scenario_is_not_ticked_at_first(
    admin: Client, models: Endpoint
) -> None:
    """A scenario that is only a sentence has no reference, a submission answers its own alone."""
    for slug, kind in (("reference", "reference"), ("rule-placer", "rule")):
        rows.add_kind(slug, kind)

    def ticked() -> list[str]:
        shown = admin.get(reverse("job-new")).content.decode()
        return re.findall(r'name="contestants"\s+value="([^"]+)" checked', shown)

    assert ticked() == ["reference", "rule-placer"]
    rows.add_scenario("sentence", reference=None)
    assert ticked() == ["rule-placer"]
    enno = entrant()
    accept_submission(read(sent(a_benchmark(), enno)), ACCEPTED, actor=enno)
    assert ticked() == ["rule-placer"]


def test_a_cell_becomes_its_contestant_once_and_other_options_another(
    admin: Client, models: Endpoint
) -> None:
    launch(admin, cells=[OTM, FC])
    launch(admin, cells=[OTM])
    assert Contestant.objects.filter(endpoint=models).count() == 2
    launch(admin, cells=[OTM], temperature="0.7", rounds="2", protocol="native")
    warm = Contestant.objects.get(endpoint=models, options={"temperature": 0.7})
    assert (warm.variant, warm.kind) == ("otm", "llm"), "otm has no use for rounds or a protocol"
    first, second, third = GenerationJob.objects.order_by("pk")
    assert first.augmentations.count() == 4
    assert set(second.contestants.all()) < set(first.contestants.all())
    assert list(third.contestants.all()) == [warm]


def test_what_can_not_be_launched_is_said_and_nothing_is_made(
    admin: Client, models: Endpoint
) -> None:
    wrong: list[tuple[dict[str, object], str]] = [
        ({}, "Choose at least one contestant."),
        ({"cells": ["otm|here"]}, "is not one of the available choices"),
        ({"cells": [OTM], "temperature": "3"}, "less than or equal to 2"),
        ({"cells": [OTM], "scenarios": []}, "Choose at least one scenario."),
    ]
    for given, words in wrong:
        assert words in launch(admin, **given), given
    assert not GenerationJob.objects.exists()
    assert not Contestant.objects.filter(endpoint=models).exists()


def test_one_scenario_is_tried_first_and_the_rest_is_remembered(
    admin: Client, models: Endpoint
) -> None:
    shown = launch(
        admin, cells=[OTM, VQA], samples="3", cap_usd="", cap_calls="500", **{"try": "1"}
    )
    job = GenerationJob.objects.get()
    assert (job.name, job.samples, job.cap_calls) == ("Round 2, first try", 1, 500)
    assert job.augmentations.count() == 2, "one scenario, two contestants, one sample"
    assert "Launch all of it" in shown
    address = f"{reverse('job-new')}?like={job.code}&amp;all=1"
    assert f'href="{address}"' in shown
    form = admin.get(address.replace("&amp;", "&")).content.decode()
    assert 'value="Round 2"' in form
    ticked = re.findall(r'name="(contestants|scenarios)" value="([^"]+)" checked', form)
    slugs = set(job.contestants.values_list("slug", flat=True))
    assert {value for name, value in ticked if name == "contestants"} == slugs
    assert {value for name, value in ticked if name == "scenarios"} == {"one", "two"}
    assert 'type="number" name="samples" value="3"' in form
    assert 'type="number" name="cap_calls" value="500"' in form


def test_a_duplicate_fills_the_form_with_what_the_job_had(admin: Client, models: Endpoint) -> None:
    rows.add_kind("reference")
    job = jobs.launch(
        JobRequest(
            name="Old",
            contestants=["reference"],
            scenarios=["two"],
            cap_tokens=7,
            samples=2,
            is_fresh=True,
        )
    )
    form = admin.get(f"{reverse('job-new')}?like={job.code}").content.decode()
    for part in (
        'value="Old (2)"',
        'name="contestants" value="reference" checked',
        'name="scenarios" value="two" checked',
        'type="number" name="cap_tokens" value="7"',
        'name="is_fresh" value="on" checked',
    ):
        assert part in form
    assert 'name="scenarios" value="one" checked' not in form
    for nobody in ("no-code", "00000000-0000-0000-0000-000000000000"):
        assert admin.get(f"{reverse('job-new')}?like={nobody}").status_code == 200
