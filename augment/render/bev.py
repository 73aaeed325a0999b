"""The bird's-eye view: one renderer for every picture of a scene, whoever changed it.

In: a `Scene`, a `Modification` (an empty one draws the scene as it is) and a `Camera`. Out: the
bytes of a PNG.

A voting picture carries no text but its scale and the distances at its edge, and its bytes depend
on the scene, the change and the camera alone. Pictures with ids are for reviewers and researchers,
never for a vote.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from augment.render import palette, road
from augment.render.camera import Camera, Inset
from augment.render.canvas import Box, Canvas, stack_png
from augment.render.labels import draw_badges, draw_ghosts, draw_labels, place_badges
from augment.render.legend import draw_legend
from augment.render.marks import SMALL, draw_mark, draw_motion, draw_trails, draw_walks
from augment.render.palette import MarkStyle
from augment.render.shapes import sides
from augment.scene import entities
from augment.scene.entities import AnyLane, Modification, Scene, TrafficAgent
from augment.scene.motion import find_trails
from augment.scene.recording import Recording

NEAR_M = 8.0
"""Lanes this near to something changed are named for reviewers, and lie over the boxes."""
SMALL_PX = 60.0
"""What is shorter than this in the picture is shown enlarged, too: a car at 12 px/m."""

# How many times narrower an enlarged window is at least, else there is none.
_LEAST_GAIN = 1.4
_AROUND_M = 7.0
_LEAST_WIDTH_M = 20.0
# Width to height of an enlarged window.
_CLOSER_RATIO = 1.5


def draw(
    scene: Scene, modification: Modification, camera: Camera, recording: Recording | None = None
) -> bytes:
    """Draw the scene after a change, as the bytes of a PNG.

    Args:
        scene: The scene before the change.
        modification: What changes; removed agents are gone, added and moved ones are marked.
        camera: The window that all pictures of a scenario share (`camera_for`).
        recording: What was recorded after t0: by it motions set out.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    ground, _ = _paint_scene(scene, modification, camera, recording, ghosts=False)
    return ground.png()


@lru_cache(maxsize=4)
def draw_empty(scene: Scene, camera: Camera) -> bytes:
    """Draw what stays while everybody moves: road, goal, lights and scale, nobody on it."""
    corner = road.scale_corner(scene, camera)
    return _still(replace(scene, agents=()), camera, corner).png()


def draw_for_review(scene: Scene, modification: Modification, camera: Camera) -> tuple[bytes, ...]:
    """Draw one picture with ids, lanes over the boxes and a legend, or two: the change enlarged.

    Args:
        scene: The scene before the change, under the ids that the reviewer knows.
        modification: What is reviewed.
        camera: The window of the first picture.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    closer = _closer(modification, camera)
    cameras = [camera] if closer is None else [camera, closer]
    pictures = []
    for window in cameras:
        ground, taken = _paint_scene(scene, modification, window)
        near = lanes_near(scene, modification.changed)
        for lane in near:
            _draw_over_boxes(ground, scene, lane)
        # The scale stays readable; what crosses it is to be seen in the rest of the picture.
        road.draw_scale(ground, road.scale_box(window, road.scale_corner(scene, window)))
        draw_labels(
            ground,
            entities.apply(scene, modification),
            taken=taken,
            first=tuple(agent.id for agent in modification.changed),
            named=tuple(lane.id for lane in near),
        )
        legend = draw_legend(scene, modification, window.width_px)
        pictures.append(stack_png(ground, legend))
    return tuple(pictures)


def lanes_near(scene: Scene, agents: tuple[TrafficAgent, ...]) -> list[AnyLane]:
    """Return the lanes and connectors near one of the agents, the nearest first."""
    gaps_m = {
        lane.id: min(
            (lane.centerline.project(agent.x_m, agent.y_m).distance_m for agent in agents),
            default=np.inf,
        )
        for lane in scene.ways
    }
    near = [lane for lane in scene.ways if gaps_m[lane.id] <= NEAR_M]
    return sorted(near, key=lambda lane: (gaps_m[lane.id], lane.id))


# --- The scene ---------------------------------------------------------------------------------


def _paint_scene(
    scene: Scene,
    modification: Modification,
    camera: Camera,
    recording: Recording | None = None,
    *,
    ghosts: bool = True,
) -> tuple[Canvas, list[Box]]:
    """Draw all of a picture but its labels; return the boxes in pixels that text keeps free of."""
    after = entities.apply(scene, modification)
    changed = {agent.id for agent in modification.changed}
    rest = replace(after, agents=tuple(agent for agent in after.agents if agent.id not in changed))
    # The scale keeps away from who was there before the change, the same for every contestant.
    corner = road.scale_corner(scene, camera)
    ground = _draw_unchanged(rest, camera, corner).copy()
    if ghosts:
        draw_ghosts(ground, scene, modification)
    trails = find_trails(scene, modification, recording, with_held=camera.is_filmed)
    draw_trails(ground, trails)
    _paint(ground, [(agent, palette.CHANGED_MARK) for agent in modification.changed])
    scale_px = road.scale_box(camera, corner)
    taken = (scale_px, camera.inset.box_px) if camera.inset else (scale_px,)
    badges = place_badges(ground, after.ego, modification.changed, taken)
    draw_badges(ground, badges)
    if camera.inset is not None:
        _draw_inset(ground, rest, modification, camera.inset)
    return ground, [scale_px, *(badge.box_px for badge in badges)]


def _draw_inset(ground: Canvas, rest: Scene, modification: Modification, inset: Inset) -> None:
    """Draw a part once more, enlarged, and a frame round it at its place."""
    window = inset.camera
    closer = _draw_unchanged(rest, window, None).copy()
    _paint(closer, [(agent, palette.CHANGED_MARK) for agent in modification.changed])
    (low, high) = (window.x_min_m, window.y_min_m), (window.x_max_m, window.y_max_m)
    corners = [low, (high[0], low[1]), high, (low[0], high[1])]
    ground.stroke(ground.px(np.array(corners)), palette.INK, 1.5, closed=True)
    ground.paste(closer, inset.box_px)


@lru_cache(maxsize=4)
def _draw_unchanged(rest: Scene, camera: Camera, corner: road.Corner | None) -> Canvas:
    """Draw everything that a change leaves as it is; nobody draws on it, only on copies."""
    ground = _still(rest, camera, corner)
    traffic = [(agent, palette.OTHER_MARK) for agent in rest.agents]
    _paint(ground, [*traffic, (rest.ego, palette.EGO_MARK)])
    return ground


def _still(rest: Scene, camera: Camera, corner: road.Corner | None) -> Canvas:
    """Draw all but who is there, on a surface of its own; the scale where it has a corner."""
    ground = _flat(replace(rest, agents=()), camera).copy()
    road.draw_goal(ground, rest)
    road.draw_signals(ground, rest)
    road.draw_ticks(ground, rest)
    if corner is not None:
        road.draw_scale(ground, road.scale_box(camera, corner))
    return ground


@lru_cache(maxsize=4)
def _flat(scene: Scene, camera: Camera) -> Canvas:
    """Draw all that lies flat under the traffic; nobody draws on it, only on copies.

    A job runs the contestants of a scenario one after the other; each of these holds 4 MB.
    """
    ground = Canvas(camera, road.beyond_road(scene))
    road.draw_ground(ground, scene)
    return ground


def _paint(ground: Canvas, styled: list[tuple[TrafficAgent, MarkStyle]]) -> None:
    """Draw motions, then vehicles, then walks, which cross what is parked, then people and cones.

    The ego comes after the traffic; of the rest the large come first, so that nothing small is
    hidden.
    """

    def order(entry: tuple[TrafficAgent, MarkStyle]) -> tuple[bool, float, str]:
        agent = entry[0]
        is_ego = agent.type is entities.AgentType.EGO_VEHICLE
        return is_ego, -agent.length_m * agent.width_m, agent.id

    ordered = sorted(styled, key=order)
    for agent, style in ordered:
        draw_motion(ground, agent, style)
    for agent, style in ordered:
        if agent.type not in SMALL:
            draw_mark(ground, agent, style)
    draw_walks(ground, ordered)
    for agent, style in ordered:
        if agent.type in SMALL:
            draw_mark(ground, agent, style)


# --- For reviewers -----------------------------------------------------------------------------


def _draw_over_boxes(ground: Canvas, scene: Scene, lane: AnyLane) -> None:
    """Draw the dashed centre once more, above what stands on it, and a connector's edges."""
    colour = palette.OWN_LANE if lane.id == scene.ego.lane_id else palette.OTHER_LANE
    if isinstance(lane, entities.LaneConnector):
        colour = palette.CONNECTOR
        for side in sides(lane):
            ground.draw_dashes(ground.px(side), palette.INK, 1.2, 2.0, 4.0)
    line = ground.px(lane.centerline.points_m)
    ground.draw_dashes(line, palette.PAPER, 3.6, 7.0, 8.0)
    ground.draw_dashes(line, colour, 1.8, 7.0, 8.0)


def _closer(modification: Modification, camera: Camera) -> Camera | None:
    """Return a window around what was changed, None where nothing would be gained."""
    seen = [agent for agent in modification.changed if camera.shows(agent.box.corners_m)]
    sizes_px = [max(agent.length_m, agent.width_m) * camera.px_per_m for agent in seen]
    longest_px = min(sizes_px, default=SMALL_PX)
    if longest_px >= SMALL_PX:
        return None
    points = np.vstack([agent.box.corners_m for agent in seen])
    # (2,) each, around all corners (4 N, 2) of what was changed.
    low, high = points.min(axis=0) - _AROUND_M, points.max(axis=0) + _AROUND_M
    width_m = float(max(high[0] - low[0], (high[1] - low[1]) * _CLOSER_RATIO, _LEAST_WIDTH_M))
    if (camera.x_max_m - camera.x_min_m) / width_m < _LEAST_GAIN:
        return None
    middle, half = (low + high) / 2.0, np.array([width_m, width_m / _CLOSER_RATIO]) / 2.0
    return Camera.over(middle - half, middle + half, camera.width_px / width_m)
