"""The project's own JSON: a scene as it is stored."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from augment.errors import InvalidDocument
from augment.formats.json_file import read_json
from augment.formats.reading import Moment, Reading
from augment.scene.codec import SCENE_FORMAT, scene_from_document


class OwnJson:
    """The reader of a scene document."""

    name = "json"
    title = "scene in the own JSON (file)"

    def recognises(self, path: Path) -> bool:
        """A JSON file that names the format."""
        if path.suffix.lower() != ".json" or not path.is_file():
            return False
        with path.open("rb") as file:
            return SCENE_FORMAT.encode() in file.read(10_000)

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """The one."""
        yield Moment()

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene under another name."""
        if frame:
            raise InvalidDocument("scene", [("frame", f"a JSON scene has frame 0, not {frame}")])
        if item is not None:
            raise InvalidDocument("scene", [("item", f"a JSON scene has no parts, not {item!r}")])
        scene = scene_from_document(read_json(path, what="scene"))
        return Reading(scene=replace(scene, name=name), recording=None)
