"""What an admin is asked before a labelling opens or closes."""

from __future__ import annotations

from collections.abc import Sequence

from django.db import transaction
from django.urls import reverse

from arena.jobs.queries import of_job
from arena.jobs.services import open_labelling
from arena.models import LabellingRound
from arena.site.acts import Confirmation
from augment.models import GenerationJob


def opening(job: GenerationJob, *, name: str, experts: Sequence[str], seed: int) -> Confirmation:
    """Counted by opening it and taking that back at once.

    Raises:
        ArenaError, AugmentError: It can't be opened.
    """
    with transaction.atomic():
        labelling = open_labelling(job=job, name=name, experts=experts, seed=seed)
        tasks = labelling.tasks.count()
        pictures = labelling.tasks.values("augmentation").distinct().count()
        transaction.set_rollback(True)
    facts = (
        f"Pictures: {pictures}. Experts: {len(experts)}. Labels planned: {tasks}.",
        "Experts see it at once; who labels, and in which order, can’t be changed afterwards.",
    )
    return Confirmation(
        title=f"Open the labelling “{name}”?",
        facts=facts,
        button="Open the labelling",
        back=reverse("faults", args=[job.code]),
        is_final=False,
        crumbs=_crumbs(job),
    )


def closing(labelling: LabellingRound) -> Confirmation:
    """What is there, and what will never come."""
    line = next(one for one in of_job(labelling.job) if one.labelling.pk == labelling.pk)
    facts = (
        f"Labels saved, which stay: {line.labelled}.",
        f"Planned labels that will be missing: {line.left}.",
        "It takes no more labels. This can’t be taken back.",
    )
    return Confirmation(
        title=f"Close the labelling “{labelling.name}”?",
        facts=facts,
        button="Close the labelling",
        back=reverse("faults", args=[labelling.job.code]),
        crumbs=_crumbs(labelling.job),
    )


def _crumbs(job: GenerationJob) -> tuple[tuple[str, str], ...]:
    return (
        ("Jobs", reverse("jobs")),
        (job.name, reverse("job", args=[job.code])),
        ("Fault labels", reverse("faults", args=[job.code])),
    )
