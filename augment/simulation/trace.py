"""A drive for people: its events, and the whole of it as a compact JSON document.

Metres to the centimetre, radians to the milliradian. Poses are those of box centres.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from augment.scene.entities import AreaKind
from augment.simulation.drive import Drive
from augment.simulation.metrics import OFF_ROAD_M
from augment.simulation.score import Score
from augment.simulation.states import ACCELERATION, SPEED, STEP_S, BoolArray, FloatArray, Kind
from augment.simulation.traffic import DriveSetting

HARD_BRAKING_MPS2 = -3.0


class EventKind(StrEnum):
    """What it was."""

    COLLISION = "collision"
    TOUCHED = "touched"
    OFF_ROAD = "off_road"
    HARD_BRAKING = "hard_braking"
    EMERGENCY_BRAKE = "emergency_brake"
    MAP_END = "map_end"


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveEvent:
    """One of them; `touched` is a collision that is not the ego's fault.

    Attributes:
        moment: When it began.
        object_id: With whom; empty where nobody else has part in it.
    """

    moment: int
    kind: EventKind
    object_id: str = ""


def events_of(drive: Drive, score: Score) -> tuple[DriveEvent, ...]:
    """All events in the order of time."""
    events = [
        DriveEvent(
            moment=collision.moment,
            kind=EventKind.COLLISION if collision.at_fault else EventKind.TOUCHED,
            object_id=collision.object_id,
        )
        for collision in score.collisions
    ]
    outside = _series(score, "drivable_area_compliance", "outside_m") >= OFF_ROAD_M
    events += [DriveEvent(moment=n, kind=EventKind.OFF_ROAD) for n in _starts(outside)]
    braking = np.array([plan.braking for plan in drive.plans], dtype=np.bool_)
    events += [DriveEvent(moment=n, kind=EventKind.EMERGENCY_BRAKE) for n in _starts(braking)]
    hard = drive.states[:, ACCELERATION] <= HARD_BRAKING_MPS2
    events += [DriveEvent(moment=n, kind=EventKind.HARD_BRAKING) for n in _starts(hard)]
    if drive.at_map_end:
        events.append(DriveEvent(moment=len(drive.states) - 1, kind=EventKind.MAP_END))
    return tuple(sorted(events, key=lambda event: (event.moment, event.kind)))


def _starts(holds: BoolArray) -> list[int]:
    """Where it begins to hold."""
    before = np.concatenate([[False], holds[:-1]])
    return [int(moment) for moment in np.flatnonzero(holds & ~before)]


def _series(score: Score, metric: str, name: str) -> FloatArray:
    return next(part.series[name] for part in score.metrics if part.name == metric)


FORMAT, VERSION = "scenario-arena/drive", 1
PLAN_EVERY = 5
"""So many steps lie between two plans that are kept."""
LINE_EVERY = 8
_AROUND_M = 90.0


def trace_of(setting: DriveSetting, drive: Drive, score: Score) -> dict[str, Any]:
    """The document."""
    changed = {agent.id for agent in setting.modification.changed}
    return {
        "format": FORMAT,
        "version": VERSION,
        "step_s": STEP_S,
        "steps": len(drive.states),
        "ego": {
            "length_m": round(drive.body.length_m, 3),
            "width_m": round(drive.body.width_m, 3),
            "poses": _poses(drive.boxes, drive.states[:, SPEED]),
        },
        "objects": _objects(setting, drive, changed),
        "plans": _plans(drive),
        "braking": [number for number, plan in enumerate(drive.plans) if plan.braking],
        "events": [
            {"step": event.moment, "kind": event.kind.value, "object": event.object_id}
            for event in events_of(drive, score)
        ],
        "road": _road(drive),
    }


def blind_trace(trace: dict[str, Any]) -> dict[str, Any]:
    """A trace for experts who must not learn who changed the scene: who moved how, and the road.

    Ids and their order go, since every contestant names and sorts in its own way; what the
    planner thought and scored goes, since it is no part of the picture.
    """
    objects = [
        {name: value for name, value in shown.items() if name != "id"}
        for shown in trace["objects"]
    ]
    return {
        **{name: trace[name] for name in ("format", "version", "step_s", "steps", "ego", "road")},
        "objects": sorted(objects, key=lambda shown: json.dumps(shown, sort_keys=True)),
    }


# Private


def _poses(boxes: FloatArray, speeds: FloatArray) -> list[list[float]]:
    return [
        [round(float(x), 2), round(float(y), 2), round(float(h), 3), round(float(v), 2)]
        for (x, y, h), v in zip(boxes[:, :3], speeds, strict=True)
    ]


def _objects(setting: DriveSetting, drive: Drive, changed: set[str]) -> list[dict[str, Any]]:
    """Each object with its poses from its first moment on; one pose alone where it stands."""
    types = {agent.id: agent.type.value for agent in setting.after.agents}
    if setting.recording is not None:
        types |= {track.agent_id: track.type.value for track in setting.recording.tracks}
    by_name: dict[str, dict[str, Any]] = {}
    for moment, objects in enumerate(drive.objects):
        rows = _poses(objects.boxes, objects.speeds_mps)
        for name, kind, box, pose in zip(
            objects.ids, objects.kinds, objects.boxes, rows, strict=True
        ):
            entry = by_name.setdefault(
                name,
                {
                    "id": name,
                    "type": types.get(name, Kind(int(kind)).name),
                    "length_m": round(float(box[3]), 3),
                    "width_m": round(float(box[4]), 3),
                    "changed": name in changed,
                    "first": moment,
                    "poses": [],
                },
            )
            gap = moment - entry["first"] - len(entry["poses"])
            entry["poses"] += [None] * gap + [pose]
    whole = len(drive.objects)
    for entry in by_name.values():
        still = all(pose == entry["poses"][0] for pose in entry["poses"])
        if still and entry["first"] == 0 and len(entry["poses"]) == whole:
            entry["poses"] = entry["poses"][:1]
    return list(by_name.values())


def _plans(drive: Drive) -> list[dict[str, Any]]:
    """What was considered, every half second: a line and a score for each proposal."""
    kept = []
    for step in range(0, len(drive.plans), PLAN_EVERY):
        shown = drive.plans[step].proposals
        if shown is None:
            continue
        lines = drive.body.centre(shown.states)[:, ::LINE_EVERY].round(1)
        kept.append(
            {
                "step": step,
                "chosen": shown.chosen,
                "scores": [round(float(score), 3) for score in shown.scores],
                "lines": [line.ravel().tolist() for line in lines],
            }
        )
    return kept


def _road(drive: Drive) -> dict[str, Any]:
    """The ground near the drive, as rings and lines of x, y, x, y, ..."""
    import shapely

    low = drive.boxes[:, :2].min(axis=0) - _AROUND_M
    high = drive.boxes[:, :2].max(axis=0) + _AROUND_M
    window = shapely.box(*low, *high)
    road = drive.road
    near = [n for n, strip in enumerate(road.strips) if strip.intersects(window)]
    kinds = (AreaKind.WALKWAY, AreaKind.CROSSWALK)
    areas = [area for area in road.scene.areas if area.kind in kinds]
    return {
        "drivable": _rings(shapely.intersection(road.drivable.ground, window).simplify(0.05)),
        "walkways": [_flat(area.boundary_m) for area in areas if area.kind is kinds[0]],
        "crosswalks": [_flat(area.boundary_m) for area in areas if area.kind is kinds[1]],
        "lanes": [
            {
                "line": _flat(road.ways[n].centerline.points_m),
                "edge": _flat(shapely.get_coordinates(road.strips[n].exterior)),
                "on_route": road.names[n] in road.route,
                "is_red": road.names[n] in road.red,
            }
            for n in near
        ],
        "end": _flat(road.centreline.poses(np.array([road.end_m]))[:, :2]),
    }


def _rings(ground: Any) -> list[list[list[float]]]:
    """Polygons as lists of rings, the outer one first."""
    import shapely

    polygons = []
    for part in shapely.get_parts(ground):
        if part.geom_type == "Polygon":
            rings = [part.exterior, *part.interiors]
            polygons.append([_flat(shapely.get_coordinates(ring)) for ring in rings])
    return polygons


def _flat(points_m: Any) -> list[float]:
    numbers: list[float] = np.asarray(points_m, dtype=np.float64).round(2).ravel().tolist()
    return numbers
