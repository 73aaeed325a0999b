"""Content of a pair: pictures behind tokens, and drives."""

from collections.abc import Collection
from typing import Any
from uuid import UUID

from django.contrib.auth.models import User
from django.db.models import Q
from django.urls import reverse

from arena.errors import NotYours
from arena.models import LabelTask, Matchup, PracticePair
from arena.shell.accounts import top_role
from augment.models import Augmentation, Simulation
from augment.services.driving import blind_drive
from augment.services.scenarios import camera_key, film_name, list_marks

VIEW_OF_OLD: dict[str, Any] = {
    **{"px_per_m": 20.0, "ego_px": [300.0, 400.0]},
    **{"width": 1200, "height": 800},
}
"""The window of all pictures before windows were fitted to scenarios and views were kept. (Where a
reference did not fit it was wider: the ruler of such a picture measures too little.)"""

LEGEND = "legend"
"""In the view of a matchup: the legend's entries of its scene, and those that the pair adds."""


# --- Pictures ----------------------------------------------------------------------------------


def picture_shown(*, user: User, token: str) -> str:
    """Return the media name behind a token of the user's own showings; admins may look at all.

    Raises:
        NotYours: The token is somebody else's or stands for nothing; the text does not say which.
    """
    shown, image = _find_shown(token)
    if shown is None or not image or not _may_see(user, shown):
        raise NotYours("This picture is not shown to you.")
    return image


def picture_of_side(matchup: Matchup, side: str) -> str:
    """Return the media name of a picture as it was shown: "left", "right" or "original"."""
    if side == "original":
        return matchup.original_image
    if side == "left":
        return matchup.left_image or matchup.left.image
    return matchup.right_image or matchup.right.image


def original_beside(augmentation: Augmentation) -> str:
    """Return the picture before the change, "" where it shows another window than that after."""
    original = augmentation.scenario.original_image
    return original if camera_key(original) == camera_key(augmentation.image) else ""


def view_shown(matchup: Matchup) -> dict[str, Any]:
    """Return the view kept with a matchup; those planned before it was kept have that of then."""
    view = VIEW_OF_OLD if matchup.view is None else matchup.view
    return {name: value for name, value in view.items() if name != LEGEND}


def as_shown(matchup: Matchup) -> dict[str, Any]:
    """Return all that an expert's browser learns of a matchup: tokens, never contestants."""
    original = matchup.original_token if matchup.original_image else None
    shown = {
        "matchup": str(matchup.code),
        "position": matchup.position,
        "question": matchup.asked,
        "instruction": matchup.scenario.wording,
        "a": reverse("matchup-image", args=[matchup.left_token]),
        "b": reverse("matchup-image", args=[matchup.right_token]),
        "original": reverse("matchup-image", args=[original]) if original else None,
        "unchanged": _list_unchanged_sides(matchup),
        "is_filmed": bool(film_name(matchup.left_image)),
        **view_shown(matchup),
    }
    if matchup.objects_shown is not None:
        # Without their ids, and in an order that does not come from them.
        sides = zip("ab", matchup.objects_shown, strict=True)
        shown["objects"] = {side: [spot for _, *spot in spots] for side, spots in sides}
    if legend := (matchup.view or {}).get(LEGEND):
        shown["legend"] = sorted({*legend["scene"], *legend["pair"]})
    return shown


def note_objects(matchups: Collection[Matchup]) -> None:
    """Look up what can be marked in these pairs; one query."""
    rows = Matchup.objects.filter(pk__in={matchup.pk for matchup in matchups})
    names = ("pk", "left__modification", "right__modification")
    changes = {pk: sides for pk, *sides in rows.values_list(*names)}
    for matchup in matchups:
        view = view_shown(matchup)
        matchup.objects_shown = [list_marks(side, view) for side in changes[matchup.pk]]


def _list_unchanged_sides(matchup: Matchup) -> list[str]:
    """Return the sides that show the scene as it was; pictures are named by what they show."""
    shown = {"a": matchup.left_image, "b": matchup.right_image}
    return [side for side, image in shown.items() if image and image == matchup.original_image]


def _may_see(user: User, shown: Matchup | LabelTask | PracticePair) -> bool:
    return shown.expert_id == user.pk or top_role(user) == "admin"


def _find_shown(token: str) -> tuple[Matchup | LabelTask | PracticePair | None, str]:
    """Return the pair that a token belongs to, and the picture that it stands for."""
    is_token = Q(left_token=token) | Q(right_token=token)
    matchups = Matchup.objects.select_related("left", "right").defer(
        "left__modification", "right__modification"
    )
    if matchup := matchups.filter(is_token | Q(original_token=token)).first():
        sides = {matchup.original_token: "original", matchup.left_token: "left"}
        return matchup, picture_of_side(matchup, sides.get(token, "right"))
    tasks = LabelTask.objects.select_related("augmentation__scenario").defer(
        "augmentation__modification", "augmentation__scenario__reference"
    )
    if task := tasks.filter(Q(token=token) | Q(original_token=token)).first():
        is_after = task.token == token
        return task, task.augmentation.image if is_after else original_beside(task.augmentation)
    if pair := PracticePair.objects.select_related("good", "broken").filter(is_token).first():
        return pair, pair.left.image if pair.left_token == token else pair.right.image
    return None, ""


# --- Drives ------------------------------------------------------------------------------------


def drives_of_pair(*, user: User, code: UUID) -> dict[str, dict[str, Any]] | None:
    """Return both drives of one of the user's own pairs, as "a" and "b"; admins may look at all.

    They say nothing of who changed the scene, nor what the planner made of it. None where the
    study plays none on this scenario.

    Raises:
        NotYours: The pair is somebody else's or there is none; the text does not say which.
    """
    needed = ("expert", "left", "right", "scenario__slug", "study__allow_replay", "study__rules")
    matchups = Matchup.objects.select_related("study", "scenario").only(*needed)
    matchup = matchups.filter(code=code).first()
    if matchup is None or not _may_see(user, matchup):
        raise NotYours("This pair is not shown to you.")
    played = matchup.study.rules.get("replays", {}) if matchup.study.allow_replay else {}
    if matchup.scenario.slug not in played.get("scenarios", ()):
        return None
    drives = Simulation.objects.filter(
        augmentation__in=(matchup.left_id, matchup.right_id),
        state=Simulation.State.DONE,
        **{name: played[name] for name in ("planner", "offsets", "is_reactive")},
        version=played.get("version", 1),
    )
    drive_by_picture = {row.augmentation_id: row for row in drives.defer("document")}
    if len(drive_by_picture) < 2:
        return None
    sides = {"a": matchup.left_id, "b": matchup.right_id}
    return {side: blind_drive(drive_by_picture[key]) for side, key in sides.items()}
