"""Access to results."""

from enum import StrEnum
from uuid import UUID

from django.contrib.auth.models import AnonymousUser, User
from django.core.exceptions import PermissionDenied
from django.db.models import Case, Q, QuerySet, When

from arena.errors import NoSnapshot, NotYours, StudyStillOpen
from arena.models import EarlyLook, Question, Snapshot, Study
from arena.people.queries import top_role
from augment.models import Event

STAFF = ("admin", "researcher")


class ResultsAccess(StrEnum):
    """Extent to which an account may see a study's results.

    Attributes:
        FULL: At any time.
        EARLY: The study is open: only by an explicit act that is written to the log.
        NONE: Not at all, or not before it closes.
    """

    FULL = "full"
    EARLY = "early"
    NONE = "none"


def results_access(*, user: User, study: Study, role: str | None = None) -> ResultsAccess:
    """Return the user's access to the results.

    Staff may open the results of an open study on purpose; if they vote in it, that ends their
    voting. An expert who still judges the same contestants in another study waits until that one
    closes. A cancelled study has no results for anybody.

    Args:
        user: Who asks.
        study: What for.
        role: Theirs, where somebody has looked it up already.
    """
    staff = (role or top_role(user)) in STAFF
    if study.state == Study.State.CLOSED:
        this = Study.objects.filter(pk=study.pk)
        reads = staff or (votes_in(user, study) and not _still_judges(user, this))
        return ResultsAccess.FULL if reads else ResultsAccess.NONE
    if not staff or study.state != Study.State.OPEN:
        return ResultsAccess.NONE
    opened = EarlyLook.objects.filter(study=study, user=user).exists()
    return ResultsAccess.FULL if opened else ResultsAccess.EARLY


def must_read_results(*, user: User, study: Study) -> None:
    """Do nothing for whoever may read a study's results now.

    Raises:
        StudyStillOpen: They may open them early, by an act of its own.
        NotYours: They may not.
    """
    access = results_access(user=user, study=study)
    if access is ResultsAccess.EARLY:
        raise StudyStillOpen(study.name)
    if access is ResultsAccess.NONE:
        raise NotYours("You may not read the results of this study.")


def votes_in(user: User, study: Study) -> bool:
    """Return whether the user is an expert of the study."""
    return study.experts.filter(pk=user.pk).exists()


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


def refuse_open_judge(user: User | AnonymousUser, studies: QuerySet[Study]) -> None:
    """Do nothing for whoever may be shown published results of these studies.

    Raises:
        PermissionDenied: An expert, signed in, still judges a contestant of theirs.
    """
    if isinstance(user, User) and top_role(user) not in STAFF and _still_judges(user, studies):
        raise PermissionDenied


def _still_judges(user: User, studies: QuerySet[Study]) -> bool:
    """Return whether an open study of this expert has a contestant of these."""
    is_open = user.studies.filter(state=Study.State.OPEN)
    return is_open.filter(contestants__in=studies.values("contestants")).exists()
