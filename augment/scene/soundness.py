"""Rules of a document that reach over more than one field: ids, references, real lines.

Each function yields problems as (path, sentence) pairs and changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from augment.scene.entities import (
    AgentType,
    Area,
    Lane,
    LaneConnector,
    Modification,
    Scene,
    TrafficAgent,
    TurnType,
)
from augment.scene.schema import path

EGO_ID = "Agent1"

Problem = tuple[str, str]


def scene_problems(scene: Scene) -> Iterator[Problem]:
    """What keeps a well-shaped value from being a scene."""
    yield from _ego_problems(scene.ego)
    named = [(path("ego", "id"), scene.ego.id), *_ids("agents", scene.agents)]
    named += _ids("lanes", scene.lanes) + _ids("connectors", scene.connectors)
    yield from _doubled(named + _ids("areas", scene.areas))
    yield from _not_the_ego("agents", scene.agents)
    yield from _reference_problems(scene)
    for index, area in enumerate(scene.areas):
        if len({(x, y) for x, y in area.boundary_m}) < 3:
            yield path("areas", index, "boundary_m"), "an area needs three distinct points"
    if scene.options.goal is TurnType.U_TURN:
        yield path("options", "goal"), "left, right or straight"


def modification_problems(change: Modification) -> Iterator[Problem]:
    """What keeps a well-shaped value from being a modification of any scene."""
    removed = [(path("remove", index), name) for index, name in enumerate(change.removed)]
    yield from _doubled([*_ids("add", change.added), *_ids("move", change.moved), *removed])
    yield from _not_the_ego("add", change.added)
    yield from _not_the_ego("move", change.moved)


# Private


def _ids(
    key: str, entities: Sequence[TrafficAgent | Lane | LaneConnector | Area]
) -> list[Problem]:
    return [(path(key, index, "id"), entity.id) for index, entity in enumerate(entities)]


def _doubled(named: Iterable[tuple[str, str]]) -> Iterator[Problem]:
    first: dict[str, str] = {}
    for place, name in named:
        if name in first:
            yield place, f"{name!r} is taken already by {first[name]}"
        first.setdefault(name, place)


def _ego_problems(ego: TrafficAgent) -> Iterator[Problem]:
    if ego.id != EGO_ID:
        yield path("ego", "id"), f"the ego is {EGO_ID!r}, got {ego.id!r}"
    if ego.type is not AgentType.EGO_VEHICLE:
        yield path("ego", "type"), f"the ego is {AgentType.EGO_VEHICLE!s}, got {ego.type!s}"
    for name in ("x_m", "y_m", "heading_rad"):
        value = getattr(ego, name)
        if value != 0.0:
            yield path("ego", name), f"the ego is the origin of its frame: 0, got {value}"


def _not_the_ego(key: str, agents: Sequence[TrafficAgent]) -> Iterator[Problem]:
    for index, agent in enumerate(agents):
        if agent.type is AgentType.EGO_VEHICLE:
            yield path(key, index, "type"), "there is one ego, and it is not in this list"


def _reference_problems(scene: Scene) -> Iterator[Problem]:
    lanes = {lane.id for lane in scene.lanes}
    known = lanes | {connector.id for connector in scene.connectors}
    agents = [(path("ego", "lane_id"), scene.ego.lane_id)]
    agents += [(path("agents", i, "lane_id"), one.lane_id) for i, one in enumerate(scene.agents)]
    for place, name in agents:
        if name is not None and name not in known:
            yield place, f"{name!r} is not a lane or connector of this scene"
    for place, name in _lane_references(scene):
        if name is not None and name not in lanes:
            yield place, f"{name!r} is not a lane of this scene"
    for index, connector in enumerate(scene.connectors):
        for key in ("from_lane", "to_lane"):
            name = getattr(connector, key)
            if name is not None and (name not in known or name == connector.id):
                yield path("connectors", index, key), f"{name!r} is not a lane of this scene"


def _lane_references(scene: Scene) -> Iterator[tuple[str, str | None]]:
    for index, lane in enumerate(scene.lanes):
        yield path("lanes", index, "left_neighbor"), lane.left_neighbor
        yield path("lanes", index, "right_neighbor"), lane.right_neighbor
        for number, name in enumerate(lane.successors):
            yield path("lanes", index, "successors", number), name
