"""The recorded log that several tests read, each of its frames once, and every other source."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

from augment.formats.argoverse2 import ArgoverseSensor
from augment.formats.readers import READERS, recognise
from augment.scene.entities import Scene
from augment.scene.recording import Recording

LOG = Path("av2_sensor") / "7fab2350-7eaf-3b7e-a39d-6937a4c1bede"


@cache
def recorded(realdata: Path, frame: int = 0) -> tuple[Scene, Recording]:
    """What everybody shares and nobody changes."""
    reading = ArgoverseSensor().read(realdata / LOG, item=None, frame=frame, name="recorded")
    assert reading.recording is not None
    return reading.scene, reading.recording


def recorded_moments(realdata: Path, *, every_s: float) -> Iterator[tuple[str, Scene]]:
    """The scenes of every recorded source with the title of its format, from its first moment."""
    for path in sorted(realdata.glob("*/*")):
        if any(reader.recognises(path) for reader in READERS.values()):
            reader = recognise(path)
            for at in reader.moments(path, every_s=every_s):
                scene = reader.read(path, item=at.item, frame=at.frame, name="recorded").scene
                yield reader.title, scene
