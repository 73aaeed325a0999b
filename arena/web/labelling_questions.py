"""What an admin is asked before a labelling opens or closes."""

from __future__ import annotations

from collections.abc import Sequence

from django.db import transaction
from django.urls import reverse
from django.utils.translation import gettext as _

from arena.models import LabellingRound
from arena.queries.faults import of_job
from arena.services.faults import open_labelling
from arena.web.questions import Confirmation
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
        _("Pictures: %(pictures)s. Experts: %(experts)s. Labels planned: %(labels)s.")
        % {"pictures": pictures, "experts": len(experts), "labels": tasks},
        _("Experts see it at once; who labels, and in which order, can’t be changed afterwards."),
    )
    return Confirmation(
        title=_("Open the labelling “%(name)s”?") % {"name": name},
        facts=facts,
        button=_("Open the labelling"),
        back=reverse("faults", args=[job.code]),
        is_final=False,
        crumbs=_crumbs(job),
    )


def closing(labelling: LabellingRound) -> Confirmation:
    """What is there, and what will never come."""
    line = next(one for one in of_job(labelling.job) if one.labelling.pk == labelling.pk)
    facts = (
        _("Labels saved, which stay: %(n)s.") % {"n": line.labelled},
        _("Planned labels that will be missing: %(n)s.") % {"n": line.left},
        _("It takes no more labels. This can’t be taken back."),
    )
    return Confirmation(
        title=_("Close the labelling “%(name)s”?") % {"name": labelling.name},
        facts=facts,
        button=_("Close the labelling"),
        back=reverse("faults", args=[labelling.job.code]),
        crumbs=_crumbs(labelling.job),
    )


def _crumbs(job: GenerationJob) -> tuple[tuple[str, str], ...]:
    return (
        (_("Jobs"), reverse("jobs")),
        (job.name, reverse("job", args=[job.code])),
        (_("Fault labels"), reverse("faults", args=[job.code])),
    )
