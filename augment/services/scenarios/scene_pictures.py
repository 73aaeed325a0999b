"""Pictures of scenes and references for pages, drawn by workers before anything was generated.

A picture's name says what is on it, so that one that no longer fits is never shown: another one is
drawn under another name.
"""

from __future__ import annotations

import hashlib
import json
from enum import StrEnum

from django.core.files.storage import default_storage

from augment.models import BaseScene, Scenario
from augment.render.bev import draw
from augment.render.camera import AROUND_THE_EGO, LOOK, camera_for
from augment.scene.codec import scene_from_document
from augment.scene.entities import Modification, without_traffic
from augment.services.scenarios.pictures import redraw, store_as
from augment.services.scenarios.scenes import content_hash, reference_of, scene_key, scene_of

FOLDER = "scenes"


class SceneView(StrEnum):
    """What a picture of a scene shows."""

    KEPT = "kept"  # with the recorded traffic
    CLEARED = "cleared"  # the ego alone
    BACKDROP = "backdrop"  # the ego alone, from far: others are placed on it


def scene_picture(row: BaseScene, view: SceneView) -> str:
    """The name of a scene's picture, whether it is drawn yet or not."""
    content = row.content_hash or content_hash(row.document)
    key = AROUND_THE_EGO.key if view is SceneView.BACKDROP else str(LOOK)
    return f"{FOLDER}/{content}-{key}-{view.value}.png"


def reference_picture(scenario: Scenario) -> str:
    """The name of the picture of a scenario's reference; empty where it has none."""
    if scenario.reference is None:
        return ""
    shown = [LOOK, scene_key(scenario), scenario.reference]
    digest = hashlib.sha256(json.dumps(shown, sort_keys=True).encode()).hexdigest()
    return f"references/{digest}.png"


def is_drawn(name: str) -> bool:
    """Whether a worker has drawn the picture of that name."""
    return bool(name) and default_storage.exists(name)


def draw_scene(scene_pk: int) -> None:
    """What a worker does: every picture of a scene that is not drawn yet.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    row = BaseScene.objects.defer("recording").get(pk=scene_pk)
    missing = [view for view in SceneView if not is_drawn(scene_picture(row, view))]
    if not missing:
        return
    scene = scene_from_document(row.document)
    for view in missing:
        shown = scene if view is SceneView.KEPT else without_traffic(scene)
        camera = AROUND_THE_EGO if view is SceneView.BACKDROP else camera_for(scene, None)
        store_as(scene_picture(row, view), draw(shown, Modification(), camera))


def draw_scenario(scenario_pk: int) -> None:
    """What a worker does: a scenario before any change, and with its reference.

    Raises:
        InvalidDocument: The stored scene or reference can't be read.
        InvalidModification: They do not fit together.
    """
    row = Scenario.objects.select_related("base_scene").get(pk=scenario_pk)
    draw_scene(row.base_scene_id)
    redraw(row)
    name, reference = reference_picture(row), reference_of(row)
    if reference is None or is_drawn(name):
        return
    scene = scene_of(row)
    store_as(name, draw(scene, reference, camera_for(scene, reference)))
