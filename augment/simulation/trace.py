"""A drive for people as a compact JSON document, its events among it.

Metres to the centimetre, radians to the milliradian. Poses are those of box centres.
"""

import json
from typing import Any

import numpy as np
import shapely

from augment.scene.entities import AreaKind
from augment.simulation.drive import Drive
from augment.simulation.score import OFF_ROAD_M, Score, outside_m
from augment.simulation.states import ACCELERATION, SPEED, STEP_S, FloatArray, Kind
from augment.simulation.traffic import VERSION, DriveSetting

FORMAT = "scenario-arena/drive"
HARD_BRAKING_MPS2 = -3.0
PLAN_EVERY = 5
"""So many steps lie between two plans that are kept."""
# Every so many states of a proposal are the points of its line.
LINE_EVERY = 8
_AROUND_M = 90.0


def make_trace(setting: DriveSetting, drive: Drive, score: Score) -> dict[str, Any]:
    """Return the document of a drive."""
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
        "objects": _objects(setting, drive),
        "plans": _plans(drive),
        "braking": [number for number, plan in enumerate(drive.plans) if plan.braking],
        "events": list_drive_events(drive, score),
        "road": _road(drive),
    }


def list_drive_events(drive: Drive, score: Score) -> list[dict[str, Any]]:
    """Return all events in the order of time: when each began, what it was, and with whom.

    Somebody is `touched` in a collision that is not the ego's fault.
    """
    events = [
        (met.moment, "collision" if met.at_fault else "touched", met.object_id)
        for met in score.collisions
    ]
    states = {
        "off_road": outside_m(drive) >= OFF_ROAD_M,
        "emergency_brake": np.array([plan.braking for plan in drive.plans], dtype=bool),
        "hard_braking": drive.states[:, ACCELERATION] <= HARD_BRAKING_MPS2,
    }
    for kind, holds in states.items():
        # True now and not the moment before.
        begins = holds & ~np.concatenate([[False], holds[:-1]])
        events += [(int(moment), kind, "") for moment in np.flatnonzero(begins)]
    if drive.at_map_end:
        events.append((len(drive.states) - 1, "map_end", ""))
    ordered = sorted(events, key=lambda event: event[:2])
    return [{"step": step, "kind": kind, "object": name} for step, kind, name in ordered]


def blind_trace(trace: dict[str, Any]) -> dict[str, Any]:
    """Return a trace for experts who must not learn who changed the scene.

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
    columns = [boxes[:, :2].round(2), boxes[:, 2].round(3), speeds.round(2)]
    poses: list[list[float]] = np.column_stack(columns).tolist()
    return poses


def _objects(setting: DriveSetting, drive: Drive) -> list[dict[str, Any]]:
    """Each object with its poses from its first moment on; one pose alone where it stands."""
    changed = {agent.id for agent in setting.modification.changed}
    types = {agent.id: agent.type.value for agent in setting.after.agents}
    if setting.recording is not None:
        types |= {track.agent_id: track.type.value for track in setting.recording.tracks}
    shown: dict[str, dict[str, Any]] = {}
    for moment, objects in enumerate(drive.objects):
        poses = _poses(objects.boxes, objects.speeds_mps)
        for row, name in enumerate(objects.ids):
            if name not in shown:
                length_m, width_m = objects.boxes[row, 3:].round(3).tolist()
                shown[name] = {
                    "id": name,
                    "type": types.get(name, Kind(objects.kinds[row]).name),
                    "length_m": length_m,
                    "width_m": width_m,
                    "changed": name in changed,
                    "first": moment,
                    "poses": [],
                }
            own = shown[name]["poses"]
            # None for the moments at which it was not there.
            own += [None] * (moment - shown[name]["first"] - len(own)) + [poses[row]]
    for entry in shown.values():
        poses = entry["poses"]
        if len(poses) == len(drive.objects) and all(pose == poses[0] for pose in poses):
            entry["poses"] = poses[:1]
    return list(shown.values())


def _plans(drive: Drive) -> list[dict[str, Any]]:
    """Return proposals every half second: a line and a score for each."""
    plans = []
    for step in range(0, len(drive.plans), PLAN_EVERY):
        shown = drive.plans[step].proposals
        if shown is not None:
            # (B, every eighth of T, 2): a point every 0.8 s.
            lines = drive.body.boxes(shown.states)[:, ::LINE_EVERY, :2].round(1)
            scores = [round(float(score), 3) for score in shown.scores]
            flat = [line.ravel().tolist() for line in lines]
            plans.append({"step": step, "chosen": shown.chosen, "scores": scores, "lines": flat})
    return plans


def _road(drive: Drive) -> dict[str, Any]:
    """The ground near the drive, as rings and lines of x, y, x, y, ..."""
    low = drive.boxes[:, :2].min(axis=0) - _AROUND_M
    high = drive.boxes[:, :2].max(axis=0) + _AROUND_M
    window = shapely.box(*low, *high)
    road = drive.road
    ground = shapely.intersection(road.drivable.ground, window).simplify(0.05)
    parts = [part for part in shapely.get_parts(ground) if part.geom_type == "Polygon"]
    areas = road.scene.areas
    return {
        "drivable": [
            [_flat(shapely.get_coordinates(ring)) for ring in (part.exterior, *part.interiors)]
            for part in parts
        ],
        "walkways": [_flat(area.boundary_m) for area in areas if area.kind is AreaKind.WALKWAY],
        "crosswalks": [
            _flat(area.boundary_m) for area in areas if area.kind is AreaKind.CROSSWALK
        ],
        "lanes": [
            {
                "line": _flat(way.centerline.points_m),
                "edge": _flat(shapely.get_coordinates(strip.exterior)),
                "on_route": way.id in road.route,
                "is_red": way.id in road.red,
            }
            for way, strip in zip(road.ways, road.strips, strict=True)
            if strip.intersects(window)
        ],
    }


def _flat(points_m: Any) -> list[float]:
    numbers: list[float] = np.asarray(points_m, dtype=np.float64).round(2).ravel().tolist()
    return numbers
