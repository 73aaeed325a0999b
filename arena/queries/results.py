"""Who may see results, and which."""

from __future__ import annotations

from enum import StrEnum

from django.contrib.auth.models import User

from arena.errors import NoSnapshot
from arena.models import Snapshot, Study
from arena.queries.people import role_of


class ResultsAccess(StrEnum):
    """How far somebody may look at a study's results.

    Attributes:
        FULL: At any time.
        EARLY: The study is open: only by an explicit act that is written to the log.
        NONE: Not at all, or not before it closes.
    """

    FULL = "full"
    EARLY = "early"
    NONE = "none"


def results_access(*, user: User, study: Study) -> ResultsAccess:
    """What the user may see; whoever votes in an open study sees nothing, whatever the role.

    An expert who still judges the same contestants in another study waits until that one closes.
    """
    votes_in_it = study.experts.filter(pk=user.pk).exists()
    staff = role_of(user) in ("admin", "analyst")
    if study.state == Study.State.CLOSED:
        reads = staff or (votes_in_it and not _still_judges(user, study))
        return ResultsAccess.FULL if reads else ResultsAccess.NONE
    return ResultsAccess.EARLY if staff and not votes_in_it else ResultsAccess.NONE


def latest_snapshot(study: Study) -> Snapshot | None:
    """The study's newest rating, None before the first."""
    return study.snapshots.order_by("-made_at", "-pk").first()


def snapshot_to_export(study: Study) -> Snapshot:
    """The newest rating.

    Raises:
        NoSnapshot: The study has not been rated yet.
    """
    found = latest_snapshot(study)
    if found is None:
        raise NoSnapshot(f"The study {study.name!r} has no rating yet. Rate it first.")
    return found


def _still_judges(user: User, study: Study) -> bool:
    """Whether an open study of this expert has a contestant of this one."""
    is_open = user.studies.filter(state=Study.State.OPEN)
    return is_open.filter(contestants__in=study.contestants.all()).exists()
