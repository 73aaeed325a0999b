"""Interface of all writers of scenarios: cells in; files and a line for each loss out.

Frame of a cell: the ego frame of its scene.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from functools import cached_property

import numpy as np

from augment.errors import InvalidDocument, InvalidModification
from augment.formats.interplan.file import InterplanSource
from augment.geometry.polyline import Polyline
from augment.scene import codec, entities
from augment.scene.entities import AnyLane, LaneConnector, Scene
from augment.scene.motion import Motion, MotionSource, Movement, find_motion
from augment.scene.planned_motion import AtTime, PointPath
from augment.scene.planned_mover import SETS_OUT_WITHIN_M
from augment.scene.recording import Recording


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One modification to be written.

    Attributes:
        name: What a person calls it, for a file's comments and the report.
        type: None for one that interPlan does not have.
        scene: Before the change, without the recorded traffic unless that is kept.
        keeps_traffic: Whether the recorded vehicles stay.
        stem: The name of its files, without an ending.
        made_on: When the change was made, for formats that ask for a date.
        recording: What was recorded after t0, None where nothing was.
        expected: Tracks of all who move by interPlan's rules, and the ego's, where drives follow
            those; None elsewhere.
        augmentation, contestant: The code of its row and the slug of who made it, where known.
        source: Where the scenario comes from in nuPlan and interPlan, None where it does not.
    """

    name: str
    scene: Scene
    type: entities.ScenarioType | None
    modification: entities.Modification
    keeps_traffic: bool = False
    stem: str = "scenario"
    made_on: date = date(1970, 1, 1)
    recording: Recording | None = None
    expected: Recording | None = None
    augmentation: str = ""
    contestant: str = "nobody"
    source: InterplanSource | None = None

    @cached_property
    def after(self) -> Scene:
        """The scene after the change.

        Raises:
            InvalidModification: The change does not fit the scene.
        """
        return entities.apply(self.scene, self.modification)

    @cached_property
    def motion(self) -> Motion:
        """Everybody's motion after t0; by interPlan's rules some are never there."""
        recording = self.recording and self.recording.without(self.modification.replaced)
        motion = find_motion(
            self.after, recording=self.expected or recording, with_later=self.keeps_traffic
        )
        there = tuple(other for other in motion.others if other.is_present.any())
        return replace(motion, others=there)


@dataclass(frozen=True, slots=True, kw_only=True)
class Loss:
    """Something that a format can't say, or that had to be made up.

    Attributes:
        changes_scene: Whether other things stand in the receiver's scene than in ours, or do
            something else; not so for sizes and the pace of a walk.
    """

    cell: str
    text: str
    changes_scene: bool = False

    def __str__(self) -> str:
        return f"{self.cell}: {self.text}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Output:
    """Files and losses of a writer.

    Attributes:
        files: Their bytes by name.
        losses: One line for each thing that the files don't say as the cells do.
        refused: One line for each cell that can't be said at all, and has no file.
    """

    files: dict[str, bytes]
    losses: tuple[Loss, ...]
    refused: tuple[Loss, ...] = ()


Writer = Callable[[Sequence[Cell]], Output]
"""Writes cells, all or those that can be said. The same cells always give the same bytes."""


class LossReport:
    """Gathers the losses of one cell while it is written."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self.losses: list[Loss] = []

    def lose(self, text: str, *, changes_scene: bool = False) -> None:
        """Add a line."""
        self.losses.append(Loss(cell=self._cell.name, text=text, changes_scene=changes_scene))

    def lose_of(self, names: Sequence[str], text: str, *, changes_scene: bool = False) -> None:
        """Add one line for all of these; none where there are none."""
        if names:
            self.lose(f"{', '.join(names)}: {text}", changes_scene=changes_scene)

    def lose_types(self, texts: Mapping[entities.AgentType, str]) -> None:
        """Add one line for all agents of each of these types."""
        for kind, text in texts.items():
            others = [other.agent for other in self._cell.motion.others]
            self.lose_of([agent.id for agent in others if agent.type is kind], text)

    def lose_areas(self, areas: Iterable[entities.Area], text: str) -> None:
        """Add one line for all areas of a kind, which the text names by {}."""
        by_kind: dict[entities.AreaKind, list[str]] = defaultdict(list)
        for area in areas:
            by_kind[area.kind].append(area.id)
        for kind, names in by_kind.items():
            self.lose_of(names, text.format(kind))


class CannotExpress(Exception):
    """A cell can't be said in a format; raised and caught inside a writer, never passed on."""


def check_finite(cell: Cell) -> None:
    """Do nothing where every number of a cell can be written.

    Raises:
        CannotExpress: The change does not fit; the scene after it, or where somebody is at a
            step, is no finite number; or the ego is missing at a step.
    """
    try:
        codec.scene_to_document(cell.after)
    except (InvalidDocument, InvalidModification) as error:
        raise CannotExpress(str(error)) from error
    for movement in (cell.motion.ego, *cell.motion.others):
        is_ego = movement is cell.motion.ego
        rows = movement.states if is_ego else movement.states[movement.is_present]
        broken = np.flatnonzero(~np.isfinite(rows).all(axis=1))
        if len(broken):
            raise CannotExpress(f"{movement.agent.id} is at no finite place in step {broken[0]}")


def choose_finite(cells: Sequence[Cell]) -> tuple[list[Cell], list[Loss]]:
    """Return the cells whose numbers can be written, and the refusals of the others.

    Every writer begins with it.
    """
    finite: list[Cell] = []
    refused: list[Loss] = []
    for cell in cells:
        try:
            check_finite(cell)
        except CannotExpress as reason:
            refused.append(Loss(cell=cell.name, text=str(reason), changes_scene=True))
        else:
            finite.append(cell)
    return finite, refused


def write_each(
    cells: Sequence[Cell], write_one: Callable[[Cell, LossReport], dict[str, bytes]]
) -> Output:
    """The cells one by one; what can't be expressed is refused by its name and reason."""
    files: dict[str, bytes] = {}
    losses: list[Loss] = []
    finite, refused = choose_finite(cells)
    for cell in finite:
        report = LossReport(cell)
        try:
            files |= write_one(cell, report)
        except CannotExpress as reason:
            refused.append(Loss(cell=cell.name, text=str(reason), changes_scene=True))
        else:
            losses += report.losses
    return Output(files=files, losses=tuple(losses), refused=tuple(refused))


def report_motion(cell: Cell, report: LossReport, *, can_trigger: bool = False) -> None:
    """Say what of the motion was assumed, and what was fixed that depends on the ego.

    Args:
        cell: What is written.
        report: Gets the lines.
        can_trigger: Whether the format can let people set out when the ego comes near.
    """
    motion = cell.motion
    if motion.ego.source in _ASSUMED:
        report.lose(f"the ego was not recorded; {_ASSUMED[motion.ego.source]}")
    elif cell.recording is not None:
        unseen = ~cell.recording.ego_is_seen
        if unseen.any():
            report.lose(
                f"the ego was not recorded at {unseen.sum()} of {len(unseen)} steps; it goes "
                "straight across gaps, and holds its last speed after the last step"
            )
    names = [other.agent.id for other in motion.others if other.source is MotionSource.HELD_SPEED]
    report.lose_of(names, "not recorded; let hold the speed of t0 along the lane, or straight on")
    if cell.expected is not None:
        report.lose_of(
            [other.agent.id for other in motion.others if other.source is MotionSource.RECORDED],
            "goes as interPlan's rules move it beside this ego, for whom nobody brakes",
        )
        there = {other.agent.id for other in motion.others}
        text = "is left out: by interPlan's rules it is never there"
        absent = [agent.id for agent in cell.after.agents if agent.id not in there]
        report.lose_of(absent, text, changes_scene=True)
    own = [
        other
        for other in motion.others
        if other.source is not MotionSource.RECORDED
        and (other.agent.walk_to_m or other.agent.motion)
    ]
    waiting = [other.agent for other in own if other.started_s is None]
    text = f"has a walk but stands: the ego never comes within {SETS_OUT_WITHIN_M:g} m"
    report.lose_of([agent.id for agent in waiting if agent.walk_to_m], text, changes_scene=True)
    text = "has a motion but never sets out: its trigger does not fire"
    report.lose_of([agent.id for agent in waiting if agent.motion], text, changes_scene=True)
    if can_trigger:
        return
    text = "sets out at a fixed time, not when its trigger fires"
    going = [other.agent for other in own if other.started_s is not None]
    by_clock = [one for one in going if one.motion and isinstance(one.motion.start, AtTime)]
    report.lose_of([agent.id for agent in going if agent not in by_clock], text)
    text = "the walk or motion is written as it goes, without end point, path and trigger"
    report.lose_of([other.agent.id for other in own], text)


_ASSUMED = {
    MotionSource.HELD_SPEED: "it is let hold its speed along its lane",
    MotionSource.STANDING: "it stands, as it does at t0",
}


def keeps_heading(agent: entities.TrafficAgent) -> bool:
    """Return whether an agent moves without turning, so not along its heading."""
    path = agent.motion and agent.motion.path
    return isinstance(path, PointPath) and path.keeps_heading


def appears_later(movement: Movement) -> bool:
    """Return whether an agent is not there yet at t0."""
    return not bool(movement.is_present[0])


def has_gaps(movement: Movement) -> bool:
    """Return whether an agent goes and comes back."""
    present = movement.is_present
    return bool((present[1:] & ~present[:-1]).sum() > (0 if present[0] else 1))


def way_edges(way: AnyLane) -> tuple[Polyline, Polyline]:
    """The edges as the map has them, else half a width beside the centreline."""
    half_m = way.width_m / 2.0
    left = way.left_boundary or beside(way.centerline, half_m)
    return left, way.right_boundary or beside(way.centerline, -half_m)


def beside(line: Polyline, d_m: float) -> Polyline:
    """The line through the points d to the left of each of a line's points, mitred."""
    steps = np.diff(line.points_m, axis=0)
    ways = steps / np.hypot(steps[:, 0], steps[:, 1])[:, None]
    before, after = np.vstack([ways[:1], ways]), np.vstack([ways, ways[-1:]])
    mean = before + after
    lengths = np.hypot(mean[:, 0], mean[:, 1])
    mean = np.where(lengths[:, None] < 1e-6, after, mean / np.maximum(lengths, 1e-6)[:, None])
    # A mitre makes the strip as wide at a bend as beside it; a hairpin's would have no end.
    stretch = np.maximum((mean * after).sum(axis=1), 0.5)
    normals = np.column_stack([-mean[:, 1], mean[:, 0]]) / stretch[:, None]
    return Polyline(line.points_m + d_m * normals)


def group_connectors(connectors: Iterable[LaneConnector]) -> list[list[LaneConnector]]:
    """Return the connectors by junction: those that share a lane at either end are of one."""
    groups: list[tuple[set[str], list[LaneConnector]]] = []
    for connector in connectors:
        ends = {f"from {connector.from_lane}", f"to {connector.to_lane or connector.id}"}
        touching = [group for group in groups if group[0] & ends]
        groups = [group for group in groups if not group[0] & ends]
        members = [member for _, group in touching for member in group]
        groups.append((ends.union(*(names for names, _ in touching)), [*members, connector]))
    return [members for _, members in groups]
