"""Rows for tests of studies: contestants with pictures of scenarios, and the people who vote."""

import uuid
from collections.abc import Callable, Sequence
from typing import TypedDict

from django.contrib.auth.models import User
from django.utils import timezone

from arena.models import Matchup, Study, Vote
from arena.people.services import create_person
from arena.studies.services.opening import close_study
from arena.voting.services.casting import Decision, cast_vote
from augment.models import Augmentation, BaseScene, Contestant, GenerationJob, Scenario
from augment.scene.codec import modification_to_document, scene_to_document
from augment.scene.entities import Modification, ScenarioType
from tests.opening import open_study
from tests.scenes import scene as street

KINDS = Contestant.Kind


class Cast(TypedDict):
    """Who takes part, by the names that open_study takes."""

    contestants: list[str]
    scenarios: list[str]
    experts: list[str]


def contestant(slug: str, kind: str = KINDS.RULE, name: str | None = None) -> Contestant:
    return Contestant.objects.create(slug=slug, name=name or slug.capitalize(), kind=kind)


def scenario(slug: str) -> Scenario:
    base, _ = BaseScene.objects.get_or_create(
        slug="street",
        defaults={
            "document": scene_to_document(street(name="street")),
            "source": "authored",
            "provenance": "a test",
        },
    )
    return Scenario.objects.create(
        slug=slug, base_scene=base, type=ScenarioType.NUDGE, instruction=f"Park a car on {slug}."
    )


def picture(
    scenario: Scenario,
    contestant: Contestant,
    *,
    image: str | None = None,
    state: str = Augmentation.State.DONE,
    job: GenerationJob | None = None,
) -> Augmentation:
    """What a job, one of its own unless told otherwise, made of the scenario."""
    row = _picture(job or GenerationJob.objects.create(name="a job"), scenario, contestant)
    row.state = state
    row.modification = {} if state == Augmentation.State.DONE else None
    row.image = row.image if image is None else image
    row.save()
    return row


def _picture(job: GenerationJob, place: Scenario, who: Contestant) -> Augmentation:
    return Augmentation(
        job=job,
        scenario=place,
        contestant=who,
        state=Augmentation.State.DONE,
        modification={},
        image=f"bev/{uuid.uuid4().hex}.png",
        finished_at=timezone.now(),
    )


def write_changes() -> None:
    """Give every augmentation the document of a change that changes nothing."""
    document = modification_to_document(Modification())
    Augmentation.objects.filter(modification={}).update(modification=document)


def hang(augmentation: Augmentation, image: str) -> None:
    """Give an augmentation a picture, also where it is planned to be shown."""
    Augmentation.objects.filter(pk=augmentation.pk).update(image=image)
    augmentation.shown_left.update(left_image=image)
    augmentation.shown_right.update(right_image=image)


def cast_of(
    *,
    contestants: tuple[str, ...] = ("ann", "bob", "cid"),
    scenarios: int = 6,
    experts: tuple[str, ...] = ("eva", "finn"),
    kind: str = KINDS.RULE,
    simulated_experts: bool = False,
) -> Cast:
    """Everybody and everything that a study needs; returns the names as open_study takes them."""
    places = [scenario(f"place-{number}") for number in range(scenarios)]
    job = GenerationJob.objects.create(name="a job")
    rows = [contestant(slug, kind) for slug in contestants]
    Augmentation.objects.bulk_create(_picture(job, place, row) for row in rows for place in places)
    for username in experts:
        expert(username, is_simulated=simulated_experts)
    return {
        "contestants": list(contestants),
        "scenarios": [place.slug for place in places],
        "experts": list(experts),
    }


def expert(username: str, *, is_simulated: bool = False) -> User:
    return create_person(
        username=username, password="a password", role="expert", is_simulated=is_simulated
    )


def a_study(
    *, votes_per_expert: int = 9, seed: int = 7, questions: Sequence[str] = (), **cast: object
) -> Study:
    """An open study of three contestants, six scenarios and two experts, unless told otherwise."""
    return open_study(
        name="Round 1",
        votes_per_expert=votes_per_expert,
        seed=seed,
        questions=tuple(questions),
        **cast_of(**cast),  # type: ignore[arg-type]
    )


def matchups_of(study: Study, username: str) -> list[Matchup]:
    return list(study.matchups.filter(expert__username=username).order_by("position"))


def shown_again(matchup: Matchup) -> Matchup:
    """A hidden repeat at the end of the expert's order."""
    last = Matchup.objects.filter(study=matchup.study, expert=matchup.expert).latest("position")
    return Matchup.objects.create(
        study=matchup.study,
        expert=matchup.expert,
        position=last.position + 1,
        scenario=matchup.scenario,
        left=matchup.right,
        right=matchup.left,
        view=matchup.view,
        kind=Matchup.Kind.REPEAT,
        repeat_of=matchup,
    )


def vote_all(study: Study, outcome: Callable[[Matchup], str] = lambda _: "left") -> Study:
    """Return the study closed, with a vote on each of its pairs; all are stored at once."""
    pairs = study.matchups.select_related("left__contestant", "right__contestant")
    votes = []
    for pair in pairs.order_by("expert__username", "position"):
        side = outcome(pair)
        vote = Vote(key=uuid.uuid4(), matchup=pair, expert_id=pair.expert_id, outcome=side)
        vote.shown_left_id, vote.shown_right_id = pair.left_id, pair.right_id
        vote.winner_id = {"left": pair.left_id, "right": pair.right_id}.get(side)
        votes.append(vote)
    Vote.objects.bulk_create(votes)
    return close_study(study=study)


def vote(matchup: Matchup, outcome: str = "left", **more: object) -> Vote:
    """A vote with a fresh key unless one is given."""
    arguments: dict[str, object] = {"key": uuid.uuid4(), **more}
    decision = Decision(
        matchup=matchup.code,
        outcome=outcome,
        **arguments,  # type: ignore[arg-type]
    )
    return cast_vote(expert=matchup.expert, decision=decision)
