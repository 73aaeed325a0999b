"""Scenes and modifications as JSON documents and back, exactly.

What can't be read raises `InvalidDocument` and names every place; what is written can be read.
Frame: ego frame of the scene.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from augment.errors import InvalidDocument
from augment.geometry.frames import Pose
from augment.geometry.polyline import Polyline
from augment.scene.entities import (
    Area,
    Lane,
    LaneConnector,
    Origin,
    Point,
    Scene,
    SceneOptions,
    TrafficAgent,
)
from augment.scene.modification import Modification
from augment.scene.schema import (
    MODIFICATION_FORMAT,
    SCENE_FORMAT,
    VERSION,
    AgentDocument,
    ConnectorDocument,
    LaneDocument,
    ModificationDocument,
    SceneDocument,
    SceneOptionsDocument,
    read,
)
from augment.scene.soundness import modification_problems, scene_problems


def scene_to_document(scene: Scene) -> dict[str, Any]:
    """The scene as a JSON document; fields without a value are left out.

    Raises:
        InvalidDocument: The scene breaks a rule of the format, so nobody could read it again.
    """
    pose = scene.origin.pose
    document = {
        "format": SCENE_FORMAT,
        "version": VERSION,
        "name": scene.name,
        "provenance": scene.provenance,
        "traffic_side": scene.traffic_side.value,
        "origin": {
            "frame": scene.origin.frame,
            "x_m": pose.x_m,
            "y_m": pose.y_m,
            "heading_rad": pose.heading_rad,
        },
        "ego": _agent_to_document(scene.ego),
        "agents": [_agent_to_document(agent) for agent in scene.agents],
        "lanes": [_lane_to_document(lane) for lane in scene.lanes],
        "connectors": [_connector_to_document(connector) for connector in scene.connectors],
        "areas": [
            {"id": area.id, "kind": area.kind.value, "boundary_m": _pairs(area.boundary_m)}
            for area in scene.areas
        ],
    }
    if scene.options != SceneOptions():
        document["options"] = _options_to_document(scene.options)
    scene_from_document(document)
    return document


def scene_from_document(document: object) -> Scene:
    """The scene that a JSON document describes.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    read_scene = read(document, SceneDocument, what="scene", format_name=SCENE_FORMAT)
    problems = list(scene_problems(read_scene))
    if problems:
        raise InvalidDocument("scene", problems)
    origin = read_scene.origin
    return Scene(
        name=read_scene.name,
        ego=_agent(read_scene.ego),
        traffic_side=read_scene.traffic_side,
        origin=Origin(
            frame=origin.frame,
            pose=Pose(x_m=origin.x_m, y_m=origin.y_m, heading_rad=origin.heading_rad),
        ),
        provenance=read_scene.provenance,
        agents=tuple(_agent(agent) for agent in read_scene.agents),
        lanes=tuple(_lane(lane) for lane in read_scene.lanes),
        connectors=tuple(_connector(connector) for connector in read_scene.connectors),
        areas=tuple(
            Area(id=area.id, kind=area.kind, boundary_m=_points(area.boundary_m))
            for area in read_scene.areas
        ),
        options=_options(read_scene.options),
    )


def modification_to_document(modification: Modification) -> dict[str, Any]:
    """The modification as a JSON document; fields without a value are left out.

    Raises:
        InvalidDocument: The modification breaks a rule of the format.
    """
    document = {
        "format": MODIFICATION_FORMAT,
        "version": VERSION,
        "add": [_agent_to_document(agent) for agent in modification.added],
        "move": [_agent_to_document(agent) for agent in modification.moved],
        "remove": list(modification.removed),
    }
    modification_from_document(document)
    return document


def modification_from_document(document: object) -> Modification:
    """The modification that a JSON document describes; whether it fits a scene is not asked here.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    what = "modification"
    change = read(document, ModificationDocument, what=what, format_name=MODIFICATION_FORMAT)
    problems = list(modification_problems(change))
    if problems:
        raise InvalidDocument(what, problems)
    return Modification(
        added=tuple(_agent(agent) for agent in change.add),
        moved=tuple(_agent(agent) for agent in change.move),
        removed=tuple(change.remove),
    )


# Private: from values to documents


def _given(**fields: Any) -> dict[str, Any]:
    return {name: value for name, value in fields.items() if value is not None}


def _pairs(points: Iterable[Point]) -> list[list[float]]:
    return [[float(x), float(y)] for x, y in points]


def _line_pairs(line: Polyline | None) -> list[list[float]] | None:
    return None if line is None else line.points_m.tolist()


def _agent_to_document(agent: TrafficAgent) -> dict[str, Any]:
    return _given(
        id=agent.id,
        type=agent.type.value,
        x_m=agent.x_m,
        y_m=agent.y_m,
        heading_rad=agent.heading_rad,
        width_m=agent.width_m,
        length_m=agent.length_m,
        speed_mps=agent.speed_mps,
        lane_id=agent.lane_id,
        walk_to_m=None if agent.walk_to_m is None else [*agent.walk_to_m],
    )


def _lane_to_document(lane: Lane) -> dict[str, Any]:
    return _given(
        id=lane.id,
        centerline_m=_line_pairs(lane.centerline),
        width_m=lane.width_m,
        speed_limit_mps=lane.speed_limit_mps,
        left_boundary_m=_line_pairs(lane.left_boundary),
        right_boundary_m=_line_pairs(lane.right_boundary),
        left_neighbor=lane.left_neighbor,
        right_neighbor=lane.right_neighbor,
        successors=list(lane.successors) or None,
    )


def _options_to_document(options: SceneOptions) -> dict[str, Any]:
    return _given(
        density=options.density.value,
        goal=None if options.goal is None else options.goal.value,
        goal_m=None if options.goal_m is None else [*options.goal_m],
    )


def _connector_to_document(connector: LaneConnector) -> dict[str, Any]:
    return _given(
        id=connector.id,
        from_lane=connector.from_lane,
        to_lane=connector.to_lane,
        centerline_m=_line_pairs(connector.centerline),
        width_m=connector.width_m,
        traffic_light=connector.traffic_light.value,
        turn_type=connector.turn_type.value,
        speed_limit_mps=connector.speed_limit_mps,
        left_boundary_m=_line_pairs(connector.left_boundary),
        right_boundary_m=_line_pairs(connector.right_boundary),
    )


# Private: from documents to values


def _points(pairs: list[list[float]]) -> tuple[Point, ...]:
    return tuple((x, y) for x, y in pairs)


def _line(pairs: list[list[float]] | None) -> Polyline | None:
    return None if pairs is None else Polyline(pairs)


def _agent(agent: AgentDocument) -> TrafficAgent:
    return TrafficAgent(
        id=agent.id,
        type=agent.type,
        x_m=agent.x_m,
        y_m=agent.y_m,
        heading_rad=agent.heading_rad,
        width_m=agent.width_m,
        length_m=agent.length_m,
        speed_mps=agent.speed_mps,
        lane_id=agent.lane_id,
        walk_to_m=None if agent.walk_to_m is None else (agent.walk_to_m[0], agent.walk_to_m[1]),
    )


def _lane(lane: LaneDocument) -> Lane:
    return Lane(
        id=lane.id,
        centerline=Polyline(lane.centerline_m),
        width_m=lane.width_m,
        speed_limit_mps=lane.speed_limit_mps,
        left_boundary=_line(lane.left_boundary_m),
        right_boundary=_line(lane.right_boundary_m),
        left_neighbor=lane.left_neighbor,
        right_neighbor=lane.right_neighbor,
        successors=tuple(lane.successors),
    )


def _options(options: SceneOptionsDocument) -> SceneOptions:
    place = options.goal_m
    return SceneOptions(
        density=options.density,
        goal=options.goal,
        goal_m=None if place is None else (place[0], place[1]),
    )


def _connector(connector: ConnectorDocument) -> LaneConnector:
    return LaneConnector(
        id=connector.id,
        from_lane=connector.from_lane,
        to_lane=connector.to_lane,
        centerline=Polyline(connector.centerline_m),
        width_m=connector.width_m,
        traffic_light=connector.traffic_light,
        turn_type=connector.turn_type,
        speed_limit_mps=connector.speed_limit_mps,
        left_boundary=_line(connector.left_boundary_m),
        right_boundary=_line(connector.right_boundary_m),
    )
