"""interPlan's file plus scenes in the same frame as reference modifications.

Frames: from the file's global frame, the one of each scene's origin, to the scene's ego frame.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from augment.checks.ground import Ground
from augment.errors import InvalidDocument
from augment.formats.documents import read_yaml
from augment.formats.interplan.file import (
    STANDING_WALK_M,
    WALK_S,
    WHAT,
    Details,
    ReadEntry,
    ReadFile,
    SpecialScenario,
    cone_heading,
    file_of,
    left_out_of_details,
    left_out_of_file,
    options_of,
    place_of,
)
from augment.geometry.frames import Pose, wrap
from augment.scene.density import ExtraAgent, spawn_traffic
from augment.scene.entities import (
    LENGTH_WIDTH_M,
    AgentType,
    Modification,
    Point,
    Scene,
    TrafficAgent,
)

Place = tuple[str, int]
"""A key of a special scenario and the number of a row under it."""

FURTHEST_FROM_EGO_M = 1_000.0
"""What lies further from its scene's ego is in another frame, or another scene is meant."""
_STANDS_M = 0.01


def read(text: str, scenes: Mapping[str, Scene]) -> ReadFile:
    """Every special scenario of the tokens that have a scene, and what else there is.

    Objects come in the file's order of keys: vehicles, buses, cones, pedestrians. Boxes get our
    own usual sizes, cones the direction of the ego's way.

    Args:
        text: The YAML.
        scenes: By base token, without the traffic that interPlan removes.

    Raises:
        InvalidDocument: It is no plain YAML, its keys don't hold what interPlan's do, there is
            no special scenario in it, or an object is nowhere near its scene.
    """
    return read_document(read_yaml(text, what=WHAT), scenes)


def read_document(document: object, scenes: Mapping[str, Scene]) -> ReadFile:
    """The same of what the YAML holds.

    Raises:
        InvalidDocument: As above.
    """
    file = file_of(document)
    by_token = file.modification_details_dictionary
    special = {token: one.special_scenario or {} for token, one in by_token.items()}
    if not any(special.values()):
        raise InvalidDocument(WHAT, [("", "holds no special scenario")])
    left_out = [
        *left_out_of_file(file),
        *(
            f"{token}: {part}"
            for token, one in by_token.items()
            if token in scenes
            for part in left_out_of_details(one)
        ),
    ]
    return ReadFile(
        entries=tuple(
            _with_config(read_entry(token, index, entry, scenes[token]), entry)
            for token, entries in special.items()
            if token in scenes
            for index, entry in entries.items()
        ),
        passed_over={
            token: len(entries) for token, entries in special.items() if token not in scenes
        },
        left_out=tuple(left_out),
    )


def _with_config(read: ReadEntry, entry: SpecialScenario) -> ReadEntry:
    """With the options that a scenario can have, and a modification alone can't say."""
    if not entry.config:
        return read
    return replace(read, left_out=(f"config {entry.config}", *read.left_out))


def read_entry(token: str, index: str | int, entry: SpecialScenario, scene: Scene) -> ReadEntry:
    """One special scenario of a base token.

    Raises:
        InvalidDocument: An object is nowhere near the scene.
    """
    placer = _Placer(scene, token, index)
    for kind, key, rows in (
        (AgentType.VEHICLE, "stopped_vehicle", entry.stopped_vehicle),
        (AgentType.BUS, "stopped_bus", entry.stopped_bus),
    ):
        for number, row in enumerate(rows):
            placer.add(kind, *row, place=(key, number))
    for number, cone in enumerate(entry.cones):
        placer.add_cone(*cone, place=("cones", number))
    left_out = []
    for number, (x_m, y_m, end_x_m, end_y_m, iteration) in enumerate(entry.pedestrian):
        place = ("pedestrian", number)
        walk_m = placer.add_walker((x_m, y_m), (end_x_m, end_y_m), place=place)
        if walk_m < _STANDS_M:
            left_out.append(f"pedestrian {number} walks 0 m, which gives it no direction")
        if iteration is not None:
            left_out.append(f"pedestrian {number} starts at iteration {iteration}")
    left_out += [f"key {key}" for key in entry.model_extra or {}]
    return ReadEntry(
        id=f"{token}-s{index}",
        scene=scene.name,
        type=entry.type,
        modification=Modification(added=tuple(placer.added)),
        left_out=tuple(left_out),
    )


def traffic_of(
    entry: SpecialScenario,
    details: Details,
    scene: Scene,
    *,
    seed: str,
    clear_of: Sequence[TrafficAgent] = (),
) -> tuple[TrafficAgent, ...]:
    """The traffic of a special scenario's density; none without one.

    Args:
        entry: Its roadblocks come before those of the token, an empty list too.
        details: Of its base token.
        scene: Cleared of the recorded traffic.
        seed: interPlan takes the base token.
        clear_of: Who is spawned keeps away from these.

    Raises:
        InvalidDocument: An extra agent has no place or speed.
    """
    density, _ = options_of(entry.config)
    roadblocks = entry.roadblock_locations_to_spawn_agents
    if roadblocks is None:
        roadblocks = details.roadblock_locations_to_spawn_agents or []
    return spawn_traffic(
        scene,
        density,
        seed=seed,
        roadblocks_m=[_to_local(scene, *place) for place in roadblocks],
        extras=[_extra(row, scene) for row in details.extra_agents_to_spawn or []],
        clear_of=clear_of,
    )


def goal_place(source: Mapping[str, Any] | None, goal: str, scene: Scene) -> Point | None:
    """Where a goal of interPlan's file lies in the scene's ego frame, None where it has no place.

    Args:
        source: A scenario's parts of the file, as they are stored; None for one of another kind.
        goal: left, right or straight.
        scene: Whose origin tells the frame.
    """
    places = ((source or {}).get("details") or {}).get("goal") or {}
    if not places.get(goal):
        return None
    x_m, y_m = (float(part) for part in places[goal].split(","))
    return _to_local(scene, x_m, y_m)


def _extra(row: Sequence[Any], scene: Scene) -> ExtraAgent:
    values = row[:3]
    if not all(isinstance(one, (int, float)) and math.isfinite(one) for one in values):
        problem = f"{list(values)!r} must be x, y and a speed in metres and metres per second"
        raise InvalidDocument(WHAT, [("extra_agents_to_spawn", problem)])
    x_m, y_m = _to_local(scene, values[0], values[1])
    return ExtraAgent(x_m=x_m, y_m=y_m, speed_mps=abs(float(values[2])))


def _to_local(scene: Scene, x_m: float, y_m: float) -> Point:
    x_m, y_m = scene.origin.pose.to_local(np.array([[x_m, y_m]]))[0]
    return float(x_m), float(y_m)


class _Placer:
    """Puts what the file names into one scene's ego frame."""

    def __init__(self, scene: Scene, token: str, index: str | int) -> None:
        self._scene = scene
        self._entry = (token, index)
        self._ground = Ground.of(scene)
        self._next = len(scene.everyone) + 1
        self.added: list[TrafficAgent] = []

    def add(
        self, kind: AgentType, x_m: float, y_m: float, yaw_rad: float, *, place: Place
    ) -> None:
        """Something that stands, by its pose in the global frame."""
        self._local(x_m, y_m, place)
        pose = Pose(x_m=x_m, y_m=y_m, heading_rad=wrap(yaw_rad))
        self._put(kind, self._scene.origin.pose.pose_to_local(pose))

    def add_cone(self, x_m: float, y_m: float, *, place: Place) -> None:
        """A cone, which has no direction in the file."""
        x_m, y_m = self._local(x_m, y_m, place)
        heading_rad = cone_heading(self._ground, x_m, y_m)
        self._put(AgentType.TRAFFIC_CONE, Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad))

    def add_walker(
        self, start_m: tuple[float, float], end_m: tuple[float, float], *, place: Place
    ) -> float:
        """A pedestrian who walks, or stands where the walk is a worker's step; its length."""
        x_m, y_m = self._local(*start_m, place)
        end_x_m, end_y_m = self._local(*end_m, place)
        walk_m = math.hypot(end_x_m - x_m, end_y_m - y_m)
        pose = Pose(x_m=x_m, y_m=y_m, heading_rad=wrap(math.atan2(end_y_m - y_m, end_x_m - x_m)))
        if walk_m <= STANDING_WALK_M:
            self._put(AgentType.PEDESTRIAN, pose)
        else:
            self._put(
                AgentType.PEDESTRIAN,
                pose,
                speed_mps=round(walk_m / WALK_S, 2),
                walk_to_m=(end_x_m, end_y_m),
            )
        return walk_m

    def _local(self, x_m: float, y_m: float, place: Place) -> tuple[float, float]:
        x_m, y_m = _to_local(self._scene, x_m, y_m)
        away_m = math.hypot(x_m, y_m)
        if away_m > FURTHEST_FROM_EGO_M:
            problem = (
                f"is {away_m:.0f} m from the ego of scene {self._scene.name}; more than "
                f"{FURTHEST_FROM_EGO_M:.0f} m means another scene or another frame"
            )
            raise InvalidDocument(WHAT, [(place_of(*self._entry, *place), problem)])
        return x_m, y_m

    def _put(self, kind: AgentType, pose: Pose, **more: Any) -> None:
        length_m, width_m = LENGTH_WIDTH_M[kind]
        agent = TrafficAgent(
            id=f"Agent{self._next + len(self.added)}",
            type=kind,
            x_m=pose.x_m,
            y_m=pose.y_m,
            heading_rad=pose.heading_rad,
            width_m=width_m,
            length_m=length_m,
            lane_id=self._ground.graph.under(pose.x_m, pose.y_m, pose.heading_rad),
            **{"speed_mps": 0.0, **more},
        )
        self.added.append(agent)
