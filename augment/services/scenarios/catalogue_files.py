"""The files of a catalogue, read and held against each other: scenes by name, scenarios on them.

A folder holds `scenes/<name>.json` and `scenarios/<slug>.json`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from augment.errors import InvalidDocument, InvalidModification
from augment.formats.documents import read_json
from augment.scene.codec import CatalogueEntry, entry_from_document, scene_from_document
from augment.scene.entities import CatalogueSet, Scene, without_traffic
from augment.services.scenarios.scenes import check_reference, check_slug

Read = TypeVar("Read")
Problems = list[tuple[str, str]]


def folder_of(folder: Path, one: CatalogueSet) -> Path:
    """Where the files of a set lie within a catalogue's folder."""
    return folder if one is CatalogueSet.PAPER else folder / one.value


def read_catalogue(folder: Path) -> tuple[dict[str, Scene], list[CatalogueEntry]]:
    """The scenes by name and the scenarios of a folder, each fitting its scene.

    Raises:
        InvalidDocument: The folder holds no catalogue, or files break their format or do not
            fit together; every problem names its file and the path inside it.
    """
    problems: Problems = []
    scenes = {
        name: scene
        for name, scene in _read_files(folder / "scenes", "scene", scene_from_document, problems)
        if _is_named(f"scenes/{name}.json", "name", name, scene.name, problems)
    }
    entries = [
        entry
        for name, entry in _read_files(
            folder / "scenarios", "scenario", entry_from_document, problems
        )
        if _is_named(f"scenarios/{name}.json", "slug", name, entry.slug, problems)
    ]
    if not (scenes or entries or problems):
        problems.append((str(folder), "holds no scenes/*.json and no scenarios/*.json"))
    for entry in entries:
        _check_fits(entry, scenes, problems)
    if problems:
        raise InvalidDocument("catalogue", problems)
    return scenes, entries


# Private


def _read_files(
    folder: Path, what: str, parse: Callable[[object], Read], problems: Problems
) -> list[tuple[str, Read]]:
    """What the files of a folder hold, by their names; what can't be read becomes problems."""
    found = []
    for file in sorted(folder.glob("*.json")):
        try:
            found.append((file.stem, parse(read_json(file, what=what))))
        except InvalidDocument as fault:
            at = f"{folder.name}/{file.name}"
            problems += [(f"{at}: {path}" if path else at, text) for path, text in fault.problems]
    return found


def _is_named(at: str, key: str, name: str, given: str, problems: Problems) -> bool:
    try:
        check_slug(given, what="catalogue")
    except InvalidDocument as fault:
        problems += [(f"{at}: {key}", text) for _, text in fault.problems]
        return False
    if given != name:
        problems.append(
            (f"{at}: {key}", f"expected {name!r} as the file is called, got {given!r}")
        )
        return False
    return True


def _check_fits(entry: CatalogueEntry, scenes: dict[str, Scene], problems: Problems) -> None:
    at = f"scenarios/{entry.slug}.json"
    scene = scenes.get(entry.scene)
    if scene is None:
        known = ", ".join(scenes) or "none"
        problems.append((f"{at}: scene", f"{entry.scene!r} is not in the folder; known: {known}"))
        return
    try:
        check_reference(scene if entry.keep_traffic else without_traffic(scene), entry.reference)
    except InvalidModification as fault:
        problems.append((f"{at}: reference", str(fault)))
    except InvalidDocument as fault:
        problems += [(f"{at}: reference.{path}", text) for path, text in fault.problems]
