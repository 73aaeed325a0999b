"""Marking experts as authors of contestants, and taking it back; both stay in the log."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import Authorship, Study
from arena.services.people import must_take_part
from augment.errors import UnknownName
from augment.services.events import log_event


@transaction.atomic
def mark_author(
    *, study: Study, expert: User, contestant: str, actor: User | None = None
) -> Authorship:
    """Say that an expert of the study is an author of a contestant of it, whatever its state.

    Their votes stay as they are; ratings made from then on know of it. Twice changes nothing.

    Args:
        study: Also an open one: experts see nothing of it.
        expert: Takes part in the study.
        contestant: The slug of one of its contestants.
        actor: Who says so, for the log.

    Raises:
        NotYours: The account does not take part in the study.
        UnknownName: The study has no such contestant.
    """
    must_take_part(study=study, expert=expert)
    made = study.contestants.filter(slug=contestant).first()
    if made is None:
        known = study.contestants.order_by("slug").values_list("slug", flat=True)
        raise UnknownName("contestant", contestant, list(known))
    row, is_new = Authorship.objects.get_or_create(
        study=study, expert=expert, contestant=made, defaults={"marked_by": actor}
    )
    if is_new:
        _log("mark author", row, actor)
    return row


@transaction.atomic
def take_back_author(*, authorship: Authorship, actor: User | None = None) -> None:
    """Forget that an expert is an author of a contestant; ratings made before keep it.

    Twice changes nothing more.
    """
    held = Authorship.objects.select_for_update(of=("self",)).filter(pk=authorship.pk).first()
    if held is None:
        return
    _log("take back author", held, actor)
    held.delete()


def _log(verb: str, row: Authorship, actor: User | None) -> None:
    log_event(
        actor=actor,
        verb=verb,
        object_kind="study",
        object_code=row.study.code,
        after={"expert": str(row.expert.person.code), "contestant": row.contestant.slug},
    )
