"""Pictures of scenarios and augmentations, stored once under the hash of their bytes."""

from __future__ import annotations

import hashlib

import numpy as np
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from numpy.typing import NDArray

from augment.models import Scenario
from augment.render.bev import draw
from augment.render.camera import Camera, camera_for
from augment.render.shrunken import shrink
from augment.scene.entities import Scene
from augment.scene.modification import Modification
from augment.services.scenarios.scenes import reference_of, scene_of

FOLDER = "bev"


def window_of(name: str) -> str:
    """The key of the camera that a picture was drawn with, "" where its name has none.

    Pictures of one scenario stand side by side only where this is the same.
    """
    parts = name.split("/")
    return parts[1] if len(parts) == 3 and parts[0] == FOLDER else ""


def original_picture(scenario: Scenario) -> str:
    """The name of the picture before any change; drawn where there is none in today's window.

    Call it from a worker, not in a request.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    kept, scene = scenario.original_image, scene_of(scenario)
    key = camera_for(scene, reference_of(scenario)).key
    if kept and window_of(kept) == key and default_storage.exists(kept):
        return kept
    name = picture_of(scenario, scene, Modification())
    Scenario.objects.filter(pk=scenario.pk).update(original_image=name)
    scenario.original_image = name
    return name


def camera_of(scenario: Scenario) -> Camera:
    """The window that all pictures of a scenario show.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    return camera_for(scene_of(scenario), reference_of(scenario))


def picture_of(scenario: Scenario, scene: Scene, modification: Modification) -> str:
    """The name of the picture after a change.

    Args:
        scenario: Whose reference decides on the camera, the same for every contestant.
        scene: The scene before the change.
        modification: The change.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    camera = camera_for(scene, reference_of(scenario))
    return store(draw(scene, modification, camera), folder=f"{FOLDER}/{camera.key}")


def shrunken_picture(name: str, widest: int) -> NDArray[np.uint8] | None:
    """The colours (H, W, 3) of a stored picture, no wider than so many pixels; None without it."""
    if not name or not default_storage.exists(name):
        return None
    with default_storage.open(name) as file:
        return shrink(file.read(), widest)


def store(png: bytes, *, folder: str = FOLDER) -> str:
    """The name under which these bytes are kept, <folder>/<sha256>.png; written only if absent."""
    name = f"{folder}/{hashlib.sha256(png).hexdigest()}.png"
    store_as(name, png)
    return name


def store_as(name: str, png: bytes) -> None:
    """Keep these bytes under a name that belongs to them alone; written if absent or cut off.

    Several workers may do so at once: what is kept is whole at every moment, and always the same.
    """
    if default_storage.exists(name) and default_storage.size(name) == len(png):
        return
    default_storage.save(name, ContentFile(png))
