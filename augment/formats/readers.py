"""Every format that can be read, by name.

In: a path to somebody's file or folder, and where it is known the format's name. Out: its reader,
which gives a `Reading` (reading.py): a `Scene`, a `Recording` and sentences on what the source
left open. A new format is a class that fits `Reader`, and its entry in READERS.
"""

from pathlib import Path

from augment.errors import InvalidDocument, check_names
from augment.formats.argoverse2 import ArgoverseMotion, ArgoverseSensor
from augment.formats.commonroad.scenario import CommonRoad
from augment.formats.nuplan_log import NuPlan
from augment.formats.opendrive.reader import OpenDrive
from augment.formats.openscenario.scenario import OpenScenario
from augment.formats.own_json import OwnJson
from augment.formats.reading import Reader
from augment.formats.scenarionet.scenario import ScenarioNet
from augment.formats.waymo.scenario import WaymoMotion

READERS: dict[str, Reader] = {
    reader.name: reader
    for reader in (
        ArgoverseSensor(),
        OwnJson(),
        CommonRoad(),
        WaymoMotion(),
        NuPlan(),
        ScenarioNet(),
        ArgoverseMotion(),
        OpenScenario(),
        OpenDrive(),
    )
}
"""In the order in which a file is tried; each is asked about what is its own alone."""


def find_reader(name: str) -> Reader:
    """The reader of a format.

    Raises:
        UnknownName: Nobody reads that.
    """
    check_names("source", [name], READERS)
    return READERS[name]


def recognise(path: Path) -> Reader:
    """Return the reader of the format that a file or folder looks like.

    Raises:
        InvalidDocument: There is nothing, or it looks like none of the formats, or like several.
    """
    if not path.exists():
        raise InvalidDocument("input", [(str(path), "is not there")])
    return find_input(path, list(READERS.values()), is_deep=False)[0]


def find_input(path: Path, readers: list[Reader], *, is_deep: bool) -> tuple[Reader, Path]:
    """Return the reader and its input: the path, or a file in it.

    Args:
        path: A file or folder.
        readers: Who may read it.
        is_deep: Whether it may lie in the folder, level by level.

    Raises:
        InvalidDocument: Nothing is in one of the formats, or several things are.
    """
    level, others = [path], list[tuple[Reader, Path]]()
    while level:
        recognised = [
            (reader, candidate)
            for candidate in sorted(level)
            for reader in readers
            if reader.recognises(candidate)
        ]
        others += [match for match in recognised if match[0].goes_with_others]
        folders = [candidate for candidate in level if is_deep and candidate.is_dir()]
        level = [below for folder in folders for below in folder.iterdir()]
        matches = [match for match in recognised if not match[0].goes_with_others]
        matches = matches or ([] if level else others)
        if len(matches) == 1:
            return matches[0]
        if matches:
            names = [
                f"{candidate.relative_to(path.parent)} ({reader.name})"
                for reader, candidate in matches[:5]
            ]
            text = f"holds {len(matches)} recordings, one is needed: {', '.join(names)}"
            raise InvalidDocument("input", [("", text)])
    formats = ", ".join(f"{reader.name}: {reader.title}" for reader in readers)
    raise InvalidDocument("input", [(str(path), f"looks like none of the formats: {formats}")])
