"""Modifications of any contestant as interPlan's file, with a report of what is lost.

Frames: from each scene's ego frame to the frame of its origin.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from augment.checks.ground import Ground
from augment.errors import Conflict
from augment.formats.interplan import (
    MOST_ENTRIES,
    Cell,
    Loss,
    details,
    token_of,
    yaml_text,
)
from augment.geometry.angles import wrap
from augment.scene.catalogue import ScenarioType
from augment.scene.entities import AgentType, Point, Scene, TrafficAgent

BUS_LENGTH_M = 7.0
"""A vehicle from here on is written as a bus: clearly longer than any car."""
WORKER_STEP_M = 1.0
SHORTEST_WALK_M, LONGEST_WALK_M = 7.0, 29.0
"""Walks of people placed by hand for interPlan are 7.0 to 28.8 m long."""
METRE_DECIMALS, RADIAN_DECIMALS = 4, 6

_STEP_M = 0.5
_KEPT_TRAFFIC = "a1"
"""interPlan's suffix for keeping all recorded vehicles."""


def write(cells: Iterable[Cell]) -> tuple[str, tuple[Loss, ...]]:
    """The file's text and what it could not say.

    Scenes that nuPlan does not have get a token made from their name; special scenarios are
    numbered in the given order. The comments at the top say what is what.

    Args:
        cells: What to write, several for one scene under one token.

    Raises:
        Conflict: More than a hundred for one scene, which two digits can't number.
    """
    by_token: dict[str, dict[str, dict[str, Any]]] = defaultdict(dict)
    comments, losses = [], []
    for cell in cells:
        token = token_of(cell.scene.name)
        index = str(len(by_token[token]))
        if len(by_token[token]) >= MOST_ENTRIES:
            raise Conflict(
                f"interPlan numbers at most {MOST_ENTRIES} special scenarios for a scene, and "
                f"{cell.scene.name} has more; write fewer contestants at a time."
            )
        entry = _Entry(cell)
        by_token[token][index] = entry.written()
        losses += entry.losses
        comments.append(f"{token}-s{index} {cell.scene.name}: {cell.name}")
    documents = {token: details(entries) for token, entries in by_token.items()}
    return yaml_text(documents, comments), tuple(losses)


@dataclass(kw_only=False)
class _Entry:
    """One special scenario while it is written."""

    cell: Cell
    losses: list[Loss] = field(default_factory=list)

    def written(self) -> dict[str, Any]:
        """InterPlan's keys, those without objects left out."""
        lists: dict[str, list[list[float | None]]] = defaultdict(list)
        for agent in self.cell.modification.added:
            for key, row in self._row(agent):
                lists[key].append(row)
        self._report_changes()
        entry: dict[str, Any] = {"type": self.cell.type.value}
        if self.cell.keeps_traffic:
            entry["config"] = _KEPT_TRAFFIC
            self._lose("recorded pedestrians, bicycles and objects go, only vehicles stay")
        return {**entry, **lists}

    def _lose(self, text: str) -> None:
        self.losses.append(Loss(cell=self.cell.name, text=text))

    def _report_changes(self) -> None:
        for agent in self.cell.modification.moved:
            self._lose(f"{agent.id} is moved; interPlan can only add")
        for name in self.cell.modification.removed:
            self._lose(f"{name} is removed; interPlan removes all recorded vehicles or none")

    def _row(self, agent: TrafficAgent) -> Iterator[tuple[str, list[float | None]]]:
        x_m, y_m = self._global((agent.x_m, agent.y_m))
        if agent.type in (AgentType.VEHICLE, AgentType.BUS):
            if agent.speed_mps > 0.0:
                self._lose(f"{agent.id} moves at {agent.speed_mps:g} m/s; there it stands")
            yield self._vehicle_key(agent), [x_m, y_m, self._yaw(agent)]
        elif agent.type is AgentType.TRAFFIC_CONE:
            yield "cones", [x_m, y_m]
        elif agent.type is AgentType.PEDESTRIAN:
            yield "pedestrian", [x_m, y_m, *self._global(self._walk_end(agent)), None]
        else:
            self._lose(f"{agent.id} is left out: there is no key for {agent.type}")

    def _vehicle_key(self, agent: TrafficAgent) -> str:
        if agent.type is AgentType.BUS:
            return "stopped_bus"
        if agent.length_m >= BUS_LENGTH_M:
            self._lose(f"{agent.id} is {agent.length_m:g} m long and becomes a bus")
            return "stopped_bus"
        return "stopped_vehicle"

    def _walk_end(self, agent: TrafficAgent) -> Point:
        if agent.walk_to_m is not None:
            return agent.walk_to_m
        length_m = WORKER_STEP_M
        if self.cell.type is not ScenarioType.CONSTRUCTION_ZONE:
            length_m = _walk_m(self.cell.scene, agent)
            self._lose(f"{agent.id} has no end point; {length_m:g} m along its heading is taken")
        return (
            agent.x_m + length_m * math.cos(agent.heading_rad),
            agent.y_m + length_m * math.sin(agent.heading_rad),
        )

    def _global(self, point: Point) -> tuple[float, float]:
        x_m, y_m = self.cell.scene.origin.pose.to_parent(np.array([point]))[0]
        return round(float(x_m), METRE_DECIMALS), round(float(y_m), METRE_DECIMALS)

    def _yaw(self, agent: TrafficAgent) -> float:
        yaw_rad = wrap(agent.heading_rad + self.cell.scene.origin.pose.heading_rad)
        return round(yaw_rad, RADIAN_DECIMALS)


def _walk_m(scene: Scene, agent: TrafficAgent) -> float:
    """How far along its heading a pedestrian reaches the far edge of the road."""
    road = Ground.of(scene).road
    last_m = 0.0
    for step in range(1, round(LONGEST_WALK_M / _STEP_M) + 1):
        walked_m = step * _STEP_M
        x_m = agent.x_m + walked_m * math.cos(agent.heading_rad)
        y_m = agent.y_m + walked_m * math.sin(agent.heading_rad)
        if road.distance_m(x_m, y_m) == 0.0:
            last_m = walked_m
    return min(max(last_m + _STEP_M, SHORTEST_WALK_M), LONGEST_WALK_M)
