"""The grid of a job in parts: as many questions and bytes for ten thousand cells as for ten."""

from __future__ import annotations

import re
from collections.abc import Callable
from html import unescape
from itertools import product

import pytest
from django.db.models.signals import post_init
from django.test import Client
from django.urls import reverse

from augment.models import Augmentation, Contestant, GenerationJob, Scenario, Simulation
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

State = Augmentation.State
CELL = re.compile(r'id="cell-')
Questions = Callable[[int], object]


def large_job(*, scenarios: int, contestants: int, samples: int = 1) -> GenerationJob:
    """A job that is over, with a row for every cell."""
    base = rows.add_scenario("street-000").base_scene
    Scenario.objects.bulk_create(
        Scenario(
            slug=f"street-{number:03}",
            type=Scenario.Type.CONSTRUCTION_ZONE,
            instruction=f"Place {number} cones.",
            base_scene=base,
        )
        for number in range(1, scenarios)
    )
    Contestant.objects.bulk_create(
        Contestant(slug=f"who-{number:02}", name=f"Who {number:02}", kind=Contestant.Kind.RULE)
        for number in range(contestants)
    )
    job = GenerationJob.objects.create(
        name="Large", samples=samples, state=GenerationJob.State.FINISHED
    )
    where, who = list(Scenario.objects.all()), list(Contestant.objects.all())
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


@pytest.fixture
def analyst() -> Client:
    return signed_in(people()["analyst"])


def page(analyst: Client, job: GenerationJob, query: str = "") -> str:
    return analyst.get(reverse("job", args=[job.code]) + query).content.decode()


def test_ten_thousand_cells_cost_as_much_as_a_page_of_them(
    analyst: Client, django_assert_max_num_queries: Questions
) -> None:
    job = large_job(scenarios=100, contestants=20, samples=5)
    assert job.augmentations.count() == 10_000
    for query in ("", "?row=17&column=2", "?view=pictures", "?state=unreadable&q=street-09"):
        with django_assert_max_num_queries(17):  # type: ignore[attr-defined]
            found = page(analyst, job, query)
        assert 0 < len(CELL.findall(found)) <= 300
        assert len(found) < 300_000
        assert "Measure now" in found, "nothing is measured unasked"


def test_every_cell_is_on_exactly_one_page(analyst: Client) -> None:
    job = large_job(scenarios=7, contestants=12, samples=12)
    seen: list[str] = []
    for column in (1, 2):
        for sample in (1, 2):
            row = 1
            while True:
                found = page(analyst, job, f"?row={row}&column={column}&sample={sample}")
                seen += re.findall(r'id="cell-([0-9a-f-]+)"', found)
                row += 1
                if f"row={row}&amp;" not in found and f"?row={row}" not in found:
                    break
    assert len(seen) == len(set(seen)) == 7 * 12 * 12


def test_ten_thousand_different_reasons_are_named_by_the_most_frequent(
    analyst: Client, django_assert_max_num_queries: Questions
) -> None:
    job = large_job(scenarios=52, contestants=20)
    words = "".join(chr(ord("a") + number) for number in range(26))
    failed = list(job.augmentations.all())
    for number, row in enumerate(failed):
        row.state, row.reason = State.FAILED, f"no {words[number % 26]}{words[number // 26 % 26]}"
    Augmentation.objects.bulk_update(failed, ["state", "reason"], batch_size=500)
    with django_assert_max_num_queries(17):  # type: ignore[attr-defined]
        found = page(analyst, job)
    assert found.count('<details class="card" id="failure-') == 20
    assert "there are more: 676." in found


def test_marks_say_in_words_what_they_show_and_lead_to_the_augmentation(analyst: Client) -> None:
    job = large_job(scenarios=2, contestants=1)
    cell = job.augmentations.order_by("pk")[0]
    found = page(analyst, job)
    assert f'href="{reverse("augmentation", args=[cell.code])}" title="Unreadable answer"' in found
    assert '<span class="unseen">Unreadable answer</span>' in found


def test_pictures_are_loaded_when_they_are_seen(analyst: Client) -> None:
    job = large_job(scenarios=2, contestants=1)
    job.augmentations.update(image="bev/x.png")
    cell = job.augmentations.order_by("pk")[0]
    found = page(analyst, job, "?view=pictures")
    address = reverse("picture", args=["augmentation", cell.code])
    (shown,) = [img for img in re.findall("<img[^>]*>", found) if f"{cell.code}.png" in img]
    assert 'loading="lazy"' in shown
    addresses = re.findall(rf'"?({address}[^" ]*)', unescape(shown))
    assert len(addresses) == 3
    assert all("width=" in one and one.endswith("&v=bev/x") for one in addresses)
    assert address not in page(analyst, job)


@pytest.mark.parametrize(
    ("query", "shown"),
    [
        ("?q=street-001", ["street-001"]),
        ("?state=failed", ["street-000"]),
        ("?state=failed&q=street-001", []),
        ("?state=no-such-state&row=x&column=-1&sample=99999999999&view=oil", 3),
        ("?row=9999", 3),
    ],
)
def test_the_grid_is_narrowed_by_word_and_state(
    analyst: Client, query: str, shown: list[str] | int
) -> None:
    job = large_job(scenarios=3, contestants=2)
    first = job.augmentations.filter(scenario__slug="street-000").order_by("pk")[0]
    job.augmentations.filter(pk=first.pk).update(state=State.FAILED, reason="broke")
    grid = page(analyst, job, query).split('id="grid"')[1]
    found = re.findall(r'<th scope="row"><a[^>]*>(street-\d+)</a>', grid)
    assert found == shown if isinstance(shown, list) else len(found) == shown


DRIVE = re.compile(r'href="/drives/([0-9a-f-]+)/"')


def test_the_drives_of_a_large_job_are_a_page_of_them(
    analyst: Client, django_assert_max_num_queries: Questions
) -> None:
    job = large_job(scenarios=60, contestants=12, samples=2)
    Simulation.objects.bulk_create(
        Simulation(scenario_id=row.scenario_id, augmentation=row, subject="augmentation")
        for row in job.augmentations.all()
    )
    shown = reverse("drives", args=[job.code])
    seen: list[str] = []
    for column, sample, row in product((1, 2), (1, 2), (1, 2)):
        with django_assert_max_num_queries(13):  # type: ignore[attr-defined]
            found = analyst.get(shown, {"column": column, "sample": sample, "row": row})
        drives = DRIVE.findall(found.content.decode())
        assert 0 < len(drives) <= 300
        seen += drives
    assert len(set(seen)) == len(seen), "no drive is on two pages"
    assert len(seen) == 2 * 60 * 12


def test_fault_labels_of_a_large_job_read_no_augmentation(analyst: Client) -> None:
    job = large_job(scenarios=60, contestants=12)
    made: list[object] = []

    def note(instance: object, **_: object) -> None:
        made.append(instance)

    post_init.connect(note, sender=Augmentation)
    try:
        found = analyst.get(reverse("faults", args=[job.code])).content.decode()
    finally:
        post_init.disconnect(note, sender=Augmentation)
    assert not made
    assert found.count("Who ") == 12
    assert "60" in found
