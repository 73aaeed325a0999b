"""Scenarios as ScenarioNet's dictionaries, one pickle each, with a data set's two index files.

The pickle carries numpy's names of before its version 2, so that older stacks read it too; writing
it imports and runs nothing of theirs. Frame: the ego frame of t0. Sources: the published
description of the format in MetaDrive's `scenario_description.py` and `type.py`.
"""

import pickle
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import shapely

from augment.formats import writing
from augment.formats.writing import Cell, LossReport
from augment.scene import entities
from augment.scene.entities import AgentType, AreaKind, Lane, LaneConnector, Scene, TrafficLight
from augment.scene.lane_graph import LaneGraph, classify_turn
from augment.scene.motion import Movement

VERSION = "scenario-arena 1"
DATASET = "scenario_arena"
SUMMARY_FILE, MAPPING_FILE = "dataset_summary.pkl", "dataset_mapping.pkl"

_TYPES = {
    AgentType.EGO_VEHICLE: "VEHICLE",
    AgentType.VEHICLE: "VEHICLE",
    AgentType.BUS: "VEHICLE",
    AgentType.BICYCLE: "CYCLIST",
    AgentType.PEDESTRIAN: "PEDESTRIAN",
    AgentType.TRAFFIC_CONE: "TRAFFIC_CONE",
    AgentType.BARRIER: "TRAFFIC_BARRIER",
    AgentType.CONSTRUCTION_SIGN: "TRAFFIC_OBJECT",
    AgentType.GENERIC_OBJECT: "TRAFFIC_OBJECT",
}
_BECOMES = {
    kind: f"a {kind} becomes a {_TYPES[kind]}"
    for kind in (AgentType.BUS, AgentType.CONSTRUCTION_SIGN)
}
_AREAS = {AreaKind.CROSSWALK: "CROSSWALK", AreaKind.WALKWAY: "ROAD_EDGE_SIDEWALK"}
_HEIGHTS_M = {
    AgentType.PEDESTRIAN: 1.789,
    AgentType.BUS: 3.0,
    AgentType.TRAFFIC_CONE: 0.5,
    AgentType.BARRIER: 1.0,
}
_HEIGHT_M = 1.777
_BESIDE_M = 0.3
"""The edges of neighbours lie no further apart."""


def write(cells: Sequence[Cell]) -> writing.Output:
    """A data set: a file for each cell, the summary and the mapping."""
    summaries: dict[str, dict[str, Any]] = {}

    def write_one(cell: Cell, report: LossReport) -> dict[str, bytes]:
        document = describe(cell, report)
        name = f"sd_{DATASET}_1_{cell.stem}.pkl"
        summaries[name] = document["metadata"]
        return {name: write_pickle(document)}

    made = writing.write_each(cells, write_one)
    index = {
        SUMMARY_FILE: write_pickle(summaries),
        MAPPING_FILE: write_pickle(dict.fromkeys(summaries, "")),
    }
    return replace(made, files=made.files | index)


def describe(cell: Cell, report: LossReport) -> dict[str, Any]:
    """One scenario as ScenarioNet's dictionary."""
    scene, motion = cell.after, cell.motion
    steps = len(motion.times_s)
    _report(cell, report)
    return {
        "id": cell.stem,
        "version": VERSION,
        "length": steps,
        "metadata": {
            "id": cell.stem,
            "scenario_id": cell.stem,
            "dataset": DATASET,
            "metadrive_processed": False,
            "coordinate": "right-handed",
            "ts": motion.times_s.copy(),
            "sdc_id": scene.ego.id,
            "current_time_index": 0,
            "traffic_side": scene.traffic_side.value,
            "provenance": scene.provenance,
        },
        "tracks": {
            movement.agent.id: _track(movement) for movement in (motion.ego, *motion.others)
        },
        "dynamic_map_states": {
            connector.id: _light(connector, steps)
            for connector in scene.connectors
            if connector.traffic_light is not TrafficLight.NONE
        },
        "map_features": _map_features(scene),
    }


def write_pickle(document: object) -> bytes:
    """The pickle, its names those of numpy 1."""
    # Protocol 3 writes the module of a name as text, so that another can be put in its place.
    packed = pickle.dumps(document, protocol=3)
    return packed.replace(b"cnumpy._core.multiarray\n", b"cnumpy.core.multiarray\n")


# Private


def _report(cell: Cell, report: LossReport) -> None:
    scene, connectors = cell.after, cell.after.connectors
    writing.report_motion(cell, report)
    report.lose_types(_BECOMES)
    text = "left out: there is no type for a {} area"
    report.lose_areas([area for area in scene.areas if area.kind not in _AREAS], text)
    odd = [way.id for way in connectors if way.turn_type is not classify_turn(way.centerline)]
    report.lose_of(odd, "the turn type is not said, and the line looks otherwise")
    dark = [way.id for way in connectors if way.traffic_light is TrafficLight.NONE]
    report.lose_of(dark, "that it has no light is not said")
    if any(way.left_boundary or way.right_boundary for way in scene.ways):
        report.lose("the edges of lanes are written as outlines, not as a left and a right one")
    if scene.traffic_side is entities.TrafficSide.LEFT:
        report.lose("that people drive on the left stands in the metadata, where few stacks look")
    report.lose("heights are not known; those usual for the types are written")
    report.lose("the origin in the source's own frame is not written; the ego's place at t0 is 0")


def _track(movement: Movement) -> dict[str, Any]:
    agent, present = movement.agent, movement.is_present
    states = np.where(present[:, None], movement.states, 0.0)
    z = np.zeros((len(states), 1))
    way = np.column_stack([np.cos(states[:, 2]), np.sin(states[:, 2])])
    if writing.keeps_heading(agent):
        steps_m = np.gradient(states[:, :2], axis=0)
        way = steps_m / np.maximum(np.hypot(*steps_m.T), 1e-9)[:, None]
    height_m = _HEIGHTS_M.get(agent.type, _HEIGHT_M)
    return {
        "type": _TYPES[agent.type],
        "state": {
            "position": np.hstack([states[:, :2], z]),
            "heading": states[:, 2].copy(),
            "velocity": states[:, 3:] * way,
            "valid": present,
            "length": np.where(present, agent.length_m, 0.0),
            "width": np.where(present, agent.width_m, 0.0),
            "height": np.where(present, height_m, 0.0),
        },
        "metadata": {"type": _TYPES[agent.type], "object_id": agent.id, "dataset": DATASET},
    }


def _light(connector: LaneConnector, steps: int) -> dict[str, Any]:
    start = connector.centerline.points_m[0]
    return {
        "type": "TRAFFIC_LIGHT",
        "state": {"object_state": [f"TRAFFIC_LIGHT_{connector.traffic_light.name}"] * steps},
        "lane": connector.id,
        "stop_point": np.array([*start]),  # MetaDrive takes two of three, ScenarioMax two alone
        "metadata": {"type": "TRAFFIC_LIGHT", "object_id": connector.id, "dataset": DATASET},
    }


def _map_features(scene: Scene) -> dict[str, dict[str, Any]]:
    graph = LaneGraph(scene)
    features: dict[str, dict[str, Any]] = {}
    for way in scene.ways:
        points_m, (left, right) = way.centerline.points_m, writing.way_edges(way)
        beside = (way.left_neighbor, way.right_neighbor) if isinstance(way, Lane) else (None, None)
        features[way.id] = {
            "type": "LANE_SURFACE_STREET" if isinstance(way, Lane) else "LANE_SURFACE_UNSTRUCTURE",
            "polyline": np.column_stack([points_m, np.zeros(len(points_m))]),
            "polygon": np.vstack([left.points_m, right.points_m[::-1]]),
            "width": np.tile([way.width_m / 2.0] * 2, (len(points_m), 1)),
            "entry_lanes": list(graph.predecessors(way.id)),
            "exit_lanes": list(graph.successors(way.id)),
            "left_neighbor": [name for name in beside[:1] if name],
            "right_neighbor": [name for name in beside[1:] if name],
        }
        if way.speed_limit_mps is not None:
            features[way.id]["speed_limit_kmh"] = way.speed_limit_mps * 3.6
    for number, points_m in enumerate(_road_edges(scene), start=1):
        line = np.column_stack([points_m, np.zeros(len(points_m))])
        features[f"Edge{number}"] = {"type": "ROAD_EDGE_BOUNDARY", "polyline": line}
    for area in scene.areas:
        if area.kind in _AREAS:
            ring = np.array([*area.boundary_m], dtype=np.float64)
            features[area.id] = {"type": _AREAS[area.kind], "polygon": ring}
    return features


def _road_edges(scene: Scene) -> Iterator[np.ndarray]:
    """The edges of lanes (P, 2) where no other lane or connector lies beside or across them."""
    sides = [[edge.points_m for edge in writing.way_edges(way)] for way in scene.ways]
    outlines = [shapely.Polygon(np.vstack([left, right[::-1]])) for left, right in sides]
    covers = shapely.buffer(shapely.make_valid(outlines), _BESIDE_M)
    tree = shapely.STRtree(covers)
    for number, lines in enumerate(sides):
        near = [covers[other] for other in tree.query(covers[number]) if other != number]
        for line in lines:
            edge = shapely.difference(shapely.LineString(line), shapely.union_all(near))
            yield from (
                part
                for part in map(shapely.get_coordinates, shapely.get_parts(edge))
                if len(part) > 1
            )
