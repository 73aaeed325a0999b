"""Ends of a study: closed with results, or cancelled without any. Neither can be taken back."""

from __future__ import annotations

from typing import Any

from django.contrib.auth.models import User
from django.db import transaction
from django.utils import timezone

from arena.errors import StudyNotOpen
from arena.models import Study
from augment.services.events import log_event
from augment.services.texts import check_prose

LONGEST_WHY = 1_000


@transaction.atomic
def close_study(*, study: Study, actor: User | None = None) -> Study:
    """Take no more votes; its results may be read from now on. Closing twice changes nothing.

    Votes under way are waited for, so none arrives after the study is closed.

    Raises:
        StudyNotOpen: The study was cancelled.
    """
    study = Study.objects.select_for_update().get(pk=study.pk)
    if study.state == Study.State.CLOSED:
        return study
    if study.state != Study.State.OPEN:
        raise StudyNotOpen(f"The study '{study.name}' was cancelled: there is nothing to close.")
    return _end(study, Study.State.CLOSED, verb="close", actor=actor)


@transaction.atomic
def cancel_study(*, study: Study, why: str = "", actor: User | None = None) -> Study:
    """Give a study up: no more votes, no rating, no results. Cancelling twice changes nothing.

    The votes stay, as votes. Nobody reads ratings that were made early.

    Args:
        study: An open one.
        why: For the log, empty for no reason given.
        actor: Who does it, for the log.

    Raises:
        StudyNotOpen: The study is closed, and has results.
        InvalidDocument: The reason is too long, or can't be stored.
    """
    if why := why.strip():
        check_prose("why", why, what="study", longest=LONGEST_WHY)
    study = Study.objects.select_for_update().get(pk=study.pk)
    if study.state == Study.State.CANCELLED:
        return study
    if study.state != Study.State.OPEN:
        raise StudyNotOpen(
            f"The study '{study.name}' is closed: it has results and can't be cancelled."
        )
    more = {"why": why} if why else {}
    return _end(study, Study.State.CANCELLED, verb="cancel", actor=actor, **more)


def _end(study: Study, state: Study.State, *, verb: str, actor: User | None, **more: Any) -> Study:
    # A vote holds its matchup's row until it is stored; see arena.voting.services.casting.
    list(study.matchups.select_for_update().order_by("pk").values_list("pk", flat=True))
    study.state = state
    study.closed_at = timezone.now()
    study.save(update_fields=["state", "closed_at"])
    log_event(
        actor=actor,
        verb=verb,
        object_kind="study",
        object_code=study.code,
        before={"state": Study.State.OPEN.value},
        after={"state": state.value, **more},
    )
    return study
