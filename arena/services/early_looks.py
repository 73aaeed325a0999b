"""Looking at results of a study that is still open."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db import transaction

from arena.models import EarlyLook, Study
from arena.queries.studies.results import votes_in
from augment.errors import Conflict
from augment.services.events import log_event


@transaction.atomic
def open_early(*, study: Study, actor: User) -> None:
    """Open the results of an open study to somebody, who no longer votes in it from then on.

    Raises:
        Conflict: The study is not open: there is nothing to open early.
    """
    if study.state != Study.State.OPEN:
        raise Conflict(f"The study '{study.name}' is {study.state}: nothing is opened early.")
    _, is_new = EarlyLook.objects.get_or_create(study=study, user=actor)
    if is_new:
        ends_voting = votes_in(actor, study)
        _log(study, actor, what="results", ends_voting=ends_voting)


def log_early_look(*, study: Study, actor: User | None, what: str) -> None:
    """Write to the log that somebody looked at results of an open study on purpose."""
    _log(study, actor, what=what)


def _log(study: Study, actor: User | None, **seen: object) -> None:
    log_event(
        actor=actor, verb="look early", object_kind="study", object_code=study.code, after=seen
    )
