"""Modifications of any contestant as interPlan's file, with a report of what is lost.

Frames: from each scene's ego frame to the frame of its origin.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
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
    read_entry,
    token_of,
    yaml_text,
)
from augment.formats.writing import Cell, Loss, LossReport, Written
from augment.geometry.frames import difference, wrap
from augment.scene.entities import (
    LENGTH_WIDTH_M,
    AgentType,
    Point,
    ScenarioType,
    TrafficAgent,
    without_traffic,
)

BUS_LENGTH_M = 7.0
"""A vehicle from here on is written as a bus: clearly longer than any car."""
WORKER_STEP_M = 1.0
SHORTEST_WALK_M, LONGEST_WALK_M = 7.0, 29.0
"""Walks of people placed by hand for interPlan are 7.0 to 28.8 m long."""
_STEP_M = 0.5
_SAME_SIZE_M, _SAME_PACE_MPS, _SAME_WAY_RAD, _NO_WALK_M = 0.01, 0.02, 0.001, 0.01
_MADE_UP = (
    "These base tokens are made from the scenes' names and are none of nuPlan's; places are in "
    "the frame of each scene's origin:"
)


def write(cells: Sequence[Cell]) -> Written:
    """One YAML file for all of them."""
    text, losses = interplan_text(cells)
    return Written(files={"interplan.yaml": text.encode()}, losses=losses)


def interplan_text(cells: Iterable[Cell]) -> tuple[str, tuple[Loss, ...]]:
    """Return the file's text and what it could not say.

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
            entries.append(_Entry(cell, cell.type))
    made_up = {one.token for one in entries if one.cell.source is None}
    comments = [f"{_MADE_UP} {', '.join(sorted(made_up))}"] if made_up else []
    by_token: dict[str, dict[str, dict[str, Any]]] = defaultdict(dict)
    for entry, index in zip(entries, _numbered(entries), strict=True):
        by_token[entry.token][index] = entry.written()
        losses += entry.report.losses
        comments.append(f"{entry.token}-s{index} {entry.cell.scene.name}: {entry.cell.name}")
        comments += [f"  lost: {loss.text}" for loss in entry.report.losses]
    given = {one.token: one.source for one in reversed(entries) if one.source.index is not None}
    documents = {
        token: (special, given[token].details if token in given else {})
        for token, special in by_token.items()
    }
    file = next((source.file for source in given.values() if source.file), None)
    return yaml_text(documents, comments, file), tuple(losses)


def _numbered(entries: Sequence[_Entry]) -> list[str]:
    """The index of each special scenario.

    Its own for who is as in the file, then for who comes first, else the next that nobody has.
    """
    numbers: list[str | None] = [None] * len(entries)
    taken = defaultdict[str, set[str]](set)
    for place in sorted(range(len(entries)), key=lambda place: not entries[place].is_unchanged):
        token, own = entries[place].token, entries[place].source.index
        if own is not None and own not in taken[token]:
            numbers[place] = own
            taken[token].add(own)
    made = []
    for entry, number in zip(entries, numbers, strict=True):
        used = taken[entry.token]
        free = (str(one) for one in range(MOST_ENTRIES) if str(one) not in used)
        index = number or next(free, None)
        if index is None:
            raise Conflict(
                f"interPlan numbers at most {MOST_ENTRIES} special scenarios for a scene, and "
                f"{entry.cell.scene.name} has more; write fewer contestants at a time."
            )
        used.add(index)
        made.append(index)
    return made


class _Entry:
    """One special scenario while it is written."""

    def __init__(self, cell: Cell, kind: ScenarioType) -> None:
        self.cell, self.kind = cell, kind
        self.source = cell.source or InterplanSource(token=token_of(cell.scene.name))
        self.token = self.source.token
        self.report = LossReport(cell)

    @cached_property
    def is_unchanged(self) -> bool:
        """Whether the change is the one that stands in interPlan's file."""
        if self.source.index is None:
            return False
        stored = SpecialScenario.model_validate(self.source.entry)
        scene = without_traffic(self.cell.scene)
        read = read_entry(self.token, self.source.index, stored, scene)
        return read.modification == self.cell.modification

    def written(self) -> dict[str, Any]:
        """InterPlan's keys, those without objects left out."""
        given = dict(self.source.entry)
        config = config_of(self.cell.scene.options, given.pop("config", None) or "")
        head = {"type": self.kind.value} | ({"config": config} if config else {})
        if self.is_unchanged:
            return head | {key: value for key, value in given.items() if key != "type"}
        lists: dict[str, list[list[float | None]]] = defaultdict(list)
        for agent in self.cell.modification.added:
            for key, row in self._row(agent):
                lists[key].append(row)
        if self.cell.keeps_traffic:
            # Also with interPlan's "a1": without density traffic it deletes all vehicles twice.
            self._lose(
                f"the recorded traffic, which this scenario keeps ({len(self.cell.scene.agents)} "
                "agents), is gone: interPlan removes all of it from every special scenario"
            )
        for agent in self.cell.modification.moved:
            self._lose(f"{agent.id} is moved; interPlan can only add")
        for name in self.cell.modification.removed:
            self._lose(f"{name} is removed; interPlan removes all recorded traffic")
        rest = {key: value for key, value in given.items() if key not in ("type", *OBJECTS)}
        return {**head, **lists, **rest}

    def _lose(self, text: str, *, changes_scene: bool = True) -> None:
        self.report.lose(text, changes_scene=changes_scene)

    def _row(self, agent: TrafficAgent) -> Iterator[tuple[str, list[float | None]]]:
        x_m, y_m = self._global((agent.x_m, agent.y_m))
        if agent.type in (AgentType.VEHICLE, AgentType.BUS):
            yaw_rad = wrap(agent.heading_rad + self.cell.scene.origin.pose.heading_rad)
            yield self._vehicle_key(agent), [x_m, y_m, round(yaw_rad, 6)]
        elif agent.type is AgentType.TRAFFIC_CONE:
            self._report_size(agent, AgentType.TRAFFIC_CONE)
            there_rad = cone_heading(Ground.of(self.cell.scene), agent.x_m, agent.y_m)
            self._report_turn(
                agent,
                there_rad,
                "stands {} degrees askew to the ego's way; there a cone has no direction",
            )
            yield "cones", [x_m, y_m]
        elif agent.type is AgentType.PEDESTRIAN:
            self._report_size(agent, AgentType.PEDESTRIAN)
            yield "pedestrian", [x_m, y_m, *self._global(self._walk_end(agent)), None]
        else:
            self._lose(f"{agent.id} is left out: there is no key for {agent.type}")

    def _vehicle_key(self, agent: TrafficAgent) -> str:
        if agent.speed_mps > 0.0:
            self._lose(f"{agent.id} moves at {agent.speed_mps:g} m/s; there it stands")
        is_long = agent.length_m >= BUS_LENGTH_M
        if agent.type is AgentType.VEHICLE and is_long:
            self._lose(f"{agent.id} is {agent.length_m:g} m long and becomes a bus")
        if agent.type is AgentType.BUS or is_long:
            self._report_size(agent, AgentType.BUS)
            return "stopped_bus"
        self._lose(
            f"{agent.id}: its box of {agent.length_m:g} x {agent.width_m:g} m is not kept; it "
            "gets that of a removed vehicle, or the ego's",
            changes_scene=False,
        )
        return "stopped_vehicle"

    def _report_size(self, agent: TrafficAgent, becomes: AgentType) -> None:
        length_m, width_m = LENGTH_WIDTH_M[becomes]
        if max(abs(agent.length_m - length_m), abs(agent.width_m - width_m)) > _SAME_SIZE_M:
            self._lose(
                f"{agent.id}: its box of {agent.length_m:g} x {agent.width_m:g} m becomes "
                f"{length_m:g} x {width_m:g} m",
                changes_scene=False,
            )

    def _report_turn(self, agent: TrafficAgent, there_rad: float, text: str) -> None:
        turned_rad = abs(difference(agent.heading_rad, there_rad))
        if turned_rad > _SAME_WAY_RAD:
            degrees = f"{math.degrees(turned_rad):.3g}"
            self._lose(f"{agent.id} {text.format(degrees)}", changes_scene=False)

    def _walk_end(self, agent: TrafficAgent) -> Point:
        if agent.walk_to_m is None:
            length_m = WORKER_STEP_M
            if self.kind is not ScenarioType.CONSTRUCTION_ZONE:
                length_m = self._road_ahead_m(agent)
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
        self._report_turn(
            agent,
            math.atan2(north_m, east_m),
            "looks {} degrees away from its walk; there it looks along it",
        )
        there_mps = walk_m / WALK_S
        if walk_m <= STANDING_WALK_M:
            self._lose(f"{agent.id} walks {walk_m:.1f} m; read again, it is a worker who stands")
        elif abs(agent.speed_mps - there_mps) > _SAME_PACE_MPS:
            self._lose(
                f"{agent.id} walks {walk_m:.1f} m at {agent.speed_mps:g} m/s; there it takes "
                f"{WALK_S:g} s, {there_mps:.2f} m/s",
                changes_scene=False,
            )
        return agent.walk_to_m

    def _road_ahead_m(self, agent: TrafficAgent) -> float:
        """How far along its heading a pedestrian reaches the far edge of the road."""
        road = Ground.of(self.cell.scene).road
        steps_m = np.arange(_STEP_M, LONGEST_WALK_M + _STEP_M / 2.0, _STEP_M).tolist()
        on_road_m = [m for m in steps_m if road.distance_m(*_ahead(agent, m)) == 0.0]
        last_m = max(on_road_m, default=0.0)
        return min(max(last_m + _STEP_M, SHORTEST_WALK_M), LONGEST_WALK_M)

    def _global(self, point: Point) -> tuple[float, float]:
        x_m, y_m = self.cell.scene.origin.pose.to_parent(np.array([point]))[0]
        return round(float(x_m), 4), round(float(y_m), 4)


def _ahead(agent: TrafficAgent, distance_m: float) -> Point:
    return (
        agent.x_m + distance_m * math.cos(agent.heading_rad),
        agent.y_m + distance_m * math.sin(agent.heading_rad),
    )
