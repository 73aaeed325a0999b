"""A ruler for round trips: what of a scene came back otherwise, thing by thing.

Knows no writer and no reader. Things are found again by where they are, for names may change.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from augment.formats.reading import Reading
from augment.formats.writing import Cell
from augment.geometry.frames import difference
from augment.geometry.polyline import Polyline
from augment.scene.entities import AnyLane, Area, Lane, LaneConnector, Scene, TrafficAgent
from augment.scene.motion import Movement

NEAR_M, NEAR_RAD, NEAR_MPS = 0.01, 0.001, 0.01


@dataclass(frozen=True, slots=True)
class Change:
    """One thing that is otherwise: which, what about it, and how it was and is."""

    name: str
    aspect: str
    was: object = None
    found: object = None


def changes(cell: Cell, reading: Reading) -> Iterator[Change]:
    """Everything of the cell's scene and motion that came back otherwise."""
    before, after = cell.after, reading.scene
    if after.traffic_side is not before.traffic_side:
        yield Change("scene", "side", before.traffic_side, after.traffic_side)
    yield from _of_agent(before.ego, after.ego, before.ego.speed_mps)
    if not _same_motion(cell.motion.ego, reading, None):
        yield Change(before.ego.id, "ego motion")
    yield from _of_agents(cell, reading)
    yield from _of_ways(before, after)
    yield from _of_areas(before.areas, after.areas)


def agent_changes(
    before: Sequence[TrafficAgent], after: Sequence[TrafficAgent]
) -> Iterator[Change]:
    """The same of agents alone, their walks included."""
    pairs, odd = _paired(before, after)
    yield from odd
    for agent, found in pairs:
        yield from _of_agent(agent, found, agent.speed_mps)
        yield from _of_walk(agent, found)


def _paired(
    before: Sequence[TrafficAgent], after: Sequence[TrafficAgent]
) -> tuple[list[tuple[TrafficAgent, TrafficAgent]], list[Change]]:
    """Who is found again by place, and who is missing or made up."""
    left, pairs, odd = list(after), [], []
    for agent in before:
        place = (agent.x_m, agent.y_m)
        found = min(left, key=lambda one: _apart((one.x_m, one.y_m), place), default=None)
        if found is None or _apart((found.x_m, found.y_m), place) > NEAR_M:
            odd.append(Change(agent.id, "missing", agent.type))
        else:
            left.remove(found)
            pairs.append((agent, found))
    return pairs, [*odd, *(Change(one.id, "made up") for one in left)]


def _of_agents(cell: Cell, reading: Reading) -> Iterator[Change]:
    by_name = {one.agent.id: one for one in cell.motion.others}
    pairs, odd = _paired(cell.after.agents, reading.scene.agents)
    yield from odd
    for agent, found in pairs:
        # What stands before it sets out stands at t0.
        yield from _of_agent(agent, found, float(by_name[agent.id].states[0, 3]))
        yield from _of_walk(agent, found)
        if not _same_motion(by_name[agent.id], reading, found.id):
            yield Change(agent.id, "motion")
    here = {agent.id for agent in cell.after.agents}
    tracks = [] if reading.recording is None else reading.recording.tracks
    for name, later in by_name.items():
        if name not in here and not any(_same_states(later, one.states) for one in tracks):
            yield Change(name, "later", later.agent.type)


def _of_agent(was: TrafficAgent, found: TrafficAgent, speed_mps: float) -> Iterator[Change]:
    if _apart((was.x_m, was.y_m), (found.x_m, found.y_m)) > NEAR_M:
        yield Change(was.id, "centre")
    if abs(difference(was.heading_rad, found.heading_rad)) > NEAR_RAD:
        yield Change(was.id, "heading", was.heading_rad, found.heading_rad)
    boxes = (was.length_m, was.width_m), (found.length_m, found.width_m)
    if _apart(*boxes) > NEAR_M:
        yield Change(was.id, "box", *boxes)
    if abs(found.speed_mps - speed_mps) > NEAR_MPS:
        yield Change(was.id, "velocity", speed_mps, found.speed_mps)
    if found.type is not was.type:
        yield Change(was.id, "class", was.type, found.type)


def _of_walk(was: TrafficAgent, found: TrafficAgent) -> Iterator[Change]:
    ends = was.walk_to_m, found.walk_to_m
    if ends == (None, None):
        return
    if ends[0] is None or ends[1] is None or _apart(ends[0], ends[1]) > NEAR_M:
        yield Change(was.id, "walk", *ends)


def _same_motion(movement: Movement, reading: Reading, name: str | None) -> bool:
    recording = reading.recording
    if name is None:
        return _same_states(movement, recording.ego)
    (track,) = (one for one in recording.tracks if one.agent_id == name)
    return _same_states(movement, track.states)


def _same_states(movement: Movement, found: np.ndarray[Any, Any]) -> bool:
    """A recording ends with the last who moves; what stands then stands on."""
    was = movement.states
    if movement.stands:
        was = was[: len(found)]
    if len(found) > len(was):
        return False
    found = np.vstack([found, np.full((len(was) - len(found), 4), np.nan)])
    seen = ~np.isnan(was).any(axis=1)
    if (seen != ~np.isnan(found).any(axis=1)).any():
        return False
    was, found = was[seen], found[seen]
    turned = np.abs(np.remainder(was[:, 2] - found[:, 2] + np.pi, 2.0 * np.pi) - np.pi)
    return bool(
        (np.hypot(*(was[:, :2] - found[:, :2]).T) <= NEAR_M).all()
        and (turned <= NEAR_RAD).all()
        and (np.abs(was[:, 3] - found[:, 3]) <= NEAR_MPS).all()
    )


def _of_ways(before: Scene, after: Scene) -> Iterator[Change]:
    ours: list[AnyLane] = [*before.lanes, *before.connectors]
    left: list[AnyLane] = [*after.lanes, *after.connectors]
    new_name: dict[str | None, str | None] = {None: None}
    pairs = []
    for was in ours:
        found = next((one for one in left if _same_line(was.centerline, one.centerline)), None)
        if found is None:
            yield Change(was.id, "way")
            found = next((one for one in left if _same_ends(was.centerline, one.centerline)), None)
        if found is None:
            continue
        left.remove(found)
        new_name[was.id] = found.id
        pairs.append((was, found))
    yield from (Change(one.id, "made up") for one in left)
    for was, found in pairs:
        yield from _of_way(was, found, new_name)


def _of_way(
    was: AnyLane, found: AnyLane, new_name: dict[str | None, str | None]
) -> Iterator[Change]:
    if type(was) is not type(found):
        yield Change(was.id, "kind of way")
        return
    if abs(was.width_m - found.width_m) > NEAR_M:
        yield Change(was.id, "width", was.width_m, found.width_m)
    limits = (was.speed_limit_mps or 0.0, found.speed_limit_mps or 0.0)
    if abs(limits[0] - limits[1]) > NEAR_MPS:
        yield Change(was.id, "limit", *limits)
    for name in ("left_boundary", "right_boundary"):
        edges = getattr(was, name), getattr(found, name)
        if edges[0] is not None and (edges[1] is None or not _same_line(*edges)):
            yield Change(was.id, "edge", name)
    links: tuple[tuple[str, object, object], ...] = ()
    if isinstance(was, Lane) and isinstance(found, Lane):
        after = {new_name.get(name, "lost") for name in was.successors}
        links = (
            ("successors", after, set(found.successors)),
            ("left", new_name.get(was.left_neighbor, "lost"), found.left_neighbor),
            ("right", new_name.get(was.right_neighbor, "lost"), found.right_neighbor),
        )
    if isinstance(was, LaneConnector) and isinstance(found, LaneConnector):
        links = (
            ("from", new_name.get(was.from_lane, "lost"), found.from_lane),
            ("to", new_name.get(was.to_lane, "lost"), found.to_lane),
            ("turn", was.turn_type, found.turn_type),
            ("light", was.traffic_light, found.traffic_light),
        )
    for aspect, wanted, got in links:
        if wanted != got:
            yield Change(was.id, aspect, wanted, got)


def _of_areas(before: Iterable[Area], after: Iterable[Area]) -> Iterator[Change]:
    left = list(after)
    for was in before:
        found = next((one for one in left if _same_ring(was, one)), None)
        if found is None:
            yield Change(was.id, "area", was.kind)
        else:
            left.remove(found)
    yield from (Change(one.id, "made up") for one in left)


def _same_ring(was: Area, found: Area) -> bool:
    """The corners, wherever the ring begins and whichever way it goes."""
    if was.kind is not found.kind or len(was.boundary_m) != len(found.boundary_m):
        return False
    rings = (found.boundary_m, found.boundary_m[::-1])
    turned = (np.roll(ring, step, axis=0) for ring in rings for step in range(len(ring)))
    return any(bool((_distances(was.boundary_m, ring) <= NEAR_M).all()) for ring in turned)


def _same_line(was: Polyline, found: Polyline) -> bool:
    """Both ends, and every corner of either on the other."""
    return _same_ends(was, found) and all(
        there.project(x_m, y_m).distance_m <= NEAR_M
        for here, there in ((was, found), (found, was))
        for x_m, y_m in here.points_m.tolist()
    )


def _same_ends(was: Polyline, found: Polyline) -> bool:
    ends = [0, -1]
    return bool((_distances(was.points_m[ends], found.points_m[ends]) <= NEAR_M).all())


def _distances(one: Any, other: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    apart: np.ndarray[Any, np.dtype[np.float64]] = np.asarray(one) - np.asarray(other)
    return np.hypot(apart[:, 0], apart[:, 1])


def _apart(one: Sequence[float], other: Sequence[float]) -> float:
    return float(np.hypot(one[0] - other[0], one[1] - other[1]))
