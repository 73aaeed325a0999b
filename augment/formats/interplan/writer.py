"""Modifications of any contestant as interPlan's file, with a report of what is lost.

Frames: from each scene's ego frame to the frame of its origin.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from augment.checks.ground import Ground
from augment.errors import Conflict
from augment.formats.interplan.file import (
    MOST_ENTRIES,
    OBJECTS,
    STANDING_WALK_M,
    WALK_S,
    InterplanSource,
    SpecialScenario,
    cone_heading,
    config_of,
    details,
    token_of,
    yaml_text,
)
from augment.formats.interplan.reader import read_entry
from augment.formats.writing import Cell, Loss, Written
from augment.geometry.frames import difference, wrap
from augment.scene.entities import (
    LENGTH_WIDTH_M,
    AgentType,
    Point,
    ScenarioType,
    Scene,
    TrafficAgent,
    without_traffic,
)

BUS_LENGTH_M = 7.0
"""A vehicle from here on is written as a bus: clearly longer than any car."""
WORKER_STEP_M = 1.0
SHORTEST_WALK_M, LONGEST_WALK_M = 7.0, 29.0
"""Walks of people placed by hand for interPlan are 7.0 to 28.8 m long."""
METRE_DECIMALS, RADIAN_DECIMALS = 4, 6

_STEP_M = 0.5
_SAME_SIZE_M = 0.01
_SAME_PACE_MPS = 0.02
_SAME_WAY_RAD = 0.001
_NO_WALK_M = 0.01
_MADE_UP = (
    "These base tokens are made from the scenes' names and are none of nuPlan's; places are in "
    "the frame of each scene's origin:"
)


def write(cells: Sequence[Cell]) -> Written:
    """One YAML file for all of them."""
    text, losses = interplan_text(cells)
    return Written(files={"interplan.yaml": text.encode()}, losses=losses)


def interplan_text(cells: Iterable[Cell]) -> tuple[str, tuple[Loss, ...]]:
    """The file's text and what it could not say.

    What came from interPlan's file keeps its base token and index, and is written as it stood
    there unless it was changed. Scenes that nuPlan does not have get a token made from their
    name; special scenarios without an index are numbered in the given order. The comments at the
    top say what is what.

    Args:
        cells: What to write, several for one scene under one token.

    Raises:
        Conflict: More than a hundred for one scene, which two digits can't number.
    """
    entries, losses = [], []
    for cell in cells:
        if cell.type is None:
            text = "interPlan has five types of scenarios, and this one is of another: left out"
            losses.append(Loss(cell=cell.name, text=text, changes_scene=True))
        else:
            entries.append(_Entry(cell))
    by_token: dict[str, dict[str, dict[str, Any]]] = defaultdict(dict)
    comments = []
    numbers = _numbered(entries)
    made_up = {one.token for one in entries if one.cell.source is None}
    if made_up:
        comments.append(f"{_MADE_UP} {', '.join(sorted(made_up))}")
    for entry in entries:
        index = numbers[id(entry)]
        by_token[entry.token][index] = entry.written()
        losses += entry.losses
        comments.append(f"{entry.token}-s{index} {entry.cell.scene.name}: {entry.cell.name}")
        comments += [f"  lost: {loss.text}" for loss in entry.losses]
    given = {one.token: one.source for one in reversed(entries) if one.source.index is not None}
    documents = {
        token: details(special, given[token].details if token in given else None)
        for token, special in by_token.items()
    }
    file = next((source.file for source in given.values() if source.file), None)
    return yaml_text(documents, comments, file), tuple(losses)


def _numbered(entries: Sequence[_Entry]) -> dict[int, str]:
    """The index of each special scenario by its id().

    Its own for who is as in the file, then for who comes first, else the next that nobody has.
    """
    numbers: dict[int, str] = {}
    taken = defaultdict[str, set[str]](set)
    for entry in sorted(entries, key=lambda one: not one.is_unchanged):
        own = entry.source.index
        if own is not None and own not in taken[entry.token]:
            numbers[id(entry)] = own
            taken[entry.token].add(own)
    for entry in entries:
        if id(entry) in numbers:
            continue
        used = taken[entry.token]
        free = (str(number) for number in range(MOST_ENTRIES) if str(number) not in used)
        index = next(free, None)
        if index is None:
            raise Conflict(
                f"interPlan numbers at most {MOST_ENTRIES} special scenarios for a scene, and "
                f"{entry.cell.scene.name} has more; write fewer contestants at a time."
            )
        numbers[id(entry)] = index
        used.add(index)
    return numbers


@dataclass(kw_only=False)
class _Entry:
    """One special scenario while it is written."""

    cell: Cell
    losses: list[Loss] = field(default_factory=list)

    @property
    def source(self) -> InterplanSource:
        """Where it comes from; a token made from the scene's name where nobody says."""
        return self.cell.source or InterplanSource(token=token_of(self.cell.scene.name))

    @property
    def token(self) -> str:
        """The base token."""
        return self.source.token

    @cached_property
    def is_unchanged(self) -> bool:
        """Whether the change is the one that stands in interPlan's file."""
        if self.source.index is None:
            return False
        read = read_entry(
            self.token,
            self.source.index,
            SpecialScenario.model_validate(self.source.entry),
            without_traffic(self.cell.scene),
        )
        return read.modification == self.cell.modification

    def written(self) -> dict[str, Any]:
        """InterPlan's keys, those without objects left out."""
        assert self.cell.type is not None
        given = dict(self.source.entry)
        config = config_of(self.cell.scene.options, given.pop("config", None) or "")
        head = {"type": self.cell.type.value} | ({"config": config} if config else {})
        if self.is_unchanged:
            return head | {key: value for key, value in given.items() if key != "type"}
        lists: dict[str, list[list[float | None]]] = defaultdict(list)
        for agent in self.cell.modification.added:
            for key, row in self._row(agent):
                lists[key].append(row)
        self._report_scene()
        rest = {key: value for key, value in given.items() if key not in ("type", *OBJECTS)}
        return {**head, **lists, **rest}

    def _lose(self, text: str, *, changes_scene: bool = True) -> None:
        self.losses.append(Loss(cell=self.cell.name, text=text, changes_scene=changes_scene))

    def _report_scene(self) -> None:
        """What becomes of the recorded traffic, and of changes to it."""
        kept = len(self.cell.scene.agents)
        if self.cell.keeps_traffic:
            # Also with interPlan's "a1": without density traffic it deletes all vehicles twice.
            self._lose(
                f"the recorded traffic, which this scenario keeps ({kept} agents), is gone: "
                "interPlan removes all of it from every special scenario"
            )
        for agent in self.cell.modification.moved:
            self._lose(f"{agent.id} is moved; interPlan can only add")
        for name in self.cell.modification.removed:
            self._lose(f"{name} is removed; interPlan removes all recorded traffic")

    def _row(self, agent: TrafficAgent) -> Iterator[tuple[str, list[float | None]]]:
        x_m, y_m = self._global((agent.x_m, agent.y_m))
        if agent.type in (AgentType.VEHICLE, AgentType.BUS):
            if agent.speed_mps > 0.0:
                self._lose(f"{agent.id} moves at {agent.speed_mps:g} m/s; there it stands")
            yield self._vehicle_key(agent), [x_m, y_m, self._yaw(agent)]
        elif agent.type is AgentType.TRAFFIC_CONE:
            self._report_size(agent, AgentType.TRAFFIC_CONE)
            self._report_cone(agent)
            yield "cones", [x_m, y_m]
        elif agent.type is AgentType.PEDESTRIAN:
            self._report_size(agent, AgentType.PEDESTRIAN)
            yield "pedestrian", [x_m, y_m, *self._global(self._walk_end(agent)), None]
        else:
            self._lose(f"{agent.id} is left out: there is no key for {agent.type}")

    def _vehicle_key(self, agent: TrafficAgent) -> str:
        is_long = agent.length_m >= BUS_LENGTH_M
        if agent.type is AgentType.VEHICLE and is_long:
            self._lose(f"{agent.id} is {agent.length_m:g} m long and becomes a bus")
        if agent.type is AgentType.BUS or is_long:
            self._report_size(agent, AgentType.BUS)
            return "stopped_bus"
        self._lose(
            f"{agent.id}: its box of {_box(agent)} m is not kept; it gets that of a removed "
            "vehicle, or the ego's",
            changes_scene=False,
        )
        return "stopped_vehicle"

    def _report_size(self, agent: TrafficAgent, becomes: AgentType) -> None:
        length_m, width_m = LENGTH_WIDTH_M[becomes]
        off_m = max(abs(agent.length_m - length_m), abs(agent.width_m - width_m))
        if off_m > _SAME_SIZE_M:
            self._lose(
                f"{agent.id}: its box of {_box(agent)} m becomes {length_m:g} x {width_m:g} m",
                changes_scene=False,
            )

    def _report_cone(self, agent: TrafficAgent) -> None:
        """A cone's direction is not in the file; readers give it that of the ego's way."""
        there_rad = cone_heading(Ground.of(self.cell.scene), agent.x_m, agent.y_m)
        turned_rad = abs(difference(agent.heading_rad, there_rad))
        if turned_rad > _SAME_WAY_RAD:
            self._lose(
                f"{agent.id} stands {math.degrees(turned_rad):.3g} degrees askew to the ego's "
                "way; there a cone has no direction",
                changes_scene=False,
            )

    def _walk_end(self, agent: TrafficAgent) -> Point:
        if agent.walk_to_m is None:
            length_m = WORKER_STEP_M
            if self.cell.type is not ScenarioType.CONSTRUCTION_ZONE:
                length_m = _walk_m(self.cell.scene, agent)
                self._lose(
                    f"{agent.id} has no end point; {length_m:g} m along its heading is taken"
                )
            elif agent.speed_mps > 0.0:
                self._lose(f"{agent.id} moves at {agent.speed_mps:g} m/s; there it stands")
            return _ahead(agent, length_m)
        east_m, north_m = agent.walk_to_m[0] - agent.x_m, agent.walk_to_m[1] - agent.y_m
        walk_m = math.hypot(east_m, north_m)
        if walk_m < _NO_WALK_M:
            self._lose(
                f"{agent.id} walks 0 m, which has no direction; a step of {WORKER_STEP_M:g} m "
                "along its heading is taken"
            )
            return _ahead(agent, WORKER_STEP_M)
        self._report_walk(agent, walk_m, math.atan2(north_m, east_m))
        return agent.walk_to_m

    def _report_walk(self, agent: TrafficAgent, walk_m: float, way_rad: float) -> None:
        turned_rad = abs(difference(agent.heading_rad, way_rad))
        if turned_rad > _SAME_WAY_RAD:
            self._lose(
                f"{agent.id} looks {math.degrees(turned_rad):.3g} degrees away from its walk; "
                "there it looks along it",
                changes_scene=False,
            )
        if walk_m <= STANDING_WALK_M:
            self._lose(f"{agent.id} walks {walk_m:.1f} m; read again, it is a worker who stands")
            return
        there_mps = walk_m / WALK_S
        if abs(agent.speed_mps - there_mps) > _SAME_PACE_MPS:
            self._lose(
                f"{agent.id} walks {walk_m:.1f} m at {agent.speed_mps:g} m/s; there it takes "
                f"{WALK_S:g} s, {there_mps:.2f} m/s",
                changes_scene=False,
            )

    def _global(self, point: Point) -> tuple[float, float]:
        x_m, y_m = self.cell.scene.origin.pose.to_parent(np.array([point]))[0]
        return round(float(x_m), METRE_DECIMALS), round(float(y_m), METRE_DECIMALS)

    def _yaw(self, agent: TrafficAgent) -> float:
        yaw_rad = wrap(agent.heading_rad + self.cell.scene.origin.pose.heading_rad)
        return round(yaw_rad, RADIAN_DECIMALS)


def _ahead(agent: TrafficAgent, distance_m: float) -> Point:
    return (
        agent.x_m + distance_m * math.cos(agent.heading_rad),
        agent.y_m + distance_m * math.sin(agent.heading_rad),
    )


def _box(agent: TrafficAgent) -> str:
    return f"{agent.length_m:g} x {agent.width_m:g}"


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
