"""interPlan's file plus scenes in the same frame as reference modifications.

Frames: from the file's global frame, the one of each scene's origin, to the scene's ego frame.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from augment.checks.ground import Ground
from augment.errors import InvalidDocument
from augment.formats.interplan import STANDING_WALK_M, WALK_S, ReadEntry, ReadFile, cone_heading
from augment.formats.interplan_schema import (
    WHAT,
    SpecialScenario,
    file_of,
    left_out_of_details,
    left_out_of_file,
    place_of,
)
from augment.formats.yaml_file import read_yaml
from augment.geometry.angles import wrap
from augment.geometry.frames import Pose
from augment.scene.entities import AgentType, Scene, TrafficAgent
from augment.scene.modification import Modification
from augment.scene.sizes import LENGTH_WIDTH_M

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
            read_entry(token, index, entry, scenes[token])
            for token, entries in special.items()
            if token in scenes
            for index, entry in entries.items()
        ),
        passed_over={
            token: len(entries) for token, entries in special.items() if token not in scenes
        },
        left_out=tuple(left_out),
    )


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
    left_out = [f"config {entry.config}"] if entry.config else []
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
        x_m, y_m = self._scene.origin.pose.to_local(np.array([[x_m, y_m]]))[0]
        away_m = math.hypot(x_m, y_m)
        if away_m > FURTHEST_FROM_EGO_M:
            problem = (
                f"is {away_m:.0f} m from the ego of scene {self._scene.name}; more than "
                f"{FURTHEST_FROM_EGO_M:.0f} m means another scene or another frame"
            )
            raise InvalidDocument(WHAT, [(place_of(*self._entry, *place), problem)])
        return float(x_m), float(y_m)

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
