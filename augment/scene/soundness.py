"""Rules of a document that reach over more than one field: ids, references, real lines.

Each function yields problems as (path, sentence) pairs and changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from augment.geometry.polyline import Polyline
from augment.scene.entities import AgentType, TurnType
from augment.scene.schema import (
    AgentDocument,
    AreaDocument,
    ConnectorDocument,
    LaneDocument,
    ModificationDocument,
    SceneDocument,
    path,
)

EGO_ID = "Agent1"

Problem = tuple[str, str]


def scene_problems(scene: SceneDocument) -> Iterator[Problem]:
    """What keeps a well-shaped document from being a scene."""
    yield from _ego_problems(scene.ego)
    named = [(path("ego", "id"), scene.ego.id), *_ids("agents", scene.agents)]
    named += _ids("lanes", scene.lanes) + _ids("connectors", scene.connectors)
    yield from _doubled(named + _ids("areas", scene.areas))
    yield from _not_the_ego("agents", scene.agents)
    yield from _reference_problems(scene)
    for key, lanes in (("lanes", scene.lanes), ("connectors", scene.connectors)):
        yield from _line_problems(key, lanes)
    for index, area in enumerate(scene.areas):
        if len({(x, y) for x, y in area.boundary_m}) < 3:
            yield path("areas", index, "boundary_m"), "an area needs three distinct points"
    if scene.options.goal is TurnType.U_TURN:
        yield path("options", "goal"), "left, right or straight"


def modification_problems(change: ModificationDocument) -> Iterator[Problem]:
    """What keeps a well-shaped document from being a modification of any scene."""
    removed = [(path("remove", index), name) for index, name in enumerate(change.remove)]
    yield from _doubled([*_ids("add", change.add), *_ids("move", change.move), *removed])
    yield from _not_the_ego("add", change.add)
    yield from _not_the_ego("move", change.move)


# Private


def _ids(
    key: str, entities: Sequence[AgentDocument | LaneDocument | ConnectorDocument | AreaDocument]
) -> list[Problem]:
    return [(path(key, index, "id"), entity.id) for index, entity in enumerate(entities)]


def _doubled(named: Iterable[tuple[str, str]]) -> Iterator[Problem]:
    first: dict[str, str] = {}
    for place, name in named:
        if name in first:
            yield place, f"{name!r} is taken already by {first[name]}"
        first.setdefault(name, place)


def _ego_problems(ego: AgentDocument) -> Iterator[Problem]:
    if ego.id != EGO_ID:
        yield path("ego", "id"), f"the ego is {EGO_ID!r}, got {ego.id!r}"
    if ego.type is not AgentType.EGO_VEHICLE:
        yield path("ego", "type"), f"the ego is {AgentType.EGO_VEHICLE!s}, got {ego.type!s}"
    for name in ("x_m", "y_m", "heading_rad"):
        value = getattr(ego, name)
        if value != 0.0:
            yield path("ego", name), f"the ego is the origin of its frame: 0, got {value}"


def _not_the_ego(key: str, agents: Sequence[AgentDocument]) -> Iterator[Problem]:
    for index, agent in enumerate(agents):
        if agent.type is AgentType.EGO_VEHICLE:
            yield path(key, index, "type"), "there is one ego, and it is not in this list"


def _reference_problems(scene: SceneDocument) -> Iterator[Problem]:
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


def _lane_references(scene: SceneDocument) -> Iterator[tuple[str, str | None]]:
    for index, lane in enumerate(scene.lanes):
        yield path("lanes", index, "left_neighbor"), lane.left_neighbor
        yield path("lanes", index, "right_neighbor"), lane.right_neighbor
        for number, name in enumerate(lane.successors):
            yield path("lanes", index, "successors", number), name


def _line_problems(
    key: str, lanes: Sequence[LaneDocument | ConnectorDocument]
) -> Iterator[Problem]:
    for index, lane in enumerate(lanes):
        for name in ("centerline_m", "left_boundary_m", "right_boundary_m"):
            line = getattr(lane, name)
            if line is None:
                continue
            try:
                Polyline(line)
            except ValueError as fault:
                yield path(key, index, name), str(fault)
