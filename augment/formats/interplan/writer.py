"""Modifications of any contestant as interPlan's file, with a report of what is lost.

Frames: from each scene's ego frame to the frame of its origin.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from augment.errors import Conflict
from augment.formats.interplan import file as interplan
from augment.formats.interplan.file import InterplanSource
from augment.formats.interplan.runs import MODIFICATIONS, NuplanScenario, run_files
from augment.formats.writing import Cell, Loss, LossReport, Output, choose_finite
from augment.geometry.frames import difference, wrap
from augment.scene import entities
from augment.scene.density import is_bus
from augment.scene.entities import AgentType, Modification, ScenarioType, Scene, TrafficAgent

WORKER_STEP_M = 1.0
USUAL_WALK_M = 12.0
"""Walks of people placed by hand for interPlan are 7.0 to 28.8 m long."""
_SAME_SIZE_M, _SAME_PACE_MPS, _SAME_WAY_DEG, _NO_WALK_M = 0.01, 0.02, 0.06, 0.01
_OUTCOME = ", which may change the outcome"
_MADE_UP = (
    "These base tokens are made from the scenes' names and are none of nuPlan's; places are in "
    "the frame of each scene's origin:"
)


def write(cells: Sequence[Cell]) -> Output:
    """One YAML file for all of them, and what nuPlan needs to drive those of its own scenes.

    What came from interPlan's file keeps its base token and index, and is written as it stood
    there unless it was changed. Scenes that nuPlan does not have get a token made from their
    name; special scenarios without an index are numbered in the given order. The comments at the
    top say what is what.

    Args:
        cells: What to write, several for one scene under one token.

    Raises:
        Conflict: More than a hundred for one scene, which two digits can't number.
    """
    entries: list[_Entry] = []
    losses: list[Loss] = []
    finite, refused = choose_finite(cells)
    for cell in finite:
        if cell.type is None:
            text = "interPlan has five types of scenarios, and this one is of another: left out"
            losses.append(Loss(cell=cell.name, text=text, changes_scene=True))
        else:
            entries.append(_Entry(cell, cell.type))
    made_up = {entry.token for entry in entries if entry.cell.source is None}
    comments = [f"{_MADE_UP} {', '.join(sorted(made_up))}"] if made_up else []
    by_token: dict[str, dict[str, dict[str, Any]]] = defaultdict(dict)
    runs: list[NuplanScenario] = []
    for entry, index in zip(entries, _list_numbers(entries), strict=True):
        by_token[entry.token][index] = entry.to_entry()
        losses += entry.report.losses
        name = f"{entry.token}-s{index}"
        comments.append(f"{name} {entry.cell.scene.name}: {entry.cell.name}")
        if entry.token not in made_up:
            cell = entry.cell
            runs.append(NuplanScenario(name, cell.augmentation, cell.contestant, cell.name))
        comments += [f"  lost: {loss.text}" for loss in entry.report.losses]
    sources = {
        entry.token: entry.source for entry in reversed(entries) if entry.source.index is not None
    }
    documents = {
        token: (special, sources[token].details if token in sources else {})
        for token, special in by_token.items()
    }
    file = next((source.file for source in sources.values() if source.file), None)
    text = interplan.yaml_text(documents, comments, file)
    files = {MODIFICATIONS: text.encode()} | run_files(runs)
    return Output(files=files, losses=tuple(losses), refused=tuple(refused))


def _list_numbers(entries: Sequence["_Entry"]) -> list[str]:
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
        free = (str(number) for number in range(interplan.MOST_ENTRIES) if str(number) not in used)
        index = number or next(free, None)
        if index is None:
            raise Conflict(
                f"interPlan numbers at most {interplan.MOST_ENTRIES} special scenarios for a "
                f"scene, and {entry.cell.scene.name} has more; write fewer contestants at a time."
            )
        used.add(index)
        made.append(index)
    return made


class _Entry:
    """One special scenario while it is written."""

    def __init__(self, cell: Cell, kind: ScenarioType) -> None:
        self.cell, self.kind = cell, kind
        self.source = cell.source or InterplanSource(token=interplan.scene_token(cell.scene.name))
        self.token = self.source.token
        self.report = LossReport(cell)

    @cached_property
    def is_unchanged(self) -> bool:
        """True if the change is the one in interPlan's file."""
        if self.source.index is None:
            return False
        return self._read(self.source.entry) == self.cell.modification

    def _read(self, entry: Mapping[str, Any]) -> Modification:
        scene = entities.without_traffic(self.cell.scene)
        special = interplan.SpecialScenario.model_validate(entry)
        return interplan.read_entry(self.token, self.source.index or "0", special, scene)[0]

    def to_entry(self) -> dict[str, Any]:
        """InterPlan's keys, those without objects left out."""
        entry = dict(self.source.entry)
        config = interplan.format_suffix(self.cell.scene.options, entry.pop("config", None) or "")
        head = {"type": self.kind.value} | ({"config": config} if config else {})
        self._lose_unknown()
        if self.is_unchanged:
            return head | {key: value for key, value in entry.items() if key != "type"}
        change, by_key = self.cell.modification, defaultdict[str, list[TrafficAgent]](list)
        for agent in change.added:
            by_key[_find_key(agent, self.cell.scene)].append(agent)
        if self.cell.scene.options.density is not entities.TrafficDensity.NONE:
            self._lose(f"traffic that would meet a vehicle of this change is left out{_OUTCOME}")
        if self.cell.keeps_traffic:
            # Also with interPlan's "a1": without density traffic it deletes all vehicles twice.
            self._lose(
                f"the recorded traffic, which this scenario keeps ({len(self.cell.scene.agents)} "
                "agents), is gone: interPlan removes all of it from every special scenario"
            )
        for agent in change.moved:
            deed = "is moved" if agent.motion is None else "is given a motion"
            self._lose(f"{agent.id} {deed}; interPlan can only add")
        for name in change.removed:
            self._lose(f"{name} is removed; interPlan removes all recorded traffic")
        for agent in by_key.pop("", ()):
            self._lose(f"{agent.id} is left out: there is no key for a {agent.type} there")
        rows = {key: [self._row(key, agent) for agent in by_key[key]] for key in interplan.OBJECTS}
        objects = {key: lists for key, lists in rows.items() if lists}
        there = self._read({"type": self.kind.value, **objects}).added
        here = [agent for key in interplan.OBJECTS for agent in by_key[key]]
        for agent, counterpart in zip(here, there, strict=True):
            for text, changes_scene in _changes(agent, counterpart):
                self._lose(f"{agent.id} {text}", changes_scene=changes_scene)
        rest = {
            key: value for key, value in entry.items() if key not in ("type", *interplan.OBJECTS)
        }
        return {**head, **objects, **rest}

    def _lose_unknown(self) -> None:
        """Say what is not known until interPlan builds the scenario, a reference's too."""
        scene, added = self.cell.scene, self.cell.modification.added
        rules = scene.options.interplan
        if self.cell.source is not None and rules is None:
            self._lose(f"lasts 30 s by interPlan's rules, 15 s in drives here{_OUTCOME}")
        for agent in added if rules is None or rules.boxes_m is None else ():
            if agent.type is AgentType.VEHICLE and not is_bus(agent, scene):
                box = f"{agent.id} has a box of {agent.length_m:g} x {agent.width_m:g} m"
                text = "is not kept: it gets that of a removed vehicle, or the ego's"
                self._lose(f"{box}, which {text}{_OUTCOME}", changes_scene=False)
        cones = [agent.id for agent in added if agent.type is AgentType.TRAFFIC_CONE]
        self.report.lose_of(cones, f"turned at random there{_OUTCOME}")

    def _lose(self, text: str, *, changes_scene: bool = True) -> None:
        self.report.lose(text, changes_scene=changes_scene)

    def _row(self, key: str, agent: TrafficAgent) -> list[float | None]:
        place = self._global((agent.x_m, agent.y_m))
        if key == "cones":
            return [*place]
        if key == "pedestrian":
            return [*place, *self._global(self._walk_end(agent)), None]
        yaw_rad = wrap(agent.heading_rad + self.cell.scene.origin.pose.heading_rad)
        return [*place, round(yaw_rad, 6)]

    def _walk_end(self, agent: TrafficAgent) -> entities.Point:
        """Return the end of a walk; a standing worker takes a step, others cross a road."""
        start = agent.x_m, agent.y_m
        if agent.walk_to_m is not None and math.dist(start, agent.walk_to_m) >= _NO_WALK_M:
            return agent.walk_to_m
        stands = agent.walk_to_m is not None or self.kind is ScenarioType.CONSTRUCTION_ZONE
        length_m = WORKER_STEP_M if stands else USUAL_WALK_M
        return (
            agent.x_m + length_m * math.cos(agent.heading_rad),
            agent.y_m + length_m * math.sin(agent.heading_rad),
        )

    def _global(self, point: entities.Point) -> tuple[float, float]:
        x_m, y_m = self.cell.scene.origin.pose.to_parent(np.array([point]))[0]
        return round(float(x_m), 4), round(float(y_m), 4)


def _find_key(agent: TrafficAgent, scene: Scene) -> str:
    """The key under which interPlan has such a thing, empty where it has none."""
    if math.hypot(agent.x_m, agent.y_m) > interplan.FURTHEST_FROM_EGO_M:
        return ""
    if is_bus(agent, scene):
        return "stopped_bus"
    return {
        AgentType.VEHICLE: "stopped_vehicle",
        AgentType.TRAFFIC_CONE: "cones",
        AgentType.PEDESTRIAN: "pedestrian",
    }.get(agent.type, "")


def _changes(agent: TrafficAgent, counterpart: TrafficAgent) -> Iterator[tuple[str, bool]]:
    """Yield the values that come back changed, and whether they change the scene."""
    if agent.type is not counterpart.type:
        yield f"is {agent.length_m:g} m long and becomes a {counterpart.type}", True
    resized_m = np.abs(np.subtract(agent.size_m, counterpart.size_m)).max()
    box = f"has a box of {agent.length_m:g} x {agent.width_m:g} m"
    if counterpart.type is not AgentType.VEHICLE and resized_m > _SAME_SIZE_M:
        yield f"{box}, which becomes {counterpart.length_m:g} x {counterpart.width_m:g} m", False
    turned_deg = math.degrees(abs(difference(agent.heading_rad, counterpart.heading_rad)))
    if turned_deg > _SAME_WAY_DEG:
        yield f"looks {turned_deg:.3g} degrees away from where it looks there", False
    if agent.motion is not None:
        yield "has a motion of its own, which interPlan and nuPlan don't know", True
    if abs(agent.speed_mps - counterpart.speed_mps) > _SAME_PACE_MPS:
        text = f"moves at {agent.speed_mps:g} m/s, there at {counterpart.speed_mps:g} m/s"
        yield text, agent.walk_to_m is None
    if agent.walk_to_m != counterpart.walk_to_m and None in (
        agent.walk_to_m,
        counterpart.walk_to_m,
    ):
        yield "walks there" if agent.walk_to_m is None else "has a walk; there it stands", True
