"""Scenarios, scenes and recordings as pages show them."""

import math
import uuid
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from django.db.models import QuerySet

from augment.models import Augmentation, Contestant, Scenario, UploadMoment
from augment.services.scenarios.scenes import type_choices


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeGroup:
    """All scenarios of one type."""

    type: str
    label: str
    scenarios: list[Scenario]


OWN = "own"
"""The scenarios that are in no set of the catalogue."""


def scenarios_of(chosen: str = "", *, is_retired: bool = False) -> QuerySet[Scenario]:
    """Return scenarios by type and slug, without the documents of their scenes.

    Args:
        chosen: A set of the catalogue, `own` for those in none; empty for all.
        is_retired: Those that forms offer no more, instead of the others.
    """
    rows = Scenario.objects.filter(retired_at__isnull=not is_retired).select_related("base_scene")
    if chosen:
        rows = rows.filter(catalogue_set="" if chosen == OWN else chosen)
    lean = rows.defer("reference", "base_scene__document", "base_scene__recording")
    return lean.order_by("type", "slug")


def by_type(chosen: str = "") -> list[TypeGroup]:
    """Return what forms offer of a set, in the order of the types."""
    return group_by_type(list(scenarios_of(chosen)))


def group_by_type(rows: list[Scenario]) -> list[TypeGroup]:
    """Return rows in groups, in the order of the types."""
    groups = [
        TypeGroup(type=name, label=label, scenarios=[row for row in rows if row.type == name])
        for name, label in type_choices()
    ]
    return [group for group in groups if group.scenarios]


def set_choices(chosen: str) -> list[dict[str, Any]]:
    """Return all scenarios first (named by the empty text), then the sets that there are."""
    rows = scenarios_of().filter(paraphrase_of=None).order_by()
    numbers = Counter(name or OWN for name in rows.values_list("catalogue_set", flat=True))
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
    parts = document or {}
    changed = [("added", agent) for agent in parts.get("add", ())]
    changed += [("moved", agent) for agent in parts.get("move", ())]
    lines = [
        agent
        | {
            "change": change,
            "agent": agent["id"],
            "kind": agent["type"].replace("_", " ").lower(),
            "heading_deg": math.degrees(agent["heading_rad"]),
        }
        for change, agent in changed
    ]
    removed = parts.get("remove", ())
    return lines + [{"change": "removed", "agent": name, "x_m": None} for name in removed]


# --- Maps of uploaded recordings ---------------------------------------------------------------

_AROUND_M = 35.0
_LEAST_M = 90.0


def place_of(maps: list[dict[str, Any]], moment: UploadMoment) -> list[dict[str, Any]]:
    """Return the part and the stop that a moment is; empty for one that is not among them."""
    places = ([track, stop] for track in maps for stop in track["stops"])
    wanted = (moment.item, moment.frame)
    return next((one for one in places if (one[1]["item"], one[1]["frame"]) == wanted), [])


def track_map(number: int, track: dict[str, Any]) -> dict[str, Any]:
    """Return a part of a recording: its moments, and the road under them as an SVG drawing.

    `roads` and `way` are points of polylines, `box` is a viewBox (metres, y down), `dot` half the
    width of a dot; `x` and `y` of a stop are None off the map.
    """
    places = [stop["place_m"] for stop in track["stops"]]
    points = [(None, None) if place is None else (place[0], -place[1]) for place in places]
    stops = [
        stop | {"number": index, "x": x, "y": y}
        for index, (stop, (x, y)) in enumerate(zip(track["stops"], points, strict=True))
    ]
    placed = [point for point in points if point[0] is not None] or [(0.0, 0.0)]
    xs, ys = zip(*placed, strict=True)
    width = max(max(xs) - min(xs) + 2 * _AROUND_M, _LEAST_M)
    height = max(max(ys) - min(ys) + 2 * _AROUND_M, width / 3.0)
    left, top = (max(xs) + min(xs) - width) / 2.0, (max(ys) + min(ys) - height) / 2.0
    return {
        "number": number,
        "name": track["name"],
        "stops": stops,
        "roads": [" ".join(f"{x},{-y}" for x, y in line) for line in track["roads_m"]],
        "way": " ".join(f"{x},{y}" for x, y in points if x is not None),
        "box": f"{left:.1f} {top:.1f} {width:.1f} {height:.1f}",
        "dot": round(width / 110.0, 2),
    }
