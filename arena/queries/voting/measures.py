"""Lines, rings and lane edges over a pair, in pixels of its pictures, for who judges it."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any
from uuid import UUID

from django.contrib.auth.models import User
from django.utils.translation import gettext as _

from arena.errors import NotYours
from arena.models import Matchup
from arena.people.queries import role_of
from arena.queries.voting.showings import view_shown
from augment.services.judging.findings import LaneEdges, MeasureLine, lane_edges_of, measures_of

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
        text = _("{} m ahead") if line.ahead_m >= 0.0 else _("{} m behind")
        return text.format(f"{abs(line.ahead_m):.4g}")
    if not line.left_m:
        return _("centre of the lane")
    text = _("{} m left") if line.left_m > 0.0 else _("{} m right")
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
