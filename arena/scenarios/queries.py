"""Scenarios, scenes and recordings as pages show them."""

import math
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from django.db.models import Case, Count, IntegerField, QuerySet, Value, When

from augment.models import Augmentation, Contestant, Scenario, SceneUpload
from augment.services.scenarios.scenes import type_choices


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeGroup:
    """All scenarios of one type."""

    type: str
    label: str
    scenarios: list[Scenario]


OWN = "own"
"""The scenarios that are in no set of the catalogue."""


def by_type(chosen: str = "", *, with_paraphrases: bool = True) -> list[TypeGroup]:
    """Return what forms offer, in the order of the types; types without scenarios are left out.

    Args:
        chosen: A set of the catalogue, `own` for those in none; empty for all.
        with_paraphrases: Whether those count that say another one in other words.
    """
    offered = Scenario.objects.filter(retired_at=None).select_related("base_scene")
    found = offered.defer("reference", "base_scene__document", "base_scene__recording")
    if chosen:
        found = found.filter(catalogue_set="" if chosen == OWN else chosen)
    if not with_paraphrases:
        found = found.filter(paraphrase_of=None)
    return group_by_type(list(found))


def group_by_type(rows: list[Scenario]) -> list[TypeGroup]:
    """Return rows in groups, in the order of the types."""
    groups = [
        TypeGroup(type=name, label=label, scenarios=[row for row in rows if row.type == name])
        for name, label in type_choices()
    ]
    return [group for group in groups if group.scenarios]


def listed_scenarios(chosen: str, *, is_retired: bool) -> QuerySet[Scenario]:
    """Return scenarios in the order of the types, without paraphrases and documents.

    Args:
        chosen: A set of the catalogue, `own` for those in none; empty for all.
        is_retired: Those that forms offer no more, instead of the others.
    """
    rows = Scenario.objects.filter(paraphrase_of=None, retired_at__isnull=not is_retired)
    if chosen:
        rows = rows.filter(catalogue_set="" if chosen == OWN else chosen)
    places = [When(type=name, then=Value(n)) for n, (name, _) in enumerate(type_choices())]
    place = Case(*places, default=Value(len(places)), output_field=IntegerField())
    lean = rows.select_related("base_scene").defer(
        "reference", "base_scene__document", "base_scene__recording"
    )
    return lean.alias(place=place).order_by("place", "slug")


def set_choices(chosen: str) -> list[dict[str, Any]]:
    """Return all scenarios first (named by the empty text), then the sets that there are."""
    offered = Scenario.objects.filter(paraphrase_of=None, retired_at=None)
    counted = offered.values_list("catalogue_set").annotate(number=Count("pk")).order_by()
    numbers = {name or OWN: number for name, number in counted}
    present = {"": sum(numbers.values())} | {
        name: numbers[name] for name in (*Scenario.SETS, OWN) if numbers.get(name)
    }
    return [
        {"name": name, "number": number, "is_chosen": name == chosen}
        for name, number in present.items()
    ]


def set_asked(name: str | None) -> str:
    """Return the set that an address asks for; all where it names none."""
    return name if name is not None and name in {*Scenario.SETS, OWN} else ""


def reference_pictures(scenarios: Sequence[Scenario]) -> dict[int, uuid.UUID]:
    """Return, by scenario, the youngest augmentation that draws its reference."""
    rows = Augmentation.objects.filter(
        scenario__in=scenarios,
        contestant__kind=Contestant.Kind.REFERENCE,
        state=Augmentation.State.DONE,
    )
    return dict(rows.order_by("created_at", "pk").values_list("scenario_id", "code"))


def augmentations_of(scenario: Scenario) -> list[Augmentation]:
    """Return every augmentation of a scenario with a picture, the youngest job first."""
    rows = scenario.augmentations.filter(state__in=Augmentation.SHOWABLE).exclude(image="")
    return list(
        rows.select_related("contestant", "job")
        .defer("modification")
        .order_by("-job__created_at", "contestant__name")
    )


def modification_lines(document: dict[str, Any] | None) -> list[dict[str, Any]]:
    """Return a line for each agent that a stored modification adds, moves or removes.

    Frame: ego frame, x forward and y left in metres.
    """
    if document is None:
        return []
    changed = [("added", agent) for agent in document.get("add", ())]
    changed += [("moved", agent) for agent in document.get("move", ())]
    numbers = ("x_m", "y_m", "length_m", "width_m", "speed_mps")
    lines = [
        {
            "change": change,
            "agent": agent["id"],
            "kind": agent["type"].replace("_", " ").lower(),
            "heading_deg": math.degrees(agent["heading_rad"]),
            "lane": agent.get("lane_id", ""),
            **{name: agent.get(name) for name in numbers},
        }
        for change, agent in changed
    ]
    removed = document.get("remove", ())
    return lines + [{"change": "removed", "agent": name, "x_m": None} for name in removed]


# --- Maps of uploaded recordings ---------------------------------------------------------------

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
        return " ".join(f"{stop.x},{stop.y}" for stop in self.stops if stop.x is not None)


def track_maps(upload: SceneUpload) -> list[TrackMap]:
    """Return every part of what was read."""
    return [_map(number, track) for number, track in enumerate(upload.tracks)]


def place_of(maps: list[TrackMap], *, item: str, frame: int) -> tuple[TrackMap, StopDot] | None:
    """Return where a moment is among them."""
    places = ((track, stop) for track in maps for stop in track.stops)
    return next(
        (place for place in places if (place[1].item, place[1].frame) == (item, frame)), None
    )


def _map(number: int, track: dict[str, Any]) -> TrackMap:
    places = [stop["place_m"] for stop in track["stops"]]
    stops = [
        StopDot(
            number=index,
            item=stop["item"],
            frame=stop["frame"],
            time_s=stop["time_s"],
            x=None if place is None else place[0],
            y=None if place is None else -place[1],
        )
        for index, (stop, place) in enumerate(zip(track["stops"], places, strict=True))
    ]
    placed = [(place[0], -place[1]) for place in places if place is not None] or [(0.0, 0.0)]
    xs, ys = zip(*placed, strict=True)
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
