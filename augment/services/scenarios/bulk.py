"""Many scenarios from one file, all of them or none.

In: rows of a CSV or YAML file. Out: stored scenarios; or every error with the row it is in.
"""

from __future__ import annotations

import csv
import io
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from django.contrib.auth.models import User
from django.core.files.base import File
from django.db import transaction

from augment.errors import AugmentError, Conflict, InvalidDocument
from augment.formats.documents import MAX_CHARACTERS, read_json, read_yaml_file
from augment.models import Scenario
from augment.scene.codec import modification_from_document, modification_to_document
from augment.services.scenarios.scenes import add_scenario, read_circumstances
from augment.services.scenarios.uploads import plain_name

WHAT = "list of scenarios"
NEEDED = ("scene", "type", "instruction")
OPTIONAL = ("slug", "type_label", "keep_traffic", "density", "goal", "reference", "intent")
MOST_ROWS = 10_000
MOST_ROWS_AT_ONCE = 300
"""On a page: adding them holds the database for some seconds."""
_YES_NO = {
    "": False,
    "no": False,
    "false": False,
    "0": False,
    "yes": True,
    "true": True,
    "1": True,
}


def read_rows(file: Path) -> list[dict[str, Any]]:
    """The rows of a file by its ending: .csv with a line of names, or .yaml with a list.

    Raises:
        InvalidDocument: It is neither, or can't be read.
    """
    if file.suffix.lower() in (".yaml", ".yml"):
        found = read_yaml_file(file, what=WHAT)
    elif file.suffix.lower() == ".csv":
        found = _csv_rows(file)
    else:
        raise InvalidDocument(WHAT, [(file.name, "its name must end in .csv, .yaml or .yml")])
    if not isinstance(found, list) or not all(isinstance(row, dict) for row in found):
        raise InvalidDocument(WHAT, [("", "a list of mappings is needed")])
    if not 1 <= len(found) <= MOST_ROWS:
        raise InvalidDocument(WHAT, [("", f"{len(found)} rows; 1 to {MOST_ROWS} are read")])
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class RowReport:
    """What became of one row.

    Attributes:
        number: From 1.
        slug: Of its scenario, empty where there is none.
        problems: The columns that are wrong, and why; an empty name is the whole row.
    """

    number: int
    slug: str = ""
    problems: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class BulkReport:
    """What became of a file: all of its rows were added, or none.

    Attributes:
        is_kept: Whether they were.
    """

    rows: tuple[RowReport, ...]
    is_kept: bool

    @property
    def faults(self) -> tuple[RowReport, ...]:
        """The rows that can't be added."""
        return tuple(row for row in self.rows if row.problems)


def report_rows(
    rows: list[dict[str, Any]], *, folder: Path, keeps: bool, actor: User | None = None
) -> BulkReport:
    """Add the scenarios of these rows, all or none, and say of each what became of it.

    Args:
        rows: As `add_scenarios` takes them.
        folder: In which the files lie that they name.
        keeps: False to try only: nothing is added then.
        actor: Who adds them.
    """
    with transaction.atomic():
        reports = [_report(number, row, folder, actor)[0] for number, row in enumerate(rows, 1)]
        is_kept = keeps and not any(one.problems for one in reports)
        transaction.set_rollback(not is_kept)
    return BulkReport(rows=tuple(reports), is_kept=is_kept)


@transaction.atomic
def add_scenarios(
    rows: list[dict[str, Any]], *, folder: Path, actor: User | None = None
) -> list[Scenario]:
    """The scenarios of these rows, in their order.

    Args:
        rows: With NEEDED, and OPTIONAL where it is known; `reference` and `intent` name files.
        folder: In which those lie.
        actor: Who adds them.

    Raises:
        InvalidDocument: With every error and its row, counted from 1; nothing was added.
    """
    found = [_report(number, row, folder, actor) for number, row in enumerate(rows, start=1)]
    problems = [
        (f"row {report.number}.{path}" if path else f"row {report.number}", text)
        for report, _ in found
        for path, text in report.problems
    ]
    if problems:
        raise InvalidDocument(WHAT, problems)
    return [made for _, made in found if made is not None]


# --- Private -----------------------------------------------------------------------------------


def _report(
    number: int, row: dict[str, Any], folder: Path, actor: User | None
) -> tuple[RowReport, Scenario | None]:
    """One row in a transaction of its own within that of the file."""
    try:
        with transaction.atomic():
            made = add_scenario(**_read(row, folder), actor=actor)
    except InvalidDocument as error:
        problems = tuple((path, str(text)) for path, text in error.problems)
        return RowReport(number=number, problems=problems), None
    except AugmentError as error:
        return RowReport(number=number, problems=(("", str(error)),)), None
    return RowReport(number=number, slug=made.slug), made


def _csv_rows(file: Path) -> list[dict[str, Any]]:
    try:
        if file.stat().st_size > MAX_CHARACTERS:
            raise InvalidDocument(WHAT, [(file.name, f"at most {MAX_CHARACTERS} bytes are read")])
        text = file.read_text(encoding="utf-8-sig")
    except OSError as fault:
        raise InvalidDocument(WHAT, [(file.name, fault.strerror or "can't be read")]) from None
    except UnicodeDecodeError as fault:
        raise InvalidDocument(WHAT, [(file.name, f"is not UTF-8: {fault.reason}")]) from None
    try:
        reader = csv.DictReader(io.StringIO(text, newline=""), strict=True)
        return [{str(name): value for name, value in row.items()} for row in reader]
    except csv.Error as fault:
        raise InvalidDocument(WHAT, [(file.name, f"is no CSV: {fault}")]) from None


def _read(row: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """A row as `add_scenario` takes it."""
    known = (*NEEDED, *OPTIONAL)
    problems = [
        (name, f"is no column; there are {', '.join(known)}") for name in row if name not in known
    ]
    given = {name: value for name, value in row.items() if value not in (None, "")}
    problems += [(name, "is missing") for name in NEEDED if name not in given]
    problems += [
        (name, f"{value!r} must be text")
        for name, value in given.items()
        if name != "keep_traffic" and not isinstance(value, str)
    ]
    circumstances = None
    try:
        circumstances = read_circumstances(
            *(str(given.pop(name, "")) for name in ("density", "goal"))
        )
    except InvalidDocument as error:
        problems += error.problems
    keep = str(given.pop("keep_traffic", "")).strip().lower()
    if keep not in _YES_NO:
        problems.append(("keep_traffic", f"{keep!r} must be yes or no"))
    if problems:
        raise InvalidDocument("scenario", problems)
    if "reference" in given:
        change = modification_from_document(_document(given["reference"], folder, "modification"))
        given["reference"] = modification_to_document(change)
    if "intent" in given:
        given["intent"] = _document(given["intent"], folder, "intent")
    return given | {"keep_traffic": _YES_NO[keep], "circumstances": circumstances}


def _document(name: str, folder: Path, what: str) -> object:
    """The JSON of a file beside the list; nothing outside of that folder is opened."""
    if not (folder / name).resolve().is_relative_to(folder.resolve()):
        raise InvalidDocument(what, [(name, "lies outside of the folder of the list")])
    return read_json(folder / name, what=what)


MOST_FILES = 500


def add_from_files(
    table: File[bytes], documents: Sequence[File[bytes]], *, keeps: bool, actor: User | None = None
) -> BulkReport:
    """Add the scenarios of a list, all or none, and say of each what became of it.

    Args:
        table: A CSV or YAML file.
        documents: The JSON files that it names, at most `MOST_FILES`.
        keeps: False to try only: nothing is added then.
        actor: Who adds them.

    Raises:
        InvalidDocument: The list can't be read.
        Conflict: It has too many rows to be waited for.
    """
    with tempfile.TemporaryDirectory(prefix="arena-bulk-") as name:
        folder = Path(name)
        for one in documents:
            write_plain(one, folder)
        rows = read_rows(write_plain(table, folder))
        if len(rows) > MOST_ROWS_AT_ONCE:
            raise Conflict(
                f"{len(rows)} rows are too many for a page, at most {MOST_ROWS_AT_ONCE}: use "
                "manage.py add_scenario --file."
            )
        return report_rows(rows, folder=folder, keeps=keeps, actor=actor)


def write_plain(file: File[bytes], folder: Path) -> Path:
    """The file in the folder, under a name without folders."""
    path = folder / plain_name(file.name or "")
    with path.open("wb") as written:
        for piece in file.chunks():
            written.write(piece)
    return path
