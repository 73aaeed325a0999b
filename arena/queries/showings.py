"""Which picture a token stands for, and for whom."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db.models import Q

from arena.errors import NotYours
from arena.models import LabelTask, Matchup
from arena.queries.people import role_of

_NOT_SHOWN = "This picture is not shown to you."


def picture_shown(*, user: User, token: str) -> str:
    """The media name behind a token of the user's own showings; admins may look at all.

    Raises:
        NotYours: The token is somebody else's or stands for nothing; the text does not say which.
    """
    rows = Matchup.objects.filter(Q(left_token=token) | Q(right_token=token))
    found = rows.select_related("left", "right").defer("left__modification", "right__modification")
    matchup = found.first()
    if matchup is None:
        return _picture_to_label(user=user, token=token)
    if matchup.expert_id != user.pk and role_of(user) != "admin":
        raise NotYours(_NOT_SHOWN)
    shown = matchup.left if matchup.left_token == token else matchup.right
    return shown.image


def _picture_to_label(*, user: User, token: str) -> str:
    rows = LabelTask.objects.filter(Q(token=token) | Q(original_token=token))
    found = rows.select_related("augmentation__scenario").defer(
        "augmentation__modification", "augmentation__scenario__reference"
    )
    task = found.first()
    if task is None or (task.expert_id != user.pk and role_of(user) != "admin"):
        raise NotYours(_NOT_SHOWN)
    if task.token == token:
        return task.augmentation.image
    return task.augmentation.scenario.original_image
