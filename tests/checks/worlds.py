"""Small worlds for the checks: the catalogue's references, and scenes moved as one body."""

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np

from augment.checks import Finding, FindingKind, Severity, findings
from augment.geometry.frames import Pose
from augment.geometry.polyline import Polyline
from augment.scene.codec import modification_from_document, scene_from_document
from augment.scene.entities import (
    Area,
    Lane,
    LaneConnector,
    Modification,
    Point,
    Scene,
    TrafficAgent,
    without_traffic,
)
from tests.scenes import pose_in_parent

W = TypeVar("W", Lane, LaneConnector)

FIXTURES = Path(__file__).parents[2] / "fixtures"


class Reference(NamedTuple):
    """A scenario of the catalogue: its scene as experts see it, and what belongs into it."""

    slug: str
    scene: Scene
    modification: Modification


def references() -> list[Reference]:
    found = []
    for file in sorted((FIXTURES / "scenarios").glob("*.json")):
        document = json.loads(file.read_text())
        text = (FIXTURES / "scenes" / f"{document['scene']}.json").read_text()
        scene = scene_from_document(json.loads(text))
        shown = scene if document["keep_traffic"] else without_traffic(scene)
        reference = modification_from_document(document["reference"])
        found.append(Reference(document["slug"], shown, reference))
    return found


def found_in(scene: Scene, *added: TrafficAgent) -> tuple[Finding, ...]:
    return findings(scene, Modification(added=added))


def of_kind(found: Iterable[Finding], kind: FindingKind) -> list[Finding]:
    return [finding for finding in found if finding.kind is kind]


def severities(found: Iterable[Finding]) -> set[tuple[FindingKind, Severity]]:
    """What speaks against a modification: the kinds that are more than facts."""
    return {(one.kind, one.severity) for one in found if one.severity is not Severity.FACT}


def moved_scene(scene: Scene, frame: Pose) -> Scene:
    """The whole scene, ego included, carried from the origin to `frame`."""
    return replace(
        scene,
        ego=moved_agent(scene.ego, frame),
        agents=tuple(moved_agent(agent, frame) for agent in scene.agents),
        lanes=tuple(_moved_way(lane, frame) for lane in scene.lanes),
        connectors=tuple(_moved_way(connector, frame) for connector in scene.connectors),
        areas=tuple(_moved_area(area, frame) for area in scene.areas),
    )


def moved_agent(agent: TrafficAgent, frame: Pose) -> TrafficAgent:
    pose = pose_in_parent(frame, agent.pose)
    walk_to_m = None if agent.walk_to_m is None else _moved_points([agent.walk_to_m], frame)[0]
    return replace(
        agent, x_m=pose.x_m, y_m=pose.y_m, heading_rad=pose.heading_rad, walk_to_m=walk_to_m
    )


def _moved_way(lane: W, frame: Pose) -> W:
    return replace(
        lane,
        centerline=_moved_line(lane.centerline, frame),
        left_boundary=lane.left_boundary and _moved_line(lane.left_boundary, frame),
        right_boundary=lane.right_boundary and _moved_line(lane.right_boundary, frame),
    )


def _moved_line(line: Polyline, frame: Pose) -> Polyline:
    return Polyline(frame.to_parent(line.points_m))


def _moved_area(area: Area, frame: Pose) -> Area:
    return replace(area, boundary_m=tuple(_moved_points(area.boundary_m, frame)))


def _moved_points(points: Iterable[Point], frame: Pose) -> list[Point]:
    return [(float(x), float(y)) for x, y in frame.to_parent(np.array(list(points)))]
