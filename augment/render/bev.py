"""The bird's-eye view: one renderer for every picture of a scene, whoever changed it.

In: a `Scene`, a `Modification` (an empty one draws the scene as it is) and a `Camera`. Out: the
bytes of a PNG.

A voting picture carries no text but its scale and the distances at its edge, and its bytes depend
on the scene, the change and the camera alone.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from augment.render import palette
from augment.render.camera import Camera
from augment.render.canvas import Box, Canvas, MetricCanvas
from augment.render.edges import draw_badges, outside, place_badges
from augment.render.labels import draw_ghosts, draw_labels
from augment.render.marks import draw_mark, draw_motion, draw_walks, is_small
from augment.render.palette import MarkStyle
from augment.render.road import beyond_road, draw_ground
from augment.render.scale import Corner, draw_grid, draw_scale, scale_box, scale_corner
from augment.render.signals import draw_goal, draw_signals
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent, apply


def draw(
    scene: Scene, modification: Modification, camera: Camera, *, labels: bool = False
) -> bytes:
    """The scene after a change, as the bytes of a PNG.

    Args:
        scene: The scene before the change.
        modification: What changes; removed agents are gone, added and moved ones are marked.
        camera: The window that all pictures of a scenario share (`camera_for`).
        labels: Whether ids, metres and faint outlines of what is gone are drawn, for reviewers
            and analysts, never for a vote; such a picture has half as many pixels each way.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    ground, taken = paint_scene(scene, modification, camera, ghosts=labels)
    if labels:
        draw_labels(ground, apply(scene, modification), taken=taken)
    return ground.canvas.png(halved=labels)


def paint_scene(
    scene: Scene, modification: Modification, camera: Camera, *, ghosts: bool = True
) -> tuple[MetricCanvas, list[Box]]:
    """All of a picture but its labels, and the boxes in pixels that text keeps free of.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    after = apply(scene, modification)
    changed = {agent.id for agent in modification.changed}
    rest = replace(after, agents=tuple(one for one in after.agents if one.id not in changed))
    # The scale keeps away from who was there before the change, the same for every contestant.
    corner = scale_corner(scene, camera)
    ground = _unchanged(rest, camera, corner).copy()
    if ghosts:
        draw_ghosts(ground, scene, modification)
    _paint(ground, [(agent, palette.CHANGED_MARK) for agent in modification.changed])
    lost = [agent for agent in modification.changed if outside(ground, agent)]
    seen = [agent for agent in (after.ego, *modification.changed) if agent not in lost]
    scale_px = scale_box(camera, corner)
    badges = place_badges(ground, lost, seen, taken=(scale_px,))
    draw_badges(ground, badges)
    return ground, [scale_px, *(badge.box_px for badge in badges)]


@lru_cache(maxsize=4)
def _unchanged(rest: Scene, camera: Camera, corner: Corner) -> MetricCanvas:
    """Everything that a change leaves as it is; nobody draws on it, only on copies."""
    ground = _flat(replace(rest, agents=()), camera).copy()
    draw_goal(ground, rest)
    draw_signals(ground, rest)
    draw_scale(ground, scale_box(camera, corner))
    traffic = [(agent, palette.OTHER_MARK) for agent in rest.agents]
    _paint(ground, [*traffic, (rest.ego, palette.EGO_MARK)])
    return ground


@lru_cache(maxsize=4)
def _flat(scene: Scene, camera: Camera) -> MetricCanvas:
    """All that lies flat under the traffic; nobody draws on it, only on copies.

    A job runs the contestants of a scenario one after the other; each of these holds 4 MB.
    """
    ground = MetricCanvas(Canvas(camera.width_px, camera.height_px, beyond_road(scene)), camera)
    draw_ground(ground, scene)
    draw_grid(ground)
    return ground


def _paint(ground: MetricCanvas, styled: list[tuple[TrafficAgent, MarkStyle]]) -> None:
    """Motions, then vehicles, then walks, which cross what is parked, then people and cones.

    The ego comes after the traffic; of the rest the large come first, so that nothing small is
    hidden.
    """
    ordered = sorted(styled, key=lambda one: _small_last(one[0]))
    for agent, style in ordered:
        draw_motion(ground, agent, style)
    for agent, style in ordered:
        if not is_small(agent):
            draw_mark(ground, agent, style)
    draw_walks(ground, ordered)
    for agent, style in ordered:
        if is_small(agent):
            draw_mark(ground, agent, style)


def _small_last(agent: TrafficAgent) -> tuple[bool, float, str]:
    return agent.type is AgentType.EGO_VEHICLE, -agent.length_m * agent.width_m, agent.id
