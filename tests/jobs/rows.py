"""Rows for the tests of jobs: a street, a scenario, contestants and a launched job."""

from datetime import UTC, datetime, timedelta
from typing import Any

from augment.models import Augmentation, BaseScene, Contestant, Endpoint, GenerationJob, Scenario
from augment.scene.codec import intent_to_document, modification_to_document, scene_to_document
from augment.scene.entities import Modification, ScenarioType, Scene
from augment.scene.intent import Shape
from augment.services.running import jobs
from augment.services.running.jobs import JobRequest
from augment.services.running.runner import AUGMENTATIONS, Held
from augment.services.work import Settlement
from tests.intents import cones
from tests.scenes import cone
from tests.scenes import scene as street

NOON = datetime(2026, 11, 20, 12, 0, tzinfo=UTC)
STALE = timedelta(seconds=20)
INSTRUCTION = "Place a traffic cone on the ego's lane 20 m in front of the ego."
TWO_CONES = Modification(added=(cone("Agent2", 20.0, 0.5), cone("Agent3", 25.0, -0.5)))


def add_scenario(slug: str, *, scene: Scene | None = None, **columns: Any) -> Scenario:
    base = BaseScene.objects.create(
        slug=f"{slug}-scene",
        document=scene_to_document(scene or street(name=f"{slug}-scene")),
        source="authored",
        provenance="made for a test",
    )
    columns = {
        "type": ScenarioType.CONSTRUCTION_ZONE,
        "instruction": INSTRUCTION,
        "reference": modification_to_document(TWO_CONES),
        "intent": intent_to_document(cones(20.0, 1, Shape.LINE)),
        "intent_origin": "entered",
    } | columns
    return Scenario.objects.create(slug=slug, base_scene=base, **columns)


def add_many_scenarios(number: int) -> list[Scenario]:
    """Scenarios of one scene, every other of another type."""
    base = add_scenario("street-000").base_scene
    types = (ScenarioType.CONSTRUCTION_ZONE, ScenarioType.JAYWALKER)
    Scenario.objects.bulk_create(
        Scenario(
            slug=f"street-{place:03}",
            type=types[place % 2],
            instruction=f"Place {place} cones.",
            base_scene=base,
        )
        for place in range(1, number)
    )
    return list(Scenario.objects.order_by("pk"))


def add_many_contestants(number: int) -> list[Contestant]:
    Contestant.objects.bulk_create(
        Contestant(slug=f"who-{place:03}", name=f"Who {place:03}", kind=Contestant.Kind.RULE)
        for place in range(number)
    )
    return list(Contestant.objects.order_by("pk"))


def add_kind(slug: str, kind: str = Contestant.Kind.REFERENCE) -> Contestant:
    return Contestant.objects.create(slug=slug, name=slug, kind=kind)


def add_model(slug: str, *, endpoint: Endpoint, model: str, **columns: object) -> Contestant:
    kind = Contestant.Kind.SIMULATED if endpoint.is_simulated else Contestant.Kind.LLM
    return Contestant.objects.create(
        slug=slug, name=slug, kind=kind, variant="otm", endpoint=endpoint, model=model, **columns
    )


def add_answer(
    job: GenerationJob,
    scenario: Scenario,
    contestant: Contestant,
    change: Modification | None = None,
    **columns: Any,
) -> Augmentation:
    """A picture with a change; a refusal without one, unless a column says otherwise."""
    columns = {
        "state": "done" if change else "refused",
        "modification": modification_to_document(change) if change else None,
        "image": "bev/x.png",
    } | columns
    return Augmentation.objects.create(
        job=job, scenario=scenario, contestant=contestant, **columns
    )


def launch(*, scenarios: int = 1, contestants: tuple[str, ...] = ("reference",)) -> GenerationJob:
    for slug in contestants:
        if not Contestant.objects.filter(slug=slug).exists():
            add_kind(slug)
    places = [add_scenario(f"street-{number}") for number in range(1, scenarios + 1)]
    return jobs.launch(
        JobRequest(
            name="Round 1", contestants=list(contestants), scenarios=[row.slug for row in places]
        )
    )


def only_row(job: GenerationJob) -> Augmentation:
    return job.augmentations.get()


def leased(row: Augmentation, now: datetime = NOON) -> Held:
    held = AUGMENTATIONS.take(row.pk, now=now, worker="here")
    assert held is not None
    return held


def failed(reason: str = "the wire broke") -> Settlement:
    return Settlement(state=Augmentation.State.FAILED, reason=reason)


def done() -> Settlement:
    made = {"modification": modification_to_document(TWO_CONES), "image": "bev/x.png"}
    return Settlement(state=Augmentation.State.DONE, columns=made)
