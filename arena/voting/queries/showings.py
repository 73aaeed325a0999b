"""The text description in words: what augment.render.description gives as values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import pairwise
from typing import Any
from uuid import UUID

from django.contrib.auth.models import User
from django.db.models import Q
from django.urls import reverse
from django.utils.translation import get_language, gettext
from django.utils.translation import gettext_noop as _

from arena.errors import NotYours
from arena.models import LabelTask, Matchup, PracticePair
from arena.queries.people import role_of
from augment.models import Augmentation, Simulation
from augment.services.judging.drive_files import blind_drive
from augment.services.judging.measures import LaneEdges, MeasureLine, lane_edges_of, measures_of
from augment.services.scenarios.pictures import window_of

_KINDS = {
    "EGO_VEHICLE": _("Vehicle"),
    "VEHICLE": _("Vehicle"),
    "BUS": _("Bus"),
    "BICYCLE": _("Bicycle"),
    "PEDESTRIAN": _("Pedestrian"),
    "TRAFFIC_CONE": _("Traffic cone"),
    "BARRIER": _("Barrier"),
    "CONSTRUCTION_SIGN": _("Construction sign"),
    "GENERIC_OBJECT": _("Object"),
}
_HEADINGS = {
    0: _("facing as the ego does"),
    90: _("facing left"),
    -90: _("facing right"),
    180: _("facing the opposite way"),
}
_ALONG = {0: _("lying lengthways"), 90: _("lying across")}
_FACING = (_("facing {}° to the left"), _("facing {}° to the right"))
_TURNED = (_("turned {}° to the left"), _("turned {}° to the right"))
_AHEAD = (_("{} m ahead"), _("{} m behind"))
_LEFT = (_("{} m left"), _("{} m right"))
_IN_LINE = _("in line with the ego")
_NOTHING, _GONE = _("Nothing was changed."), _("No longer there: {}")
_STANDS, _MOVES, _WALKS = _("standing"), _("moving at {} m/s"), _("walking to {}")
_ALL = (
    *(*_KINDS.values(), *_HEADINGS.values(), *_ALONG.values()),
    *(*_FACING, *_TURNED, *_AHEAD, *_LEFT, _IN_LINE, _NOTHING, _GONE, _STANDS, _MOVES, _WALKS),
)

Words = Mapping[str, str]


def describe_in_words(lines: Sequence[Mapping[str, Any]]) -> list[str]:
    """One sentence in the reader's language for each line, as they are kept with a matchup."""
    words = _words_in(get_language())
    return [_sentence(line, words) for line in lines] or [words[_NOTHING]]


# Private


@cache
def _words_in(language: str | None) -> Words:
    """All texts in the active language: looking one up is slow where a page describes many."""
    return {text: gettext(text) for text in _ALL}


def _sentence(line: Mapping[str, Any], words: Words) -> str:
    parts = [words[_KINDS[line["kind"]]], _place(line["ahead_m"], line["left_m"], words)]
    if line["heading_deg"] is not None:
        parts.append(_angle(line["heading_deg"], _HEADINGS, _FACING, words))
    if line["along_deg"] is not None:
        parts.append(_angle(line["along_deg"], _ALONG, _TURNED, words))
    if line["walk_to_m"]:
        ahead_m, left_m = line["walk_to_m"]
        parts.append(words[_WALKS].format(_place(ahead_m, left_m, words)))
    elif line["speed_mps"]:
        parts.append(words[_MOVES].format(f"{line['speed_mps']:.1f}"))
    elif line["speed_mps"] is not None:
        parts.append(words[_STANDS])
    said = ", ".join(parts)
    return words[_GONE].format(said) if line["change"] == "gone" else said


def _place(ahead_m: float, left_m: float, words: Words) -> str:
    ahead = words[_AHEAD[ahead_m < 0]].format(f"{abs(ahead_m):.1f}")
    side = words[_LEFT[left_m < 0] if left_m else _IN_LINE].format(f"{abs(left_m):.1f}")
    return f"{ahead}, {side}"


def _angle(degrees: int, named: Mapping[int, str], turns: tuple[str, str], words: Words) -> str:
    if degrees in named:
        return words[named[degrees]]
    return words[turns[degrees < 0]].format(abs(degrees))


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


def drives_of_pair(*, user: User, code: UUID) -> dict[str, dict[str, Any]] | None:
    """Both drives of one of the user's own pairs, as "a" and "b"; admins may look at all.

    They say nothing of who changed the scene, nor what the planner made of it. None where the
    study plays none on this scenario.

    Raises:
        NotYours: The pair is somebody else's or there is none; the text does not say which.
    """
    rows = Matchup.objects.select_related("study", "scenario").only(
        "left", "right", "expert", "scenario__slug", "study__allow_replay", "study__rules"
    )
    matchup = rows.filter(code=code).first()
    if matchup is None or (matchup.expert_id != user.pk and role_of(user) != "admin"):
        raise NotYours("This pair is not shown to you.")
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


_Point = list[float]

_MARGIN_PX = 24.0
"""Labels stay so far within the picture."""


def measures_of_pair(*, user: User, code: UUID) -> dict[str, Any] | None:
    """What may be drawn over both pictures of one of the user's own pairs; admins may look at all.

    It follows from the scenario alone. None where the study has no such aid.

    Args:
        user: Who looks.
        code: Of the matchup.

    Raises:
        NotYours: The pair is somebody else's or there is none; the text does not say which.
        InvalidDocument: The stored scene or intent can't be read.
    """
    matchup = _measured(user, code)
    if matchup is None:
        return None
    view = view_shown(matchup)
    reach_m = math.hypot(view["width"], view["height"]) / view["px_per_m"]
    found = measures_of(matchup.scenario, reach_m=reach_m)
    lines = [
        ([_pixels(point, view) for point in line.points_m], _label(line)) for line in found.lines
    ]
    rings = [
        (_pixels(ring.centre_m, view), ring.radius_m * view["px_per_m"], f"{ring.radius_m:.4g} m")
        for ring in found.rings
    ]
    return {
        "lines": [
            {"points": points, "label": label, **_label_place(points, view)}
            for points, label in lines
            if _is_seen(points, view)
        ],
        "rings": [
            {
                "at": centre,
                "r": round(radius, 1),
                "label": label,
                "text": place,
                "anchor": "middle",
            }
            for centre, radius, label in rings
            if (place := _first_within(_around(centre, radius), view))
        ],
    }


def lane_edges_of_pair(
    *, user: User, code: UUID, x_px: float, y_px: float
) -> tuple[LaneEdges | None] | None:
    """How far a place in the pictures is from the edges of its lane, (None,) off every lane.

    None where the study has no such aid.

    Raises:
        NotYours: The pair is somebody else's or there is none; the text does not say which.
        InvalidDocument: The stored scene can't be read.
    """
    matchup = _measured(user, code)
    if matchup is None:
        return None
    view = view_shown(matchup)
    ego_x, ego_y = view["ego_px"]
    x_m, y_m = (x_px - ego_x) / view["px_per_m"], (ego_y - y_px) / view["px_per_m"]
    return (lane_edges_of(matchup.scenario, x_m, y_m),)


# --- Private -----------------------------------------------------------------------------------


def _measured(user: User, code: UUID) -> Matchup | None:
    rows = Matchup.objects.select_related("study", "scenario").only(
        "expert", "view", "study__allow_measures", "scenario__intent", "scenario__base_scene",
        "scenario__keep_traffic",
    )  # fmt: skip
    matchup = rows.filter(code=code).first()
    if matchup is None or (matchup.expert_id != user.pk and role_of(user) != "admin"):
        raise NotYours("This pair is not shown to you.")
    return matchup if matchup.study.allow_measures else None


def _label(line: MeasureLine) -> str:
    if line.ahead_m is not None:
        text = gettext("{} m ahead") if line.ahead_m >= 0.0 else gettext("{} m behind")
        return text.format(f"{abs(line.ahead_m):.4g}")
    if not line.left_m:
        return gettext("centre of the lane")
    text = gettext("{} m left") if line.left_m > 0.0 else gettext("{} m right")
    return text.format(f"{abs(line.left_m):.4g}")


def _pixels(point_m: tuple[float, float], view: dict[str, Any]) -> _Point:
    (ego_x, ego_y), scale = view["ego_px"], view["px_per_m"]
    return [round(ego_x + point_m[0] * scale, 1), round(ego_y - point_m[1] * scale, 1)]


def _around(centre: _Point, radius: float) -> list[_Point]:
    """Points of a circle, the ones furthest up first: there a label is least in the way."""
    turns = [side * math.radians(degrees) for degrees in range(0, 181, 10) for side in (1, -1)]
    return [
        [
            round(centre[0] + radius * math.sin(turn), 1),
            round(centre[1] - radius * math.cos(turn), 1),
        ]
        for turn in turns
    ]


def _is_within(point: _Point, view: dict[str, Any]) -> bool:
    sizes = (float(view["width"]), float(view["height"]))
    return all(
        _MARGIN_PX <= value <= size - _MARGIN_PX for value, size in zip(point, sizes, strict=True)
    )


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
