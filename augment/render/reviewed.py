"""The pictures that reviewers look at: the scene with ids, lanes over the boxes and a legend.

The first shows the whole window. Where what was changed is small in it, a second shows the change
enlarged. Never for a vote. Frame: ego frame.
"""

from __future__ import annotations

import numpy as np

from augment.render import palette
from augment.render.bev import paint_scene
from augment.render.camera import Camera
from augment.render.canvas import MetricCanvas, stack_png
from augment.render.labels import draw_labels
from augment.render.legend import draw_legend
from augment.render.scale import draw_scale, scale_box, scale_corner
from augment.render.shapes import sides
from augment.scene.entities import LaneConnector, Modification, Scene, TrafficAgent, apply
from augment.scene.lane_graph import AnyLane

NEAR_M = 8.0
"""Lanes this near to something changed are named, and lie over the boxes."""
SMALL_PX = 60.0
"""What is shorter than this in the picture is shown enlarged, too: a car at 12 px/m."""

_LEAST_GAIN = 1.4
_AROUND_M = 7.0
_LEAST_WIDTH_M = 20.0


def draw_for_review(scene: Scene, modification: Modification, camera: Camera) -> tuple[bytes, ...]:
    """One picture as a PNG, or two where the change is small in the first.

    Args:
        scene: The scene before the change, under the ids that the reviewer knows.
        modification: What is reviewed.
        camera: The window of the first picture.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    cameras = [camera]
    closer = _closer(modification, camera)
    if closer is not None:
        cameras.append(closer)
    return tuple(_drawn(scene, modification, one) for one in cameras)


def lanes_near(scene: Scene, agents: tuple[TrafficAgent, ...]) -> list[AnyLane]:
    """The lanes and connectors near one of the agents, the nearest first."""
    lanes: list[AnyLane] = [*scene.lanes, *scene.connectors]
    near = []
    for lane in lanes:
        gap_m = min(
            (lane.centerline.project(one.x_m, one.y_m).distance_m for one in agents),
            default=np.inf,
        )
        if gap_m <= NEAR_M:
            near.append((gap_m, lane.id, lane))
    return [lane for _, _, lane in sorted(near, key=lambda one: one[:2])]


# Private


def _drawn(scene: Scene, modification: Modification, camera: Camera) -> bytes:
    ground, taken = paint_scene(scene, modification, camera)
    near = lanes_near(scene, modification.changed)
    for lane in near:
        _over_boxes(ground, scene, lane)
    # The scale stays readable; what crosses it is to be seen in the rest of the picture.
    draw_scale(ground, scale_box(camera, scale_corner(scene, camera)))
    draw_labels(
        ground,
        apply(scene, modification),
        taken=taken,
        first=tuple(agent.id for agent in modification.changed),
        named=tuple(lane.id for lane in near),
    )
    return stack_png(ground.canvas, draw_legend(scene, modification, camera.width_px))


def _over_boxes(ground: MetricCanvas, scene: Scene, lane: AnyLane) -> None:
    """The dashed centre once more, above what stands on it, and the edges of a connector."""
    if isinstance(lane, LaneConnector):
        colour = palette.CONNECTOR
        for side in sides(lane):
            ground.canvas.dashed(ground.camera.to_pixels(side), palette.INK, 1.2, 2.0, 4.0)
    else:
        colour = palette.OWN_LANE if lane.id == scene.ego.lane_id else palette.OTHER_LANE
    line = ground.camera.to_pixels(lane.centerline.points_m)
    ground.canvas.dashed(line, palette.PAPER, 3.6, 7.0, 8.0)
    ground.canvas.dashed(line, colour, 1.8, 7.0, 8.0)


def _closer(modification: Modification, camera: Camera) -> Camera | None:
    """A window around what was changed within the picture, None where nothing would be gained."""
    seen = [agent for agent in modification.changed if camera.shows(agent.box.corners_m)]
    if not seen:
        return None
    longest_px = min(max(agent.length_m, agent.width_m) for agent in seen) * camera.px_per_m
    if longest_px >= SMALL_PX:
        return None
    points = np.vstack([agent.box.corners_m for agent in seen])
    low, high = points.min(axis=0) - _AROUND_M, points.max(axis=0) + _AROUND_M
    shape = camera.width_px / camera.height_px
    width_m = max(high[0] - low[0], (high[1] - low[1]) * shape, _LEAST_WIDTH_M)
    if (camera.x_max_m - camera.x_min_m) / width_m < _LEAST_GAIN:
        return None
    x_m, y_m = (low + high) / 2.0
    return Camera(
        x_min_m=float(x_m - width_m / 2.0),
        x_max_m=float(x_m + width_m / 2.0),
        y_min_m=float(y_m - width_m / shape / 2.0),
        y_max_m=float(y_m + width_m / shape / 2.0),
        px_per_m=camera.width_px / width_m,
    )
