"""A study of the paper's size, voted by simulated people: for pages, files and timings.

The votes are drawn, not cast: their expected score is logistic in the paper's ratings, with
effects of scenario and expert on top. Everything that tells how experts vote (pace, ties, sides,
repeats, checks) is made up.
"""

import uuid
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from django.utils import timezone

from arena.models import Matchup, Study, Vote
from arena.people.services import create_person
from arena.studies.services.opening import close_study
from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from augment.scene.entities import ScenarioType
from tests.opening import open_study
from tests.study_rows import scenario

PAPERS = (
    ("interplan", "interPlan", "", 1042),
    ("gpt-4o-otm", "GPT-4o OTM", "otm", 1039),
    ("gemini-vqa", "Gemini-1.5-Flash vQA", "vqa", 1025),
    ("llama-tqa", "Llama3.1-70B tQA", "tqa", 1011),
    ("gemini-tqa", "Gemini-1.5-Flash tQA", "tqa", 1003),
    ("gemini-fc", "Gemini-1.5-Flash FC", "fc", 998),
    ("llama-fc", "Llama3.1-70B FC", "fc", 984),
    ("gemini-otm", "Gemini-1.5-Flash OTM", "otm", 953),
    ("llama-otm", "Llama3.1-70B OTM", "otm", 941),
)
"""Slug, name, variant and rating of the paper's table."""

POINTS_PER_LOGIT = 400.0 / np.log(10.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Size:
    """How big the study is."""

    scenarios: int = 50
    experts: int = 9
    votes_per_expert: int = 640
    ties: float = 0.55
    scenario_sd: float = 100.0
    expert_sd: float = 40.0


def contestants() -> list[Contestant]:
    """The paper's nine, as rules: a language model would need an endpoint that nobody asks."""
    return [
        Contestant.objects.create(slug=slug, name=name, kind=Contestant.Kind.RULE)
        for slug, name, _, _ in PAPERS
    ]


def scenarios(number: int) -> list[Scenario]:
    made = [scenario(f"place-{index:02d}") for index in range(number)]
    types = list(ScenarioType)
    for index, row in enumerate(made):
        row.type = types[index % len(types)]
        row.save()
    return made


def pictures(places: Sequence[Scenario], rated: Sequence[Contestant], image: str = "") -> None:
    """One picture each; the same file for all where one is given."""
    job = GenerationJob.objects.create(name="a job")
    Augmentation.objects.bulk_create(
        Augmentation(
            job=job,
            scenario=place,
            contestant=row,
            state=Augmentation.State.DONE,
            modification={},
            image=image or f"bev/{uuid.uuid4().hex}.png",
            finished_at=timezone.now(),
        )
        for place in places
        for row in rated
    )


def full_study(*, size: Size, seed: int = 1, name: str = "Round 1") -> Study:
    """Open, voted to the end and closed."""
    rated, places = contestants(), scenarios(size.scenarios)
    pictures(places, rated)
    experts = [f"expert-{number}" for number in range(1, size.experts + 1)]
    for username in experts:
        create_person(username=username, password=None, role="expert")
    study = open_study(
        name=name,
        contestants=[row.slug for row in rated],
        scenarios=[place.slug for place in places],
        experts=experts,
        votes_per_expert=size.votes_per_expert,
        seed=seed,
    )
    draw_votes(study, size=size, seed=seed)
    return close_study(study=study)


def draw_votes(study: Study, *, size: Size, seed: int) -> None:
    """A vote on every matchup of the study."""
    rng = np.random.default_rng(seed)
    rows = list(
        study.matchups.select_related("left__contestant", "right__contestant").order_by(
            "position", "expert"
        )
    )
    truth = {slug: float(elo) for slug, _, _, elo in PAPERS}
    by_scenario: dict[tuple[int, str], float] = {}
    by_expert: dict[tuple[int, str], float] = {}

    def strength(matchup: Matchup, slug: str) -> float:
        place = (matchup.scenario_id, slug)
        who = (matchup.expert_id, slug)
        if place not in by_scenario:
            by_scenario[place] = rng.normal(0.0, size.scenario_sd)
        if who not in by_expert:
            by_expert[who] = rng.normal(0.0, size.expert_sd)
        return truth[slug] + by_scenario[place] + by_expert[who]

    made = []
    for matchup in rows:
        gap = strength(matchup, matchup.left.contestant.slug) - strength(
            matchup, matchup.right.contestant.slug
        )
        made.append(_vote(matchup, gap, size, rng))
    Vote.objects.bulk_create(made, batch_size=500)


def _vote(matchup: Matchup, gap: float, size: Size, rng: np.random.Generator) -> Vote:
    expected = 1.0 / (1.0 + np.exp(-gap / POINTS_PER_LOGIT))
    tie = size.ties * 2.0 * min(expected, 1.0 - expected)
    drawn = rng.random()
    outcome, winner = Vote.Outcome.RIGHT, matchup.right
    if drawn < expected - tie / 2:
        outcome, winner = Vote.Outcome.LEFT, matchup.left
    elif drawn < expected + tie / 2:
        outcome = Vote.Outcome.EQUAL
    return Vote(
        key=uuid.UUID(bytes=rng.bytes(16)),
        matchup=matchup,
        expert_id=matchup.expert_id,
        shown_left_id=matchup.left_id,
        shown_right_id=matchup.right_id,
        outcome=outcome,
        winner=None if outcome is Vote.Outcome.EQUAL else winner,
        ms_visible=int(rng.lognormal(8.2, 0.7)),
    )
