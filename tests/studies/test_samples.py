"""Which samples a study shows, of which jobs, and that a contestant has one set of options."""

import uuid

import pytest
from django.core.management import call_command
from django.urls import reverse
from django.utils import timezone

from arena.models import Study
from arena.voting.services.pictures import draw_sample
from augment.errors import Conflict
from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from tests.opening import open_study
from tests.study_rows import contestant, expert, scenario
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

WHO = ("ann", "bob", "cid")
DRAWN = [2, 0, 2, 1, 2, 1]


def sampled(samples: int = 3, places: int = 6, name: str = "big", **columns: object) -> None:
    """A job of three contestants with so many samples of each scenario."""
    job = GenerationJob.objects.create(name=name, samples=samples)
    for slug in WHO:
        if not Contestant.objects.filter(slug=slug).exists():
            contestant(slug)
    for number in range(places):
        if not Scenario.objects.filter(slug=f"place-{number}").exists():
            scenario(f"place-{number}")
    Augmentation.objects.bulk_create(
        Augmentation(
            job=job,
            scenario=place,
            contestant=who,
            sample=sample,
            state=Augmentation.State.DONE,
            modification={},
            image=f"bev/{uuid.uuid4().hex}.png",
            finished_at=timezone.now(),
            **columns,
        )
        for place in Scenario.objects.order_by("slug")[:places]
        for who in Contestant.objects.filter(slug__in=WHO)
        for sample in range(1, samples + 1)
    )


def opened(seed: int = 7, votes: int = 9, places: int = 6, **rules: object) -> Study:
    for username in ("eva", "finn"):
        expert(username)
    return open_study(
        name="Round 1",
        contestants=WHO,
        scenarios=[f"place-{number}" for number in range(places)],
        experts=["eva", "finn"],
        votes_per_expert=votes,
        seed=seed,
        **rules,
    )


def shown(study: Study) -> set[tuple[str, int, int]]:
    rows = study.matchups.values_list("scenario__slug", "left__sample", "right__sample")
    return set(rows)


def test_one_sample_of_each_scenario_is_drawn_by_the_seed() -> None:
    # The rule is written down in docs/using.md; these were worked out with sha256sum.
    assert [draw_sample(7, f"place-{n}", 3) for n in range(6)] == DRAWN
    sampled()
    found = shown(opened())
    assert found == {(f"place-{n}", DRAWN[n] + 1, DRAWN[n] + 1) for n in range(6)}


def test_options_are_not_mixed_under_one_contestant() -> None:
    sampled(samples=1, name="cool", options={"temperature": 0.2, "seed": 1})
    sampled(samples=1, name="hot", places=3, options={"temperature": 0.9, "seed": 1})
    with pytest.raises(Conflict) as refused:
        opened()
    said = str(refused.value)
    assert "were made with different options" in said
    assert "in the jobs cool, hot" in said
    assert not Study.objects.exists()


def test_a_study_shows_the_jobs_that_it_names(capsys: pytest.CaptureFixture[str]) -> None:
    sampled(samples=1, name="cool", options={"temperature": 0.2})
    sampled(samples=1, name="hot", options={"temperature": 0.9})
    for username in ("eva", "finn"):
        expert(username)
    call_command(
        *("open_study", "Round 1", "--contestants", *WHO, "--scenarios", "all", "--experts"),
        *("eva", "finn", "--votes-per-expert", "6", "--seed", "1", "--jobs", "cool"),
    )
    assert "It shows augmentations of 'cool'" in capsys.readouterr().out
    study = Study.objects.get()
    assert {row.left.job.name for row in study.matchups.all()} == {"cool"}
    assert [job["name"] for job in study.rules["jobs"]] == ["cool"]
    assert study.rules["options"]["ann"] == {"temperature": 0.2}
    page = signed_in(people()["admin"]).get(reverse("study", args=[study.code]))
    assert "Shown are augmentations of" in page.content.decode()
