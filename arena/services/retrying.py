"""Trying again what has no modification, as long as nobody has been shown it."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Q, QuerySet

from augment.errors import Conflict
from augment.models import Augmentation, GenerationJob, Scenario
from augment.services.running import jobs
from augment.services.running.progress import rows_of_cause

_BATCH = 500


@transaction.atomic
def retry_cause(job: GenerationJob, *, key: str, actor: User | None = None) -> GenerationJob:
    """Let the rows that ended for one cause wait again.

    What experts compare or label stays as it is: an unreadable answer is shown as the unchanged
    scene, and a second one would put another picture in the place of the one that was judged.

    Args:
        job: Whose rows they are.
        key: Of the cause.
        actor: Who wants it.

    Raises:
        UnknownName: No row has that cause (any more).
        Conflict: A study or a labelling shows some of them, the job was cancelled, or the
            contestants have refused.
    """
    _, _, pks = rows_of_cause(job, key)
    # Held, as an opening study does, so that none shows them between the look and the change.
    places = Scenario.objects.filter(pk__in=job.scenarios.values("pk"))
    list(places.select_for_update(no_key=True).order_by("pk").values_list("pk"))
    shown = sum(
        _shown(pks[start : start + _BATCH]).count() for start in range(0, len(pks), _BATCH)
    )
    if shown:
        raise Conflict(
            f"Experts are shown {shown} of these {len(pks)} in a study or a labelling: what "
            "is judged stays as it is. Launch a new job instead."
        )
    return jobs.retry_cause(job, key=key, actor=actor)


# --- Private -----------------------------------------------------------------------------------


def _shown(pks: list[int]) -> QuerySet[Augmentation]:
    is_shown = (
        Q(shown_left__isnull=False) | Q(shown_right__isnull=False) | Q(label_tasks__isnull=False)
    )
    rows = Augmentation.objects.filter(pk__in=pks)
    return rows.filter(is_shown).distinct()
