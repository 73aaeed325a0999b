"""Pictures that are broken on purpose, by which a study checks whether its experts look."""

from __future__ import annotations

from collections.abc import Sequence

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import QuerySet
from django.utils import timezone

from augment.baselines.registry import break_reference
from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from augment.scene.codec import modification_to_document
from augment.services.events import log_event
from augment.services.scenarios.pictures import camera_of, picture_of, redraw
from augment.services.scenarios.scenes import reference_of, scene_of

ATTENTION_CHECK = "attention-check"
JOB = "Attention checks"

State = Augmentation.State


def draw_checks(*, scenarios: Sequence[str], actor: User | None = None) -> list[Augmentation]:
    """Draw the broken picture of every scenario that has none yet for its reference.

    They belong to a contestant of kind check, which no job runs and no study rates. Drawing takes
    a tenth of a second each: call it from a command or a worker, not in a request.

    Args:
        scenarios: Slugs; those without a reference, or whose reference only removes, have no
            check.
        actor: Who wants them.

    Returns:
        The new rows.

    Raises:
        InvalidDocument: A stored scene or reference can't be read.
    """
    drawn = []
    for row in Scenario.objects.filter(slug__in=scenarios).select_related("base_scene"):
        reference = reference_of(row)
        change = None if reference is None else break_reference(reference)
        if change is None:
            continue
        document = modification_to_document(change)
        if not _pictures(row).filter(modification=document).exists():
            drawn.append((row, document, picture_of(scene_of(row), change, camera_of(row))))
    kept = _keep(drawn, actor) if drawn else []
    for row, _, _ in drawn:
        redraw(row)
    return kept


def _pictures(scenario: Scenario) -> QuerySet[Augmentation]:
    kind = Contestant.Kind.CHECK
    return scenario.augmentations.filter(contestant__kind=kind, state=State.DONE)


@transaction.atomic
def _keep(
    drawn: list[tuple[Scenario, dict[str, object], str]], actor: User | None
) -> list[Augmentation]:
    contestant, _ = Contestant.objects.get_or_create(
        slug=ATTENTION_CHECK, defaults={"name": "Attention check", "kind": Contestant.Kind.CHECK}
    )
    now = timezone.now()
    job = GenerationJob.objects.create(
        name=JOB, state=GenerationJob.State.FINISHED, launched_by=actor, finished_at=now
    )
    job.contestants.set([contestant])
    job.scenarios.set([scenario for scenario, _, _ in drawn])
    rows = Augmentation.objects.bulk_create(
        Augmentation(
            job=job,
            scenario=scenario,
            contestant=contestant,
            state=State.DONE,
            modification=document,
            image=image,
            finished_at=now,
        )
        for scenario, document, image in drawn
    )
    log_event(
        actor=actor,
        verb="draw checks",
        object_kind="job",
        object_code=job.code,
        after={"scenarios": [scenario.slug for scenario, _, _ in drawn]},
    )
    return rows
