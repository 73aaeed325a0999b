"""interPlan's file plus scenes in the same frame as reference modifications.

Frames: from the file's global frame, the one of each scene's origin, to the scene's ego frame.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from augment.checks.ground import Ground
from augment.errors import InvalidDocument
from augment.formats.interplan import STANDING_WALK_M, WALK_S, ReadEntry
from augment.geometry.angles import wrap
from augment.geometry.frames import Pose
from augment.scene.catalogue import ScenarioType
from augment.scene.entities import AgentType, Scene, TrafficAgent
from augment.scene.modification import Modification
from augment.scene.sizes import LENGTH_WIDTH_M

WHAT = "interPlan file"

Number = Annotated[float, Field(allow_inf_nan=False)]


class _Entry(BaseModel):
    """One special scenario; keys that say nothing about objects are allowed and left out."""

    model_config = ConfigDict(extra="allow")

    type: Annotated[ScenarioType, Strict(False)]
    config: str | None = None
    stopped_vehicle: list[tuple[Number, Number, Number]] = []
    stopped_bus: list[tuple[Number, Number, Number]] = []
    cones: list[tuple[Number, Number]] = []
    pedestrian: list[tuple[Number, Number, Number, Number, int | None]] = []


class _Details(BaseModel):
    model_config = ConfigDict(extra="allow")

    special_scenario: dict[str | int, _Entry] = {}


class _File(BaseModel):
    model_config = ConfigDict(extra="allow")

    modification_details_dictionary: dict[str, _Details]


def read(text: str, scenes: Mapping[str, Scene]) -> tuple[ReadEntry, ...]:
    """Every special scenario of the tokens that have a scene; other tokens are passed over.

    Objects come in the file's order of keys: vehicles, buses, cones, pedestrians. Boxes get our
    own usual sizes, cones the direction of the ego's way.

    Args:
        text: The YAML.
        scenes: By base token, without the traffic that interPlan removes.

    Raises:
        InvalidDocument: It is no YAML, or its keys don't hold what interPlan's do.
    """
    try:
        given = _File.model_validate(yaml.safe_load(text))
    except yaml.YAMLError as fault:
        raise InvalidDocument(WHAT, [("", f"is no YAML: {fault}")]) from None
    except ValidationError as fault:
        problems = [
            (".".join(str(part) for part in error["loc"]), error["msg"])
            for error in fault.errors()
        ]
        raise InvalidDocument(WHAT, problems) from None
    return tuple(
        _read_entry(f"{token}-s{index}", entry, scenes[token])
        for token, one in given.modification_details_dictionary.items()
        if token in scenes
        for index, entry in one.special_scenario.items()
    )


def _read_entry(name: str, entry: _Entry, scene: Scene) -> ReadEntry:
    placer = _Placer(scene)
    for kind, rows in (
        (AgentType.VEHICLE, entry.stopped_vehicle),
        (AgentType.BUS, entry.stopped_bus),
    ):
        for row in rows:
            placer.add(kind, *row)
    for x_m, y_m in entry.cones:
        placer.add_cone(x_m, y_m)
    left_out = [f"config {entry.config}"] if entry.config else []
    for number, (x_m, y_m, end_x_m, end_y_m, iteration) in enumerate(entry.pedestrian):
        placer.add_walker((x_m, y_m), (end_x_m, end_y_m))
        if iteration is not None:
            left_out.append(f"pedestrian {number} starts at iteration {iteration}")
    left_out += [f"key {key}" for key in entry.model_extra or {}]
    return ReadEntry(
        id=name,
        scene=scene.name,
        type=entry.type,
        modification=Modification(added=tuple(placer.added)),
        left_out=tuple(left_out),
    )


class _Placer:
    """Puts what the file names into one scene's ego frame."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._ground = Ground.of(scene)
        self._next = len(scene.everyone) + 1
        self.added: list[TrafficAgent] = []

    def add(self, kind: AgentType, x_m: float, y_m: float, yaw_rad: float) -> None:
        """Something that stands, by its pose in the global frame."""
        pose = Pose(x_m=x_m, y_m=y_m, heading_rad=yaw_rad)
        self._put(kind, self._scene.origin.pose.pose_to_local(pose))

    def add_cone(self, x_m: float, y_m: float) -> None:
        """A cone, which has no direction in the file."""
        x_m, y_m = self._local(x_m, y_m)
        route = self._ground.route
        heading_rad = 0.0
        if route is not None:
            heading_rad = route[0].heading_at(route[0].project(x_m, y_m).s_m)
        self._put(AgentType.TRAFFIC_CONE, Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad))

    def add_walker(self, start_m: tuple[float, float], end_m: tuple[float, float]) -> None:
        """A pedestrian who walks, or stands where the walk is a worker's step."""
        (x_m, y_m), (end_x_m, end_y_m) = self._local(*start_m), self._local(*end_m)
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

    def _local(self, x_m: float, y_m: float) -> tuple[float, float]:
        x_m, y_m = self._scene.origin.pose.to_local(np.array([[x_m, y_m]]))[0]
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
