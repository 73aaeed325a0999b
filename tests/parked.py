"""Scenarios of one kind for whole rounds: a car parked so far ahead on a street of our own."""

import json
import re
from pathlib import Path
from typing import Any

from augment.scene.codec import intent_to_document, modification_to_document, scene_to_document
from augment.scene.entities import Modification, Scene
from augment.scene.intent import Body, Intent
from tests.intents import parked
from tests.scenes import scene, vehicle

TYPE = "nudge_around_parked_vehicle"
WISH = re.compile(r"A parked car stands (\d+) m ahead of the ego\.")


def wish(ahead_m: int) -> str:
    return f"A parked car stands {ahead_m} m ahead of the ego."


def asked(ahead_m: int) -> dict[str, Any]:
    """What the wish asks for."""
    return intent_to_document(parked(float(ahead_m), body=Body.VEHICLE))


def reference(ahead_m: int) -> dict[str, Any]:
    return modification_to_document(Modification(added=(vehicle("Agent2", float(ahead_m), -0.7),)))


def known(instruction: str) -> list[tuple[Scene, Intent]]:
    """What the stand-in's models know of an instruction."""
    found = WISH.search(instruction)
    return [(scene(), parked(float(found[1]), body=Body.VEHICLE))] if found else []


def write_street(folder: Path) -> Path:
    """The scene as a file."""
    path = folder / "street.json"
    path.write_text(json.dumps(scene_to_document(scene())))
    return path
