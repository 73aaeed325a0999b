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
from augment.formats.documents import read_json, read_text_file, read_yaml
from augment.services.scenarios.scenes import add_scenario
from augment.services.scenarios.uploads import plain_name

WHAT = "list of scenarios"
NEEDED = ("scene", "type", "instruction")
OPTIONAL = ("slug", "keep_traffic", "density", "goal", "reference", "intent")
MOST_ROWS = 10_000
MOST_ROWS_AT_ONCE = 300
"""On a page: adding them holds the database for some seconds."""
MOST_FILES = 500
_NO, _YES = ("", "no", "false", "0"), ("yes", "true", "1")
PARTS = {"reference": "modification", "intent": "intent"}
"""Columns that name a file, and what is in it."""


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


def read_rows(file: Path) -> list[dict[str, Any]]:
    """Return the rows of a file by its ending: .csv with a line of names, or .yaml with a list.

    Raises:
        InvalidDocument: It is neither, or can't be read.
    """
    ending = file.suffix.lower()
    if ending not in (".csv", ".yaml", ".yml"):
        raise InvalidDocument(WHAT, [(file.name, "its name must end in .csv, .yaml or .yml")])
    text = read_text_file(file, what=WHAT)
    if ending == ".csv":
        try:
            reader = csv.DictReader(io.StringIO(text, newline=""), strict=True)
            rows: object = [{str(name): value for name, value in row.items()} for row in reader]
        except csv.Error as fault:
            raise InvalidDocument(WHAT, [(file.name, f"is no CSV: {fault}")]) from None
    else:
        rows = read_yaml(text, what=WHAT)
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InvalidDocument(WHAT, [("", "a list of mappings is needed")])
    if not 1 <= len(rows) <= MOST_ROWS:
        raise InvalidDocument(WHAT, [("", f"{len(rows)} rows; 1 to {MOST_ROWS} are read")])
    return rows


def add_from_files(
    table: File[bytes], documents: Sequence[File[bytes]], *, keeps: bool, actor: User | None = None
) -> BulkReport:
    """Add the scenarios of a list that somebody sent; see `add_rows`.

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
        for one in (*documents, table):
            with (folder / plain_name(one.name or "")).open("wb") as written:
                written.writelines(one.chunks())
        rows = read_rows(folder / plain_name(table.name or ""))
        if len(rows) > MOST_ROWS_AT_ONCE:
            raise Conflict(
                f"{len(rows)} rows are too many for a page, at most {MOST_ROWS_AT_ONCE}: use "
                "manage.py add_scenario --file."
            )
        return add_rows(rows, folder=folder, keeps=keeps, actor=actor)


def add_rows(
    rows: list[dict[str, Any]], *, folder: Path, keeps: bool = True, actor: User | None = None
) -> BulkReport:
    """Add the scenarios of these rows, all or none, and say of each what became of it.

    Args:
        rows: With NEEDED, and OPTIONAL where it is known; `reference` and `intent` name files.
        folder: In which those lie.
        keeps: False to try only: nothing is added then.
        actor: Who adds them.
    """
    with transaction.atomic():
        reports = [_add(number, row, folder, actor) for number, row in enumerate(rows, start=1)]
        is_kept = keeps and not any(one.problems for one in reports)
        transaction.set_rollback(not is_kept)
    return BulkReport(rows=tuple(reports), is_kept=is_kept)


def _add(number: int, row: dict[str, Any], folder: Path, actor: User | None) -> RowReport:
    """Add one row in a transaction of its own within that of the file."""
    try:
        with transaction.atomic():
            made = add_scenario(**_read(row, folder), actor=actor)
    except InvalidDocument as error:
        problems = tuple((path, str(text)) for path, text in error.problems)
        return RowReport(number=number, problems=problems)
    except AugmentError as error:
        return RowReport(number=number, problems=(("", str(error)),))
    return RowReport(number=number, slug=made.slug)


def _read(row: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """A row as `add_scenario` takes it."""
    known = ", ".join((*NEEDED, *OPTIONAL))
    given = {name: value for name, value in row.items() if value not in (None, "")}
    problems = [
        (name, f"is no column; there are {known}")
        for name in row
        if name not in (*NEEDED, *OPTIONAL)
    ]
    problems += [(name, "is missing") for name in NEEDED if name not in given]
    problems += [
        (name, f"{value!r} must be text")
        for name, value in given.items()
        if name != "keep_traffic" and not isinstance(value, str)
    ]
    keep = str(given.get("keep_traffic", "")).strip().lower()
    if keep not in (*_NO, *_YES):
        problems.append(("keep_traffic", f"{keep!r} must be yes or no"))
    if problems:
        raise InvalidDocument("scenario", problems)
    for name, what in PARTS.items():
        if name in given:
            file = folder / given[name]
            if not file.resolve().is_relative_to(folder.resolve()):
                problem = "lies outside of the folder of the list"
                raise InvalidDocument(what, [(given[name], problem)])
            given[name] = read_part(file, what)
    return given | {"keep_traffic": keep in _YES}


def read_part(file: Path, what: str) -> object:
    """Return the document of a modification or an intent.

    Raises:
        InvalidDocument: The file is no JSON, or holds nothing.
    """
    document = read_json(file, what=what)
    if document is None:
        raise InvalidDocument(what, [(file.name, "holds null")])
    return document
