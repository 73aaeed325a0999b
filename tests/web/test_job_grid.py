"""The grid of a job in parts: as many questions and bytes for ten thousand cells as for ten."""

import re
from collections.abc import Callable

import pytest
from django.test import Client
from django.urls import reverse

from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from augment.scene.entities import ScenarioType
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
            type=ScenarioType.CONSTRUCTION_ZONE,
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
def researcher() -> Client:
    return signed_in(people()["researcher"])


def page(researcher: Client, job: GenerationJob, query: str = "") -> str:
    return researcher.get(reverse("job-tab", args=[job.code, "grid"]) + query).content.decode()


def test_ten_thousand_cells_cost_as_much_as_a_page_of_them(
    researcher: Client, django_assert_max_num_queries: Questions
) -> None:
    job = large_job(scenarios=100, contestants=20, samples=5)
    assert job.augmentations.count() == 10_000
    for query in ("", "?row=17", "?state=unreadable&q=street-09"):
        with django_assert_max_num_queries(16):  # type: ignore[attr-defined]
            found = page(researcher, job, query)
        assert 0 < len(CELL.findall(found)) <= 300
        assert len(found) < 300_000


def test_every_cell_is_on_exactly_one_page(researcher: Client) -> None:
    job = large_job(scenarios=7, contestants=12, samples=12)
    seen: list[str] = []
    query: str | None = ""
    while query is not None:
        found = page(researcher, job, query)
        seen += re.findall(r'id="cell-([0-9a-f-]+)"', found)
        following = re.search(r'href="([^"]*)" rel="next"', found)
        query = following and following[1]
    assert len(seen) == len(set(seen)) == 7 * 12 * 12


@pytest.mark.parametrize(
    ("query", "shown"),
    [
        ("?q=street-001", ["street-001"]),
        ("?state=failed", ["street-000"]),
        ("?state=failed&q=street-001", []),
        ("?state=no-such-state&row=x&view=oil", 3),
        ("?row=9999", 3),
    ],
)
def test_the_grid_is_narrowed_by_word_and_state(
    researcher: Client, query: str, shown: list[str] | int
) -> None:
    job = large_job(scenarios=3, contestants=2)
    first = job.augmentations.filter(scenario__slug="street-000").order_by("pk")[0]
    job.augmentations.filter(pk=first.pk).update(state=State.FAILED, reason="broke")
    grid = page(researcher, job, query).split('id="grid"')[1]
    found = re.findall(r'<th scope="row">\s*<a[^>]*>(street-\d+)</a>', grid)
    assert found == shown if isinstance(shown, list) else len(found) == shown
