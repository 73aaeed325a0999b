"""What is shown of a pair: pictures behind tokens, texts, drives, and measures over it."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any
from uuid import UUID

from django.contrib.auth.models import User
from django.db.models import Q
from django.urls import reverse
from django.utils.translation import gettext, gettext_noop

from arena.errors import NotYours
from arena.models import LabelTask, Matchup, PracticePair
from arena.people.queries import role_of
from augment.models import Augmentation, Simulation
from augment.services.judging.findings import LaneEdges, MeasureLine, lane_edges_of, measures_of
from augment.services.judging.simulations import blind_drive
from augment.services.scenarios.pictures import window_of

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
    """The media name behind a token of the user's own showings; admins may look at all.

    Raises:
        NotYours: The token is somebody else's or stands for nothing; the text does not say which.
    """
    shown, image = _find_shown(token)
    if shown is None or not image or not _may_see(user, shown):
        raise NotYours("This picture is not shown to you.")
    return image


def picture_of_side(matchup: Matchup, side: str) -> str:
    """The media name of a picture as it was shown: "left", "right" or "original"."""
    if side == "original":
        return matchup.original_image
    if side == "left":
        return matchup.left_image or matchup.left.image
    return matchup.right_image or matchup.right.image


def original_beside(augmentation: Augmentation) -> str:
    """The picture before the change, "" where it shows another window than that after it."""
    original = augmentation.scenario.original_image
    return original if window_of(original) == window_of(augmentation.image) else ""


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


def _may_see(user: User, shown: Matchup | LabelTask | PracticePair) -> bool:
    return shown.expert_id == user.pk or role_of(user) == "admin"


def _find_shown(token: str) -> tuple[Matchup | LabelTask | PracticePair | None, str]:
    """What a token belongs to, and the picture that it stands for."""
    matchup = (
        Matchup.objects.filter(
            Q(left_token=token) | Q(right_token=token) | Q(original_token=token)
        )
        .select_related("left", "right")
        .defer("left__modification", "right__modification", "descriptions")
        .first()
    )
    if matchup is not None:
        sides = {matchup.original_token: "original", matchup.left_token: "left"}
        return matchup, picture_of_side(matchup, sides.get(token, "right"))
    task = (
        LabelTask.objects.filter(Q(token=token) | Q(original_token=token))
        .select_related("augmentation__scenario")
        .defer("augmentation__modification", "augmentation__scenario__reference")
        .first()
    )
    if task is not None:
        is_after = task.token == token
        return task, task.augmentation.image if is_after else original_beside(task.augmentation)
    pairs = PracticePair.objects.filter(Q(left_token=token) | Q(right_token=token))
    pair = pairs.select_related("good", "broken").first()
    if pair is None:
        return None, ""
    return pair, pair.left.image if pair.left_token == token else pair.right.image


def _pair_of(user: User, code: UUID, *columns: str) -> Matchup:
    """The matchup with these columns and those of its study and scenario that they name.

    Raises:
        NotYours: The pair is somebody else's or there is none; the text does not say which.
    """
    rows = Matchup.objects.select_related("study", "scenario").only("expert", *columns)
    matchup = rows.filter(code=code).first()
    if matchup is None or not _may_see(user, matchup):
        raise NotYours("This pair is not shown to you.")
    return matchup


# --- Texts -------------------------------------------------------------------------------------

_KINDS = {
    "EGO_VEHICLE": gettext_noop("Vehicle"),
    "VEHICLE": gettext_noop("Vehicle"),
    "BUS": gettext_noop("Bus"),
    "BICYCLE": gettext_noop("Bicycle"),
    "PEDESTRIAN": gettext_noop("Pedestrian"),
    "TRAFFIC_CONE": gettext_noop("Traffic cone"),
    "BARRIER": gettext_noop("Barrier"),
    "CONSTRUCTION_SIGN": gettext_noop("Construction sign"),
    "GENERIC_OBJECT": gettext_noop("Object"),
}
_HEADINGS = {
    0: gettext_noop("facing as the ego does"),
    90: gettext_noop("facing left"),
    -90: gettext_noop("facing right"),
    180: gettext_noop("facing the opposite way"),
}
_ALONG = {0: gettext_noop("lying lengthways"), 90: gettext_noop("lying across")}
_FACING = (gettext_noop("facing {}° to the left"), gettext_noop("facing {}° to the right"))
_TURNED = (gettext_noop("turned {}° to the left"), gettext_noop("turned {}° to the right"))
_AHEAD = (gettext_noop("{} m ahead"), gettext_noop("{} m behind"))
_LEFT = (gettext_noop("{} m left"), gettext_noop("{} m right"))


def describe_in_words(lines: Sequence[Mapping[str, Any]]) -> list[str]:
    """One sentence in the reader's language for each line of the text description of a picture."""
    return [_sentence(line) for line in lines] or [gettext("Nothing was changed.")]


def _sentence(line: Mapping[str, Any]) -> str:
    parts = [gettext(_KINDS[line["kind"]]), _place(line["ahead_m"], line["left_m"])]
    if line["heading_deg"] is not None:
        parts.append(_angle(line["heading_deg"], _HEADINGS, _FACING))
    if line["along_deg"] is not None:
        parts.append(_angle(line["along_deg"], _ALONG, _TURNED))
    if line["walk_to_m"]:
        parts.append(gettext("walking to {}").format(_place(*line["walk_to_m"])))
    elif line["speed_mps"]:
        parts.append(gettext("moving at {} m/s").format(f"{line['speed_mps']:.1f}"))
    elif line["speed_mps"] is not None:
        parts.append(gettext("standing"))
    sentence = ", ".join(parts)
    if line["change"] == "gone":
        return gettext("No longer there: {}").format(sentence)
    return sentence


def _place(ahead_m: float, left_m: float) -> str:
    ahead = gettext(_AHEAD[ahead_m < 0]).format(f"{abs(ahead_m):.1f}")
    if not left_m:
        return f"{ahead}, {gettext('in line with the ego')}"
    return f"{ahead}, {gettext(_LEFT[left_m < 0]).format(f'{abs(left_m):.1f}')}"


def _angle(degrees: int, named: Mapping[int, str], turns: tuple[str, str]) -> str:
    return gettext(named.get(degrees, turns[degrees < 0])).format(abs(degrees))


# --- Drives ------------------------------------------------------------------------------------


def drives_of_pair(*, user: User, code: UUID) -> dict[str, dict[str, Any]] | None:
    """Both drives of one of the user's own pairs, as "a" and "b"; admins may look at all.

    They say nothing of who changed the scene, nor what the planner made of it. None where the
    study plays none on this scenario.

    Raises:
        NotYours: The pair is somebody else's or there is none; the text does not say which.
    """
    needed = ("left", "right", "scenario__slug", "study__allow_replay", "study__rules")
    matchup = _pair_of(user, code, *needed)
    played = matchup.study.rules.get("replays", {}) if matchup.study.allow_replay else {}
    if matchup.scenario.slug not in played.get("scenarios", ()):
        return None
    drives = Simulation.objects.filter(
        augmentation__in=(matchup.left_id, matchup.right_id),
        state=Simulation.State.DONE,
        **{name: played[name] for name in ("planner", "offsets", "is_reactive")},
    )
    drive_by_picture = {row.augmentation_id: row for row in drives.defer("document")}
    if len(drive_by_picture) < 2:
        return None
    sides = {"a": matchup.left_id, "b": matchup.right_id}
    return {side: blind_drive(drive_by_picture[key]) for side, key in sides.items()}


# --- Measures ----------------------------------------------------------------------------------

_Point = list[float]

_RING_STEP_M = 10
_MARGIN_PX = 24.0
"""Labels stay so far within the picture."""

_MEASURED = (
    "view",
    "study__allow_measures",
    "scenario__intent",
    "scenario__base_scene",
    "scenario__keep_traffic",
)


def measures_of_pair(*, user: User, code: UUID) -> dict[str, Any] | None:
    """Lines and rings over both pictures of one of the user's own pairs, in pixels.

    They follow from the scenario alone; admins may look at all. None where the study has no such
    aid.

    Raises:
        NotYours: The pair is somebody else's or there is none; the text does not say which.
        InvalidDocument: The stored scene or intent can't be read.
    """
    matchup = _pair_of(user, code, *_MEASURED)
    if not matchup.study.allow_measures:
        return None
    view = view_shown(matchup)
    reach_m = math.hypot(view["width"], view["height"]) / view["px_per_m"]
    lines = []
    for line in measures_of(matchup.scenario):
        points = [_pixels(point, view) for point in line.points_m]
        if _is_seen(points, view):
            label = {"label": _label(line), **_label_place(points, view)}
            lines.append({"points": points, **label})
    rings = []
    for radius_m in range(_RING_STEP_M, int(reach_m) + 1, _RING_STEP_M):
        centre, radius = view["ego_px"], radius_m * view["px_per_m"]
        if place := _first_within(_around(centre, radius), view):
            label = {"label": f"{radius_m} m", "text": place, "anchor": "middle"}
            rings.append({"at": centre, "r": round(radius, 1), **label})
    return {"lines": lines, "rings": rings}


def lane_edges_of_pair(
    *, user: User, code: UUID, x_px: float, y_px: float
) -> tuple[LaneEdges | None] | None:
    """How far a place in the pictures is from the edges of its lane, (None,) off every lane.

    None where the study has no such aid.

    Raises:
        NotYours: The pair is somebody else's or there is none; the text does not say which.
        InvalidDocument: The stored scene can't be read.
    """
    matchup = _pair_of(user, code, *_MEASURED)
    if not matchup.study.allow_measures:
        return None
    view = view_shown(matchup)
    ego_x, ego_y = view["ego_px"]
    x_m, y_m = (x_px - ego_x) / view["px_per_m"], (ego_y - y_px) / view["px_per_m"]
    return (lane_edges_of(matchup.scenario, x_m, y_m),)


def _label(line: MeasureLine) -> str:
    if line.ahead_m is not None:
        return gettext(_AHEAD[line.ahead_m < 0.0]).format(f"{abs(line.ahead_m):.4g}")
    if not line.left_m:
        return gettext("centre of the lane")
    return gettext(_LEFT[line.left_m < 0.0]).format(f"{abs(line.left_m):.4g}")


def _pixels(point_m: tuple[float, float], view: dict[str, Any]) -> _Point:
    (ego_x, ego_y), scale = view["ego_px"], view["px_per_m"]
    return [round(ego_x + point_m[0] * scale, 1), round(ego_y - point_m[1] * scale, 1)]


def _around(centre: _Point, radius: float) -> list[_Point]:
    """Points of a circle, the ones furthest up first: there a label is least in the way."""
    turns = [side * math.radians(degrees) for degrees in range(0, 181, 10) for side in (1, -1)]
    x, y = centre
    return [
        [round(x + radius * math.sin(turn), 1), round(y - radius * math.cos(turn), 1)]
        for turn in turns
    ]


def _is_within(point: _Point, view: dict[str, Any]) -> bool:
    x, y = point
    wide, high = view["width"] - _MARGIN_PX, view["height"] - _MARGIN_PX
    return bool(_MARGIN_PX <= x <= wide and _MARGIN_PX <= y <= high)


def _is_seen(points: list[_Point], view: dict[str, Any]) -> bool:
    """Whether any of a line is within the picture: its points and the middles between them."""
    middles = [[(x + u) / 2.0, (y + v) / 2.0] for (x, y), (u, v) in pairwise(points)]
    return any(_is_within(point, view) for point in (*points, *middles))


def _first_within(points: list[_Point], view: dict[str, Any]) -> _Point | None:
    return next((point for point in points if _is_within(point, view)), None)


def _label_place(points: list[_Point], view: dict[str, Any]) -> dict[str, Any]:
    """Where a line's label stands, beside its first point within the picture.

    Lines along the lane have it before them, so that it meets no label of a line across.
    """
    x, y = _first_within(points, view) or [
        min(max(value, _MARGIN_PX), view[side] - _MARGIN_PX)
        for value, side in zip(points[0], ("width", "height"), strict=True)
    ]
    is_along = len(points) > 2
    has_room = x > view["width"] * (0.2 if is_along else 0.8)
    return {"at": [x, y], "anchor": "end" if has_room else "start"}
