"""From a scene and a changed one to what was changed.

Agents are matched by identity first: by their ids in our own JSON, and in formats of others by the
names that their writers here gave. Whoever is left is matched within its class and box so that the
sum of the distances is smallest. Formats can't say everything, so a changed scene is held against
the source as its own format shows it (`SourceView`): what a format loses of both is no change.
Frame: the ego frame of the source. Notation: S agents of the source, C of the changed scene.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import count

import numpy as np

from augment.formats.reading import place_on_lanes
from augment.geometry import frames
from augment.metrics.displacement import CLASS_OF
from augment.scene.entities import Modification, Origin, Point, Scene, TrafficAgent
from augment.scene.planned_motion import AtPlace, PointPath

NEAR_M, NEAR_RAD, NEAR_MPS = 0.02, 0.005, 0.05
"""What a format's rounding may change."""
_EXACT = 1e-6
"""How much of that our own JSON may change."""
REACH_M = 10.0
"""How far somebody without an identity may have been moved and still be the same."""
SAME_BOX_M = 0.05
"""Up to how much length and width of the same agent differ."""
CLOSE_CALL_M = 1.0
"""A matching is named as ambiguous where another one is no more than this much further."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceView:
    """The source as a format shows it.

    Attributes:
        agents: By their ids in the source; who is not in it can't be said in the format.
        origin: Where its ego stands in the format's file.
        names: Ids of the changed scene to those of the source, as far as the file says them.
        is_certain: Whether the names identify; else they count for boxes of one class and size.
    """

    agents: Mapping[str, TrafficAgent]
    origin: Origin
    names: Mapping[str, str] = field(default_factory=dict)
    is_certain: bool = False


def find_difference(
    before: Scene, after: Scene, view: SourceView | None = None
) -> tuple[Modification, tuple[str, ...]]:
    """Return the modification that turns one scene into the other, and notes on assumptions.

    Args:
        before: The source.
        after: The changed scene; of its map nothing counts.
        view: The source as the changed scene's format shows it; None for our own JSON, where ids
            identify and nothing is lost.
    """
    here = {agent.id: agent for agent in before.agents}
    is_own = view is None
    if view is None:
        names = {agent.id: agent.id for agent in after.agents}
        view = SourceView(agents=here, origin=before.origin, names=names, is_certain=True)
    agents, notes = _align(before, after, view)
    pairs, doubts = _pair(view, agents)
    lost = [name for name in here if name not in view.agents]
    if lost:
        notes.append(f"{', '.join(lost)}: not said in this format, taken to stay.")
    taken = set(pairs.values())
    fresh = _free_ids({*here, before.ego.id, *(agent.id for agent in agents)})
    added, moved = [], []
    for agent in agents:
        name = pairs.get(agent.id)
        if name is None:
            is_taken = agent.id in here or agent.id == before.ego.id
            added.append(replace(agent, id=next(fresh)) if is_taken else agent)
        else:
            rounding = _EXACT if is_own else 1.0
            state = _merge_state(here[name], view.agents[name], agent, rounding)
            if state is not here[name]:
                moved.append(replace(agent, id=name) if is_own else state)
    return Modification(
        added=_on_lanes(before, added, is_own),
        moved=_on_lanes(before, moved, is_own),
        removed=tuple(name for name in view.agents if name not in taken),
    ), (*notes, *doubts)


def number_added(scene: Scene, modification: Modification) -> Modification:
    """Return the modification, its new agents called by the next free numbers of the scene.

    Names that a submission gives may tell who made it, and pictures show them.
    """
    fresh = _free_ids({agent.id for agent in scene.everyone})
    names = {agent.id: next(fresh) for agent in modification.added}
    return modification.with_changed(_rename(agent, names) for agent in modification.changed)


# Private


def _rename(agent: TrafficAgent, names: Mapping[str, str]) -> TrafficAgent:
    """The agent by its new name, and so whom its motion waits for."""
    motion = agent.motion
    if motion is not None and isinstance(motion.start, AtPlace):
        who = names.get(motion.start.agent_id, motion.start.agent_id)
        motion = replace(motion, start=replace(motion.start, agent_id=who))
    return replace(agent, id=names.get(agent.id, agent.id), motion=motion)


def _align(before: Scene, after: Scene, view: SourceView) -> tuple[list[TrafficAgent], list[str]]:
    """The changed scene's agents in the frame of the source, and notes on either ego."""
    notes = []
    agents, frame = list(after.agents), after.origin.frame
    origins = [origin for origin in (before.origin, view.origin) if origin.frame == frame]
    seen = origins[0].pose.pose_to_local(after.origin.pose) if origins else after.origin.pose
    away_m = float(np.hypot(seen.x_m, seen.y_m))
    is_elsewhere = away_m > NEAR_M or abs(seen.heading_rad) > NEAR_RAD
    if is_elsewhere and origins:
        agents = [_view_from(agent, seen) for agent in agents]
        notes.append(
            f"Its ego stands {away_m:.2f} m from the source's; all others were brought into the "
            "source's frame, and the ego stays."
        )
    elif is_elsewhere:
        notes.append(f"Its frame, {frame!a}, is not known here: its ego is taken for the source's")
    if abs(after.ego.speed_mps - before.ego.speed_mps) > NEAR_MPS:
        notes.append("Its ego has another speed; the ego stays as it is.")
    return agents, notes


def _view_from(agent: TrafficAgent, seen: frames.Pose) -> TrafficAgent:
    """An agent told from the pose, in the frame that the pose is told in."""

    def placed(*points: Point) -> tuple[Point, ...]:
        return tuple((x_m, y_m) for x_m, y_m in seen.to_parent(np.array(points)).tolist())

    walk_to_m, motion = agent.walk_to_m and placed(agent.walk_to_m)[0], agent.motion
    if motion is not None and isinstance(motion.path, PointPath):
        motion = replace(motion, path=replace(motion.path, points_m=placed(*motion.path.points_m)))
    if motion is not None and isinstance(motion.start, AtPlace):
        ((x_m, y_m),) = placed((motion.start.x_m, motion.start.y_m))
        motion = replace(motion, start=replace(motion.start, x_m=x_m, y_m=y_m))
    ((x_m, y_m),) = placed((agent.x_m, agent.y_m))
    heading_rad = frames.wrap(agent.heading_rad + seen.heading_rad)
    here = {"x_m": x_m, "y_m": y_m, "heading_rad": heading_rad}
    return replace(agent, **here, walk_to_m=walk_to_m, motion=motion)  # type: ignore[arg-type]


def _pair(view: SourceView, agents: list[TrafficAgent]) -> tuple[dict[str, str], list[str]]:
    """Ids of the changed scene to those of the source, and what was ambiguous."""
    pairs: dict[str, str] = {}
    unsure: list[str] = []

    def match_rest(reach_m: float) -> None:
        rest = [agent for agent in agents if agent.id not in pairs]
        taken = set(pairs.values())
        left = [agent for name, agent in view.agents.items() if name not in taken]
        names = [name for name in view.agents if name not in taken]
        for row, column, is_ambiguous in _match(left, rest, reach_m):
            pairs[rest[column].id] = names[row]
            if is_ambiguous and reach_m > NEAR_M:
                unsure.append(names[row])

    if not view.is_certain:
        match_rest(NEAR_M)
    taken = set(pairs.values())
    for agent in agents:
        name = view.names.get(agent.id)
        if name is None or name not in view.agents or name in taken or agent.id in pairs:
            continue
        if view.is_certain or _is_like(view.agents[name], agent):
            pairs[agent.id] = name
            taken.add(name)
    match_rest(NEAR_M if view.is_certain else REACH_M)
    text = "several agents of this size are about as near; the nearest are taken for the same."
    return pairs, [f"{', '.join(unsure)}: {text}"] if unsure else []


def _is_like(first: TrafficAgent, other: TrafficAgent) -> bool:
    """Return whether class and box are those of one agent."""
    sizes_m = (first.length_m - other.length_m, first.width_m - other.width_m)
    is_same_size = max(map(abs, sizes_m)) <= SAME_BOX_M
    return is_same_size and CLASS_OF[first.type] is CLASS_OF[other.type]


def _match(
    left: list[TrafficAgent], rest: list[TrafficAgent], reach_m: float
) -> Iterator[tuple[int, int, bool]]:
    """Rows of S and columns of C that belong together, and whether others might."""
    from scipy.optimize import linear_sum_assignment

    if not left or not rest:
        return
    # (S, 4) and (C, 4) in metres: place and size.
    ours, theirs = (
        np.array([(agent.x_m, agent.y_m, *agent.size_m) for agent in agents])
        for agents in (left, rest)
    )
    classes, other_classes = (
        np.array([CLASS_OF[agent.type] for agent in agents]) for agents in (left, rest)
    )
    differences_m = ours[:, None] - theirs  # (S, C, 4)
    apart_m = np.hypot(differences_m[..., 0], differences_m[..., 1])
    is_alike = (np.abs(differences_m[..., 2:]) <= SAME_BOX_M).all(axis=2)
    is_alike &= classes[:, None] == other_classes
    fits = (apart_m <= reach_m) & is_alike
    cost = np.where(fits, apart_m, 1e6)
    for row, column in zip(*linear_sum_assignment(cost), strict=True):
        if fits[row, column]:
            within = cost[row, column] + CLOSE_CALL_M
            others = (cost[row] <= within).sum() + (cost[:, column] <= within).sum() - 2
            yield int(row), int(column), bool(others)


def _merge_state(
    source: TrafficAgent, shown: TrafficAgent, agent: TrafficAgent, rounding: float
) -> TrafficAgent:
    """The source's agent with what differs from how its format shows it, itself for nothing."""
    near_m, turn_rad = NEAR_M * rounding, frames.difference(agent.heading_rad, shown.heading_rad)
    changes: dict[str, object] = {}
    if np.hypot(agent.x_m - shown.x_m, agent.y_m - shown.y_m) > near_m:
        changes |= {"x_m": agent.x_m, "y_m": agent.y_m}
    if abs(turn_rad) > NEAR_RAD * rounding:
        changes["heading_rad"] = agent.heading_rad
    if abs(agent.speed_mps - shown.speed_mps) > NEAR_MPS * rounding:
        changes["speed_mps"] = agent.speed_mps
    for name in ("length_m", "width_m"):
        if abs(getattr(agent, name) - getattr(shown, name)) > near_m:
            changes[name] = getattr(agent, name)
    if agent.type is not shown.type:
        changes["type"] = agent.type
    end, shown_end = agent.walk_to_m, shown.walk_to_m
    if math.dist(end, shown_end) > near_m if end and shown_end else end != shown_end:
        changes["walk_to_m"] = agent.walk_to_m
    if agent.motion != shown.motion:
        changes["motion"] = agent.motion
    if not changes:
        return source
    return replace(source, **changes, lane_id=agent.lane_id)  # type: ignore[arg-type]


def _free_ids(taken: set[str]) -> Iterator[str]:
    return (name for number in count(1) if (name := f"Agent{number}") not in taken)


def _on_lanes(
    before: Scene, agents: list[TrafficAgent], keeps_lanes: bool
) -> tuple[TrafficAgent, ...]:
    """The agents with the source's lanes under them; lanes that they name already may stay."""
    lane_ids = {lane.id for lane in before.lanes} | {way.id for way in before.connectors}
    placed = place_on_lanes(replace(before, agents=tuple(agents))).agents if agents else ()
    return tuple(
        agent if keeps_lanes and (agent.lane_id is None or agent.lane_id in lane_ids) else fit
        for agent, fit in zip(agents, placed, strict=True)
    )
