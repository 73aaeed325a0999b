"""The recorded log that several tests read, each of its frames once."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from augment.formats.argoverse2.sensor import ArgoverseSensor
from augment.scene.entities import Scene
from augment.scene.recording import Recording

LOG = Path("av2_sensor") / "7fab2350-7eaf-3b7e-a39d-6937a4c1bede"


@cache
def recorded(realdata: Path, frame: int = 0) -> tuple[Scene, Recording]:
    """What everybody shares and nobody changes."""
    reading = ArgoverseSensor().read(realdata / LOG, item=None, frame=frame, name="recorded")
    assert reading.recording is not None
    return reading.scene, reading.recording
