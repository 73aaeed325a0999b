"""The lanes that a prompt shows, as Bezier pieces under their short ids.

What is written into a prompt and what the tool answers about both come from here, so that
"the beginning of Lane3" and its control points are the same place in either.
Frame: ego frame.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from augment.geometry.polyline import Polyline
from augment.prompts.clip import line_within
from augment.prompts.names import ShortNames
from augment.scene.bezier_lanes import BezierLane, bezier_lane, piece_ids
from augment.scene.entities import Scene
from augment.scene.lane_graph import AnyLane, LaneGraph


@dataclass(frozen=True, slots=True, kw_only=True)
class LaneCurve:
    """One lane or connector as far as it is shown.

    Attributes:
        id: Its short id.
        lane: Its pieces; s = 0 is where the shown part begins.
        before, after: Short ids of what joins it within the shown map, straightest first.
    """

    id: str
    lane: BezierLane
    width_m: float
    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()

    @property
    def pieces(self) -> tuple[str, ...]:
        """How its pieces are called, in order of travel."""
        return piece_ids(self.id, len(self.lane.pieces))


def lane_curves(scene: Scene, names: ShortNames, radius_m: float) -> dict[str, LaneCurve]:
    """All lanes and connectors within the radius, by short id, in the order of the scene."""
    graph = LaneGraph(scene)
    lines = {
        lane.id: line
        for lane in graph.lanes.values()
        if (line := line_within(lane.centerline, radius_m)) is not None
    }
    begins = {key for key, line in lines.items() if _meets(line, graph.lanes[key], 0)}
    ends = {key for key, line in lines.items() if _meets(line, graph.lanes[key], -1)}

    def shown(ids: Iterable[str], among: set[str]) -> tuple[str, ...]:
        return tuple(names.lanes[lane_id] for lane_id in ids if lane_id in among)

    return {
        names.lanes[key]: LaneCurve(
            id=names.lanes[key],
            lane=bezier_lane(line),
            width_m=graph.lanes[key].width_m,
            before=shown(graph.predecessors(key) if key in begins else (), ends),
            after=shown(graph.successors(key) if key in ends else (), begins),
        )
        for key, line in lines.items()
    }


def control_points(lane: BezierLane) -> list[list[list[float]]]:
    """The four control points [x, y] of each piece, to the centimetre, ready for JSON."""
    return [np.add(np.round(control, 2), 0.0).tolist() for control in lane.control_m]


def _meets(line: Polyline, lane: AnyLane, end: int) -> bool:
    """Whether the shown part reaches that end of the whole."""
    return bool(np.abs(line.points_m[end] - lane.centerline.points_m[end]).max() < 1e-6)
