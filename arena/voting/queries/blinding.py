"""Access to results: nobody who still judges a contestant sees how it does."""

from enum import StrEnum

from django.contrib.auth.models import AnonymousUser, User
from django.core.exceptions import PermissionDenied
from django.db.models import QuerySet

from arena.errors import NotYours, StudyStillOpen
from arena.models import EarlyLook, Study
from arena.shell.access import STAFF
from arena.shell.accounts import top_role


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


def is_imported(study: Study) -> bool:
    """Return whether the votes came from a file."""
    return hasattr(study, "vote_file")
