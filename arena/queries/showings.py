"""Which picture a token stands for, and for whom."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db.models import Q

from arena.errors import NotYours
from arena.models import Matchup
from arena.queries.people import role_of


def picture_shown(*, user: User, token: str) -> str:
    """The media name behind a token of the user's own matchups; admins may look at all.

    Raises:
        NotYours: The token is somebody else's or stands for nothing; the text does not say which.
    """
    rows = Matchup.objects.filter(Q(left_token=token) | Q(right_token=token))
    found = rows.select_related("left", "right").defer("left__modification", "right__modification")
    matchup = found.first()
    if matchup is None or (matchup.expert_id != user.pk and role_of(user) != "admin"):
        raise NotYours("This picture is not shown to you.")
    shown = matchup.left if matchup.left_token == token else matchup.right
    return shown.image
