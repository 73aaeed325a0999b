"""Reminding experts: each gets a link of their own anew, and the log says who did it."""

from __future__ import annotations

from collections.abc import Sequence

from django.contrib.auth.models import User
from django.db import transaction

from arena.errors import StudyNotOpen
from arena.models import Study
from arena.services.invitations import FreshLink, invite
from augment.sentences import sentence
from augment.services.events import log_event


@transaction.atomic
def remind(*, study: Study, experts: Sequence[User], actor: User | None = None) -> list[FreshLink]:
    """Links for the reminders of these experts; they replace those before. Nothing is sent.

    Raises:
        StudyNotOpen: There is nothing to do any more.
        NotYours, Conflict: See `invite`.
    """
    if study.state != Study.State.OPEN:
        raise StudyNotOpen(
            sentence("The study '%(name)s' takes no votes: nobody is reminded.", name=study.name)
        )
    links = [invite(study=study, expert=expert, actor=actor) for expert in experts]
    log_event(
        actor=actor,
        verb="remind",
        object_kind="study",
        object_code=study.code,
        after={"experts": [str(expert.person.code) for expert in experts]},
    )
    return links
