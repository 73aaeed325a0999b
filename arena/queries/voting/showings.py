"""Which picture a token stands for, and for whom."""

from __future__ import annotations

from typing import Any

from django.contrib.auth.models import User
from django.db.models import Q
from django.urls import reverse

from arena.errors import NotYours
from arena.models import LabelTask, Matchup, PracticePair
from arena.people.queries import role_of
from arena.queries.voting.descriptions import describe_in_words
from augment.models import Augmentation
from augment.services.scenarios.pictures import window_of

VIEW_OF_OLD: dict[str, Any] = {
    **{"px_per_m": 20.0, "ego_px": [300.0, 400.0]},
    **{"width": 1200, "height": 800},
}
"""The window of all pictures before windows were fitted to scenarios and views were kept. (Where a
reference did not fit it was wider: the ruler of such a picture measures too little.)"""

LEGEND = "legend"
"""In the view of a matchup: the legend's entries of its scene, and those that the pair adds."""

_NOT_SHOWN = "This picture is not shown to you."


def picture_shown(*, user: User, token: str) -> str:
    """The media name behind a token of the user's own showings; admins may look at all.

    Raises:
        NotYours: The token is somebody else's or stands for nothing; the text does not say which.
    """
    rows = Matchup.objects.filter(
        Q(left_token=token) | Q(right_token=token) | Q(original_token=token)
    )
    unread = ("left__modification", "right__modification", "descriptions")
    shown = rows.select_related("left", "right").defer(*unread)
    matchup = shown.order_by().first()
    if matchup is None:
        return _picture_to_label(user=user, token=token)
    if matchup.expert_id != user.pk and role_of(user) != "admin":
        raise NotYours(_NOT_SHOWN)
    sides = {matchup.original_token: "original", matchup.left_token: "left"}
    return picture_of_side(matchup, sides.get(token, "right"))


def picture_of_side(matchup: Matchup, side: str) -> str:
    """The media name of a picture as it was shown: "left", "right" or "original"."""
    if side == "original":
        return matchup.original_image
    if side == "left":
        return matchup.left_image or matchup.left.image
    return matchup.right_image or matchup.right.image


def view_shown(matchup: Matchup) -> dict[str, Any]:
    """The view kept with a matchup; those planned before it was kept have the one of then."""
    kept = VIEW_OF_OLD if matchup.view is None else matchup.view
    return {name: value for name, value in kept.items() if name != LEGEND}


def as_shown(matchup: Matchup) -> dict[str, Any]:
    """All that an expert's browser learns of a matchup: tokens, never contestants."""
    original = matchup.original_token if matchup.original_image else None
    legend = (matchup.view or {}).get(LEGEND)
    shown = {
        "matchup": str(matchup.code),
        "position": matchup.position,
        "instruction": matchup.scenario.instruction,
        "a": reverse("matchup-image", args=[matchup.left_token]),
        "b": reverse("matchup-image", args=[matchup.right_token]),
        "original": reverse("matchup-image", args=[original]) if original else None,
        **view_shown(matchup),
    }
    if legend is not None:
        shown["legend"] = sorted({*legend["scene"], *legend["pair"]})
    if matchup.descriptions is not None:
        left, right = matchup.descriptions
        shown["text"] = {"a": describe_in_words(left), "b": describe_in_words(right)}
    return shown


def original_beside(augmentation: Augmentation) -> str:
    """The picture before the change, "" where it shows another window than that after it."""
    original = augmentation.scenario.original_image
    return original if window_of(original) == window_of(augmentation.image) else ""


def _picture_to_label(*, user: User, token: str) -> str:
    rows = LabelTask.objects.filter(Q(token=token) | Q(original_token=token))
    tasks = rows.select_related("augmentation__scenario").defer(
        "augmentation__modification", "augmentation__scenario__reference"
    )
    task = tasks.first()
    if task is None:
        return _picture_practised(user=user, token=token)
    if task.expert_id != user.pk and role_of(user) != "admin":
        raise NotYours(_NOT_SHOWN)
    if task.token == token:
        return task.augmentation.image
    original = original_beside(task.augmentation)
    if not original:
        raise NotYours(_NOT_SHOWN)
    return original


def _picture_practised(*, user: User, token: str) -> str:
    rows = PracticePair.objects.filter(Q(left_token=token) | Q(right_token=token))
    pair = rows.select_related("good", "broken").order_by().first()
    if pair is None or (pair.expert_id != user.pk and role_of(user) != "admin"):
        raise NotYours(_NOT_SHOWN)
    return pair.left.image if pair.left_token == token else pair.right.image
