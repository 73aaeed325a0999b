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
from augment.render.marks import draw_mark, draw_way
from augment.render.palette import MarkStyle
from augment.render.road import draw_ground
from augment.render.scale import draw_grid, draw_scale, scale_box
from augment.render.signals import draw_signals
from augment.scene.entities import Scene, TrafficAgent
from augment.scene.modification import Modification, apply


def draw(
    scene: Scene, modification: Modification, camera: Camera, *, labels: bool = False
) -> bytes:
    """The scene after a change, as the bytes of a PNG.

    Args:
        scene: The scene before the change.
        modification: What changes; removed agents are gone, added and moved ones are marked.
        camera: The window that all pictures of a scenario share (`camera_for`).
        labels: Whether ids, metres and faint outlines of what is gone are drawn: for reviewers
            and analysts, never for a vote.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    ground, taken = paint_scene(scene, modification, camera, ghosts=labels)
    if labels:
        draw_labels(ground, apply(scene, modification), taken=taken)
    return ground.canvas.png()


def paint_scene(
    scene: Scene, modification: Modification, camera: Camera, *, ghosts: bool = True
) -> tuple[MetricCanvas, list[Box]]:
    """All of a picture but its labels, and the boxes in pixels that text keeps free of.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    after = apply(scene, modification)
    ground = _flat(replace(after, agents=()), camera).copy()
    draw_signals(ground, after)
    scale_px = scale_box(ground, scene)
    draw_scale(ground, scale_px)
    if ghosts:
        draw_ghosts(ground, scene, modification)
    styled = _styled(after, modification)
    # Every way lies under every mark: nobody is crossed out by somebody else's arrow.
    for paint in (draw_way, draw_mark):
        for agent, style in styled:
            paint(ground, agent, style)
    lost = [agent for agent in modification.changed if outside(ground, agent)]
    seen = [agent for agent in (after.ego, *modification.changed) if agent not in lost]
    badges = place_badges(ground, lost, seen, taken=(scale_px,))
    draw_badges(ground, badges)
    return ground, [scale_px, *(badge.box_px for badge in badges)]


@lru_cache(maxsize=2)
def _flat(scene: Scene, camera: Camera) -> MetricCanvas:
    """All that lies flat under the traffic, half of the work; nobody draws on it, only on copies.

    A job runs the contestants of a scenario one after the other. Two, because each holds 26 MB.
    """
    ground = MetricCanvas(Canvas(camera.width_px, camera.height_px, palette.PAPER), camera)
    draw_ground(ground, scene)
    draw_grid(ground)
    return ground


def _styled(after: Scene, modification: Modification) -> list[tuple[TrafficAgent, MarkStyle]]:
    """Who is drawn how, in drawing order: the traffic, the ego, what changed.

    Within each the large come first, so that a cone is never hidden under a bus.
    """
    changed = {agent.id for agent in modification.changed}
    unchanged = [agent for agent in after.agents if agent.id not in changed]
    return [
        *((agent, palette.OTHER_MARK) for agent in sorted(unchanged, key=_small_last)),
        (after.ego, palette.EGO_MARK),
        *(
            (agent, palette.CHANGED_MARK)
            for agent in sorted(modification.changed, key=_small_last)
        ),
    ]


def _small_last(agent: TrafficAgent) -> tuple[float, str]:
    return -agent.length_m * agent.width_m, agent.id
