"""ScenarioNet's data set folders: a summary, a mapping and a file for each scenario.

    dataset_summary.pkl  file name -> what the scenario is
    dataset_mapping.pkl  file name -> the folder that it lies in, from here

A folder with files and no summary is one too.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from augment.errors import InvalidDocument
from augment.formats.scenarionet.unpickling import WHAT, read_pickle

SUMMARY, MAPPING = "dataset_summary.pkl", "dataset_mapping.pkl"
ENDING = ".pkl"
MOST_NAMED = 12
_SCENARIOS = "sd_*.pkl"


def is_data_set(path: Path) -> bool:
    """Whether a folder looks like one."""
    return path.is_dir() and ((path / SUMMARY).is_file() or any(path.glob(_SCENARIOS)))


def names_in(folder: Path) -> list[str]:
    """The file names of all scenarios, in the summary's order, else in the alphabet's.

    Raises:
        InvalidDocument: There is none, or the summary breaks its format.
    """
    if (folder / SUMMARY).is_file():
        names = [name for name in _table(folder / SUMMARY) if name.endswith(ENDING)]
    else:
        names = sorted(file.name for file in folder.glob(_SCENARIOS))
    if not names:
        raise InvalidDocument(WHAT, [(str(folder), "holds no scenario")])
    return names


def file_in(folder: Path, item: str | None) -> Path:
    """The file of one scenario.

    Args:
        folder: The data set.
        item: A file name, or its number from 0; None for the first.

    Raises:
        InvalidDocument: There is none such, or it would lie outside of the folder and those
            beside it.
    """
    name = item if item is not None and item.endswith(ENDING) else _name_at(folder, item)
    place: Any = ""
    if (folder / MAPPING).is_file():
        place = _table(folder / MAPPING).get(name, "")
    if not isinstance(place, str) or "\0" in place + name or Path(name).name != name:
        raise InvalidDocument(WHAT, [(MAPPING, f"{name[:60]!r} has no folder")])
    file = (folder / place / name).resolve()
    if not file.is_relative_to(folder.resolve().parent):
        raise InvalidDocument(WHAT, [(MAPPING, f"{name[:60]!r} lies outside of the data set")])
    if not file.is_file():
        raise InvalidDocument(WHAT, [("item", f"{name[:60]!r} is not in {folder}")])
    return file


# Private


def _name_at(folder: Path, item: str | None) -> str:
    names = names_in(folder)
    if item is None:
        return names[0]
    if item.isdecimal() and len(item) < 10 and int(item) < len(names):
        return names[int(item)]
    known = ", ".join(names[:MOST_NAMED])
    text = f"{item[:60]!r} is neither a file here nor a number from 0 to {len(names) - 1}; {known}"
    raise InvalidDocument(WHAT, [("item", text)])


def _table(file: Path) -> dict[str, Any]:
    found = read_pickle(file)
    if not isinstance(found, dict) or not all(isinstance(key, str) for key in found):
        raise InvalidDocument(WHAT, [(file.name, "is no dictionary of file names")])
    return found
