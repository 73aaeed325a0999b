"""Scenarios of one kind for whole rounds: a car parked so far ahead on a street of our own."""

import json
import re
from pathlib import Path
from typing import Any

from augment.scene.codec import (
    intent_from_document,
    intent_to_document,
    modification_to_document,
    scene_to_document,
)
from augment.scene.entities import Modification, Scene
from augment.scene.intent import Intent, LaneChoice, Length, Relation, Spot, VehicleRequest
from tests.scenes import scene, vehicle

TYPE = "nudge_around_parked_vehicle"
WISH = re.compile(r"A parked car stands (\d+) m ahead of the ego\.")


def wish(ahead_m: int) -> str:
    return f"A parked car stands {ahead_m} m ahead of the ego."


def asked(ahead_m: int) -> dict[str, Any]:
    """What the wish asks for."""
    length = Length(low_m=float(ahead_m), high_m=float(ahead_m))
    spot = Spot(distance=length, relation=Relation.AHEAD, lane=LaneChoice.OWN)
    request = VehicleRequest(spot=spot, speed_mps=0.0, count=1)
    return intent_to_document(Intent(requests=(request,)))


def reference(ahead_m: int) -> dict[str, Any]:
    return modification_to_document(Modification(added=(vehicle("Agent2", float(ahead_m), -0.7),)))


def known(instruction: str) -> list[tuple[Scene, Intent]]:
    """What the stand-in's models know of an instruction."""
    found = WISH.search(instruction)
    return [] if found is None else [(scene(), intent_from_document(asked(int(found[1]))))]


def write_street(folder: Path) -> Path:
    """The scene as a file."""
    path = folder / "street.json"
    path.write_text(json.dumps(scene_to_document(scene())))
    return path
