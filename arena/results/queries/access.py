"""Access to results."""

from uuid import UUID

from django.db.models import Case, Q, QuerySet, When

from arena.errors import NoSnapshot
from arena.models import Question, Snapshot, Study
from augment.models import Event


def ready_snapshots(study: Study) -> QuerySet[Snapshot]:
    """Return the ratings that are ready, first the one that is shown unless another is asked for.

    Those of the primary question come first, of these the newest.
    """
    primary = study.questions[0]
    is_primary = Q(filters__question=primary)
    if primary == Question.INSTRUCTION:  # ratings of before know of no other
        is_primary |= Q(filters__question__isnull=True)
    rank = Case(When(is_primary, then=0), default=1)
    return study.snapshots.filter(state=Snapshot.State.READY).order_by(rank, "-made_at", "-pk")


def list_snapshots(study: Study) -> QuerySet[Snapshot]:
    """All ratings, the newest first."""
    return study.snapshots.order_by("-made_at", "-pk")


def snapshot_to_export(study: Study, code: UUID | None = None) -> Snapshot:
    """The rating with that code, without one the first of `ready_snapshots`.

    Raises:
        NoSnapshot: The study has not been rated yet, or not by that rating, or was cancelled.
    """
    if study.state == Study.State.CANCELLED:
        raise NoSnapshot(f"The study {study.name!r} was cancelled: it has votes, but no results.")
    ready = ready_snapshots(study)
    snapshot = (ready if code is None else ready.filter(code=code)).first()
    if snapshot is None:
        what = "no rating yet" if code is None else f"no rating {code}"
        raise NoSnapshot(f"The study {study.name!r} has {what}. Rate it first.")
    return snapshot


def list_events(study: Study, *, most: int) -> list[Event]:
    """Return the events of a study, the newest first; one query."""
    about = Q(object_kind="study", object_code=str(study.code))
    rows = Event.objects.filter(about).select_related("actor__person")
    return list(rows.order_by("-at", "-pk")[:most])


def names_in_log(study: Study) -> dict[str, str]:
    """Pseudonyms by code and by account; one query."""
    names: dict[str, str] = {}
    who = study.experts.values_list("person__code", "username", "person__pseudonym")
    for code, username, pseudonym in who:
        names[str(code)] = names[username] = pseudonym
    return names
