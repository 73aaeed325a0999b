"""Pictures of scenarios and augmentations, stored once under the hash of their bytes."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.db import transaction
from numpy.typing import NDArray

from augment.models import Scenario
from augment.render.bev import draw
from augment.render.camera import Camera, camera_for
from augment.render.shrunken import shrink
from augment.scene.codec import modification_from_document
from augment.scene.entities import Modification, Scene
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
    kept, camera = scenario.original_image, camera_of(scenario)
    if kept and window_of(kept) == camera.key and default_storage.exists(kept):
        return kept
    scene = scene_of(scenario)
    name = picture_of(scene, Modification(), camera)
    noted = {camera.key: {"image": name, "view": view_of(camera)}}
    before = camera_for(scene, reference_of(scenario))
    if window_of(kept) == before.key:  # of before windows were noted
        noted |= {before.key: {"image": kept, "view": view_of(before)}}
    with transaction.atomic():
        held = Scenario.objects.select_for_update(no_key=True).only("windows").get(pk=scenario.pk)
        scenario.windows = held.windows | noted
        scenario.original_image = name
        scenario.save(update_fields=["original_image", "windows"])
    return name


def camera_of(scenario: Scenario) -> Camera:
    """Return the window that all pictures of a scenario show, as its contestants are today.

    Raises:
        InvalidDocument: The stored scene or a modification can't be read.
    """
    answered = scenario.augmentations.exclude(modification=None).order_by("pk")
    documents = answered.values_list("modification", flat=True)
    changes = tuple(modification_from_document(document) for document in documents if document)
    return camera_for(scene_of(scenario), reference_of(scenario), changes)


def view_of(camera: Camera) -> dict[str, Any]:
    """Return where metres lie in a picture: px_per_m, ego_px [x, y], width, height (pixels)."""
    ego = camera.to_pixels(np.zeros((1, 2)))[0]
    return {
        "px_per_m": camera.px_per_m,
        "ego_px": [float(ego[0]), float(ego[1])],
        "width": camera.width_px,
        "height": camera.height_px,
    }


def picture_of(scene: Scene, modification: Modification, camera: Camera) -> str:
    """Draw a scene after a change and return the picture's name.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
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
