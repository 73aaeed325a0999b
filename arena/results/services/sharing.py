"""A link by which anybody reads the table of a rating, without an account."""

from django.contrib.auth.models import User
from django.db import transaction

from arena.errors import StudyStillOpen
from arena.models import SharedRating, Snapshot, Study
from augment.services import log_change


@transaction.atomic
def share_rating(snapshot: Snapshot, *, actor: User) -> SharedRating:
    """Make the link of a rating; one that is there stays as it is.

    Raises:
        StudyStillOpen: Whoever reads the results could still vote.
    """
    if snapshot.study.state != Study.State.CLOSED:
        raise StudyStillOpen(snapshot.study.name)
    link, is_new = SharedRating.objects.get_or_create(snapshot=snapshot)
    if is_new:
        log_change(snapshot.study, "share results", actor, after={"snapshot": str(snapshot.code)})
    return link


@transaction.atomic
def stop_sharing(snapshot: Snapshot, *, actor: User) -> None:
    """Take the link back for good; a later one is another."""
    removed, _ = SharedRating.objects.filter(snapshot=snapshot).delete()
    if removed:
        log_change(
            snapshot.study, "stop sharing results", actor, after={"snapshot": str(snapshot.code)}
        )
