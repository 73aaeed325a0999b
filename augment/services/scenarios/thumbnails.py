"""Stored pictures made smaller, whole or cut to what an augmentation changes."""

import numpy as np
from django.core.files.storage import default_storage

from augment.models import Augmentation
from augment.render.camera import Camera
from augment.render.canvas import Box, shrink_png
from augment.scene import codec
from augment.scene.entities import TrafficAgent
from augment.services.scenarios.pictures import camera_key, load_camera, store_as
from augment.services.scenarios.scenes import LoadedScenario

THUMBNAILS = "thumbnails"
WIDTHS_PX = (400, 800)
"""How wide they are at most: for a cell of a grid, and for one of a gallery; twice that on fine
screens."""
# Raised whenever the same picture is made smaller in another way.
_LOOK = 1
_MARGIN_M, _LEAST_M, _ASPECT = 6.0, 24.0, 3 / 2
"""Around a change; width at least; width by height."""


def shrink(name: str, widest_px: int, changed: Augmentation | None = None) -> str:
    """Return the name of a stored picture made smaller, "" where there is no such picture.

    Args:
        name: Of the picture.
        widest_px: Its width at most.
        changed: The augmentation that it shows, to cut it to what that changes.

    Raises:
        InvalidDocument: What is stored of the augmentation can't be read.
    """
    part = f"-{changed.code}" if changed else ""
    small = f"{THUMBNAILS}/{_LOOK}-{widest_px}{part}/{name}"
    if not name or default_storage.exists(small):
        return small if name else ""
    if not default_storage.exists(name):
        return ""
    box = _find_change(changed) if changed else None
    with default_storage.open(name) as file:
        store_as(small, shrink_png(file.read(), widest_px, box))
    return small


def find_box(agents: list[TrafficAgent], camera: Camera) -> Box:
    """Return the box of a picture about these agents, in shares of its width and height."""
    points_m = [(agent.x_m, agent.y_m) for agent in agents]
    points_m += [agent.walk_to_m for agent in agents if agent.walk_to_m is not None]
    reach_m = _MARGIN_M + max(max(agent.size_m) for agent in agents) / 2.0
    centres_px = camera.to_pixels(np.array(points_m))  # (N, 2)
    low, high = centres_px.min(axis=0), centres_px.max(axis=0)
    size = high - low + 2.0 * reach_m * camera.px_per_m
    width = max(size[0], size[1] * _ASPECT, _LEAST_M * camera.px_per_m)
    whole = np.array((camera.width_px, camera.height_px))
    size = np.minimum((width, width / _ASPECT), whole)
    # As near to the middle of the change as the picture's edges let it be.
    corner = np.clip((low + high - size) / 2.0, 0.0, whole - size)
    shares = np.concatenate((corner, corner + size)) / np.tile(whole, 2)
    left, upper, right, lower = shares.round(4).tolist()
    return left, upper, right, lower


def _find_change(row: Augmentation) -> Box | None:
    """Return the box about what is changed; None for nothing, or for a window of before."""
    camera = load_camera(row.scenario)
    if camera.key != camera_key(row.image) or not row.modification:
        return None
    change = codec.modification_from_document(row.modification)
    before = LoadedScenario(row.scenario).scene.agents if change.removed else ()
    agents = [*change.changed, *(agent for agent in before if agent.id in change.removed)]
    return find_box(agents, camera) if agents else None
