"""The catalogue as the pages show it."""

from __future__ import annotations

import math
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from django.db.models import Case, Count, IntegerField, QuerySet, Value, When

from augment.models import Augmentation, BaseScene, Contestant, Scenario, SceneUpload
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
    """The scenarios that forms offer, in the order of the types; types without any are left out.

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


@dataclass(frozen=True, slots=True, kw_only=True)
class SetChoice:
    """A part of the scenarios that a page can show alone."""

    name: str
    number: int
    is_chosen: bool


def set_choices(chosen: str) -> list[SetChoice]:
    """All scenarios first (named by the empty text), then the sets that there are."""
    counted = Scenario.objects.filter(paraphrase_of=None, retired_at=None).values_list(
        "catalogue_set"
    )
    numbers = dict(counted.annotate(number=Count("pk")).order_by())
    found = [(name, numbers.get(name, 0)) for name in Scenario.SETS]
    found.append((OWN, numbers.get("", 0)))
    present = [("", sum(numbers.values())), *(one for one in found if one[1])]
    return [
        SetChoice(name=name, number=number, is_chosen=name == chosen) for name, number in present
    ]


def set_asked(name: str | None) -> str:
    """What an address asks for; all where it names no set."""
    return name if name in {*Scenario.SETS, OWN} and name is not None else ""


def reference_pictures(scenarios: Sequence[Scenario]) -> dict[int, uuid.UUID]:
    """By scenario, the youngest augmentation that draws its reference."""
    rows = Augmentation.objects.filter(
        scenario__in=scenarios,
        contestant__kind=Contestant.Kind.REFERENCE,
        state=Augmentation.State.DONE,
    )
    return dict(rows.order_by("created_at", "pk").values_list("scenario_id", "code"))


def augmentations_of(scenario: Scenario) -> list[Augmentation]:
    """Every augmentation of a scenario with a picture, the youngest job first."""
    rows = scenario.augmentations.filter(state__in=Augmentation.SHOWABLE).exclude(image="")
    return list(
        rows.select_related("contestant", "job")
        .defer("modification")
        .order_by("-job__created_at", "contestant__name")
    )


def scene_rows() -> QuerySet[BaseScene]:
    """All scenes without what is heavy, with `number`, that of their scenarios."""
    rows = BaseScene.objects.defer("document", "recording", "notes")
    return rows.annotate(number=Count("scenarios")).order_by("-created_at", "slug")


def upload_rows(most: int = 20) -> list[SceneUpload]:
    """The uploads of late."""
    return list(SceneUpload.objects.defer("tracks").select_related("uploaded_by")[:most])


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneCounts:
    """What a scene holds."""

    agents: int
    lanes: int
    connectors: int
    areas: int
    recorded_s: float


def counts_of(scene: BaseScene) -> SceneCounts:
    """How much of everything is in a stored scene and its recording."""
    document, recording = scene.document, scene.recording
    return SceneCounts(
        agents=len(document.get("agents", ())),
        lanes=len(document.get("lanes", ())),
        connectors=len(document.get("connectors", ())),
        areas=len(document.get("areas", ())),
        recorded_s=recording["times_s"][-1] if recording else 0.0,
    )


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


@dataclass(frozen=True, slots=True, kw_only=True)
class ModificationLine:
    """One agent that is added, moved or removed; numbers are None for a removed one.

    Frame: ego frame, x forward and y left in metres.
    """

    change: str
    agent: str
    kind: str = ""
    x_m: float | None = None
    y_m: float | None = None
    heading_deg: float | None = None
    length_m: float | None = None
    width_m: float | None = None
    speed_mps: float | None = None
    lane: str = ""


def modification_lines(document: dict[str, Any] | None) -> list[ModificationLine]:
    """The lines of a document in the format of scenario-arena/modification; none without one."""
    if document is None:
        return []
    changed = [("added", agent) for agent in document.get("add", ())]
    changed += [("moved", agent) for agent in document.get("move", ())]
    lines = [_line(change, agent) for change, agent in changed]
    return lines + [
        ModificationLine(change="removed", agent=name) for name in document.get("remove", ())
    ]


def _line(change: str, agent: dict[str, Any]) -> ModificationLine:
    return ModificationLine(
        change=change,
        agent=agent["id"],
        kind=agent["type"].replace("_", " ").lower(),
        x_m=agent["x_m"],
        y_m=agent["y_m"],
        heading_deg=math.degrees(agent["heading_rad"]),
        length_m=agent["length_m"],
        width_m=agent["width_m"],
        speed_mps=agent.get("speed_mps"),
        lane=agent.get("lane_id", ""),
    )
