"""Every format that can be read, by name.

In: a path to somebody's file or folder, and where it is known the format's name. Out: its reader,
which gives a `Reading` (reading.py): a `Scene`, a `Recording` and `Note`s on what the source left
open. A new format is a class that fits `Reader`, and its entry in READERS.
"""

from __future__ import annotations

from pathlib import Path

from augment.errors import InvalidDocument, UnknownName
from augment.formats.argoverse2 import ArgoverseSensor
from augment.formats.argoverse2_motion import ArgoverseMotion
from augment.formats.commonroad.scenario import CommonRoad
from augment.formats.nuplan_log import NuPlan
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
    )
}
"""In the order in which a file is tried; each is asked about what is its own alone."""


def reader_of(name: str) -> Reader:
    """The reader of a format.

    Raises:
        UnknownName: Nobody reads that.
    """
    try:
        return READERS[name]
    except KeyError:
        raise UnknownName("source", name, list(READERS)) from None


def recognise(path: Path) -> Reader:
    """The reader of the format that a file or folder looks like.

    Raises:
        InvalidDocument: There is nothing, or it looks like none of the formats, or like several.
    """
    if not path.exists():
        raise InvalidDocument("input", [(str(path), "is not there")])
    try:
        readers = [reader for reader in READERS.values() if reader.recognises(path)]
    except OSError as fault:
        raise InvalidDocument("input", [(str(path), fault.strerror or str(fault))]) from None
    if len(readers) == 1:
        return readers[0]
    if not readers and _is_123d(path):
        text = "looks like a 123D log, which is not read (docs/formats.md says why)"
        raise InvalidDocument("input", [(str(path), text)])
    known = ", ".join(f"{reader.name}: {reader.title}" for reader in READERS.values())
    said = "none of the formats" if not readers else " and ".join(one.name for one in readers)
    raise InvalidDocument("input", [(str(path), f"looks like {said}; name one of {known}")])


def _is_123d(path: Path) -> bool:
    """A log that py123d converted has a table of its synchronised times."""
    return (path / "sync.arrow").is_file() or path.suffix == ".arrow"
