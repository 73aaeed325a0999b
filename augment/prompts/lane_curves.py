"""The lanes that a prompt shows, under their short ids: as Bezier pieces and as they are.

What is written into a prompt and what the tool answers about both come from here, so that
"the beginning of Lane3" and its control points are the same place in either. The prompt shows
the pieces; the tool reads the recorded centreline itself.
Frame: ego frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from augment.geometry.bezier import CubicBezier, travel_pose
from augment.geometry.frames import Pose
from augment.geometry.polyline import Projection
from augment.prompts.extent import shown_spans
from augment.prompts.names import ShortNames
from augment.scene.bezier_lanes import BezierLane, bezier_lane, piece_ids, straight_curve
from augment.scene.entities import Scene
from augment.scene.lane_graph import AnyLane, LaneGraph


@dataclass(frozen=True, slots=True, kw_only=True)
class LaneCurve:
    """One lane or connector as far as it is shown.

    Attributes:
        id: Its short id.
        lane: Its pieces; s = 0 is where the shown part begins.
        whole: The whole of it, as recorded.
        begins_m: Where on its centreline the shown part begins.
        before, after: Short ids of what joins it within the shown map, straightest first.
    """

    id: str
    lane: BezierLane
    whole: AnyLane
    begins_m: float
    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()

    @property
    def width_m(self) -> float:
        """How wide it is."""
        return self.whole.width_m

    @property
    def length_m(self) -> float:
        """How long the shown part is."""
        return self.lane.length_m

    def pose_at(self, s_m: float, d_m: float = 0.0) -> Pose:
        """The place on the recorded centreline at s of the shown part, d to the left."""
        return travel_pose(self.whole.centerline, self.begins_m + s_m, d_m)

    def project(self, x_m: float, y_m: float) -> Projection:
        """The nearest place on the recorded centreline of the shown part."""
        shown = self.whole.centerline.between(self.begins_m, self.begins_m + self.length_m)
        return shown.project(x_m, y_m)

    @property
    def pieces(self) -> tuple[str, ...]:
        """How its pieces are called, in order of travel."""
        return piece_ids(self.id, len(self.lane.pieces))


def lane_curves(scene: Scene, names: ShortNames, radius_m: float) -> dict[str, LaneCurve]:
    """All lanes and connectors that a prompt shows, by short id, in the order of the scene."""
    graph = LaneGraph(scene)
    spans = shown_spans(scene, radius_m)
    begins = {key for key, (start_m, _) in spans.items() if start_m < 1e-6}
    ends = {
        key
        for key, (_, end_m) in spans.items()
        if end_m > graph.lanes[key].centerline.length_m - 1e-6
    }

    def shown(ids: Iterable[str], among: set[str]) -> tuple[str, ...]:
        return tuple(names.lanes[lane_id] for lane_id in ids if lane_id in among)

    return {
        names.lanes[key]: LaneCurve(
            id=names.lanes[key],
            lane=bezier_lane(graph.lanes[key].centerline.between(*span)),
            whole=graph.lanes[key],
            begins_m=span[0],
            before=shown(graph.predecessors(key) if key in begins else (), ends),
            after=shown(graph.successors(key) if key in ends else (), begins),
        )
        for key, span in spans.items()
    }


def control_points(lane: BezierLane) -> list[list[list[float]]]:
    """The control points [x, y] of each piece, to the centimetre, ready for JSON.

    Four, or of a straight piece its two ends.
    """
    return [
        np.add(np.round(piece.curve.control_m[:: 3 if piece.is_straight else 1], 2), 0.0).tolist()
        for piece in lane.pieces
    ]


def curve_from(points: Sequence[Sequence[float]]) -> CubicBezier:
    """The curve of control points as the prompt writes them, four, or two of a straight one.

    Raises:
        ValueError: They are neither, or no curve.
    """
    return straight_curve(*points) if len(points) == 2 else CubicBezier(points)
