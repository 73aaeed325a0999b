"""Lists are found in by a word, narrowed by filters and shown page by page, at a fixed price."""

from collections.abc import Callable

import pytest
from django.test import Client
from django.urls import reverse

from arena.models import Study
from augment.models import Augmentation, BaseScene, Contestant, GenerationJob, Scenario
from augment.scene.entities import ScenarioType
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

MANY = 130
Questions = Callable[[int], object]


@pytest.fixture
def admin() -> Client:
    return signed_in(people()["admin"])


def page(client: Client, name: str, query: str = "") -> str:
    return client.get(reverse(name) + query).content.decode()


def add_many() -> None:
    """So many of everything, and a row of each job."""
    base = rows.add_scenario("street-000").base_scene
    BaseScene.objects.update(slug="recorded")
    Scenario.objects.bulk_create(
        Scenario(
            slug=f"street-{number:03}",
            type=ScenarioType.JAYWALKER if number % 2 else ScenarioType.CONSTRUCTION_ZONE,
            instruction=f"Place {number} cones.",
            base_scene=base,
        )
        for number in range(1, MANY)
    )
    Contestant.objects.bulk_create(
        Contestant(slug=f"who-{number:03}", name=f"Who {number:03}", kind="rule")
        for number in range(MANY)
    )
    jobs = GenerationJob.objects.bulk_create(
        GenerationJob(name=f"Job {number:03}", state="finished") for number in range(MANY)
    )
    Study.objects.bulk_create(
        Study(name=f"Study {number:03}", votes_per_expert=1, seed=1) for number in range(MANY)
    )
    street, who = Scenario.objects.first(), Contestant.objects.first()
    Augmentation.objects.bulk_create(
        Augmentation(job=job, scenario=street, contestant=who, state="failed", reason="broke")
        for job in jobs
    )


LISTS = {
    # page: what a row is told by, how many a page has
    "jobs": ("Job ", 25),
    "studies": ('">Study ', 25),
    "contestants": ('/">Who ', 50),
    "scenarios": ("<b>street-", 16),
}


def test_lists_are_shown_page_by_page_and_found_in(
    admin: Client, django_assert_max_num_queries: Questions
) -> None:
    add_many()
    for name, (mark, size) in LISTS.items():
        admin.get(reverse(name))
        with django_assert_max_num_queries(18):  # type: ignore[attr-defined]
            first = page(admin, name)
        assert (first.count(mark), "<span>1 of " in first) == (size, True), name
        assert 0 < page(admin, name, "?page=99").count(mark) <= size, name
        assert page(admin, name, "?page=nonsense").count(mark) == size, name
        assert page(admin, name, "?q=077").count(mark) == 1, name
        nothing = page(admin, name, "?q=no-such-thing")
        assert (nothing.count(mark), "Nothing is like that." in nothing) == (0, True), name
