"""Uploaded recordings as a page shows them: parts, moments on a small map, the one looked at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from augment.models import SceneUpload

_AROUND_M = 35.0
_LEAST_M = 90.0


@dataclass(frozen=True, slots=True, kw_only=True)
class StopDot:
    """A moment that can be chosen; x and y are those of the drawing, None off the map."""

    number: int
    item: str
    frame: int
    time_s: float | None
    x: float | None = None
    y: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackMap:
    """One part of a recording: its moments, and the road under them as an SVG drawing.

    Attributes:
        roads: The points of polylines.
        box: The viewBox: metres, y down.
        dot: Half the width of a dot.
    """

    number: int
    name: str
    stops: list[StopDot]
    roads: list[str]
    box: str
    dot: float

    @property
    def way(self) -> str:
        """The ego's way, as the points of a polyline."""
        return " ".join(f"{s.x},{s.y}" for s in self.stops if s.x is not None)


def track_maps(upload: SceneUpload) -> list[TrackMap]:
    """Every part of what was read."""
    return [_map(number, track) for number, track in enumerate(upload.tracks)]


def place_of(maps: list[TrackMap], *, item: str, frame: int) -> tuple[TrackMap, StopDot] | None:
    """Where a moment is among them."""
    for one in maps:
        for stop in one.stops:
            if (stop.item, stop.frame) == (item, frame):
                return one, stop
    return None


def _map(number: int, track: dict[str, Any]) -> TrackMap:
    stops = [_dot(index, stop) for index, stop in enumerate(track["stops"])]
    placed = [(s.x, s.y) for s in stops if s.x is not None and s.y is not None] or [(0.0, 0.0)]
    xs, ys = [x for x, _ in placed], [y for _, y in placed]
    width = max(max(xs) - min(xs) + 2 * _AROUND_M, _LEAST_M)
    height = max(max(ys) - min(ys) + 2 * _AROUND_M, width / 3.0)
    left, top = (max(xs) + min(xs) - width) / 2.0, (max(ys) + min(ys) - height) / 2.0
    return TrackMap(
        number=number,
        name=track["name"],
        stops=stops,
        roads=[" ".join(f"{x},{-y}" for x, y in line) for line in track["roads_m"]],
        box=f"{left:.1f} {top:.1f} {width:.1f} {height:.1f}",
        dot=round(width / 110.0, 2),
    )


def _dot(index: int, stop: dict[str, Any]) -> StopDot:
    place = stop["place_m"]
    return StopDot(
        number=index,
        item=stop["item"],
        frame=stop["frame"],
        time_s=stop["time_s"],
        x=None if place is None else place[0],
        y=None if place is None else -place[1],
    )
