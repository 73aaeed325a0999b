"""Scenes and modifications as JSON documents and back, exactly.

What can't be read raises `InvalidDocument` and names every place; what is written can be read.
Frame: ego frame of the scene.
"""

from __future__ import annotations

from typing import Any

from pydantic import TypeAdapter

from augment.errors import InvalidDocument
from augment.scene.codec import modification_problems, scene_problems
from augment.scene.entities import Modification, Scene
from augment.scene.schema import read, write

SCENE_FORMAT = "scenario-arena/scene"
MODIFICATION_FORMAT = "scenario-arena/modification"

_SCENE, _MODIFICATION = TypeAdapter(Scene), TypeAdapter(Modification)


def scene_to_document(scene: Scene) -> dict[str, Any]:
    """The scene as a JSON document; fields without a value are left out.

    Raises:
        InvalidDocument: The scene breaks a rule of the format, so nobody could read it again.
    """
    document = write(scene, _SCENE, format_name=SCENE_FORMAT)
    scene_from_document(document)
    return document


def scene_from_document(document: object) -> Scene:
    """The scene that a JSON document describes.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    scene = read(document, _SCENE, what="scene", format_name=SCENE_FORMAT)
    problems = list(scene_problems(scene))
    if problems:
        raise InvalidDocument("scene", problems)
    return scene


def modification_to_document(modification: Modification) -> dict[str, Any]:
    """The modification as a JSON document; fields without a value are left out.

    Raises:
        InvalidDocument: The modification breaks a rule of the format.
    """
    document = write(modification, _MODIFICATION, format_name=MODIFICATION_FORMAT)
    modification_from_document(document)
    return document


def modification_from_document(document: object) -> Modification:
    """The modification that a JSON document describes; whether it fits a scene is not asked here.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    what = "modification"
    change = read(document, _MODIFICATION, what=what, format_name=MODIFICATION_FORMAT)
    problems = list(modification_problems(change))
    if problems:
        raise InvalidDocument(what, problems)
    return change
