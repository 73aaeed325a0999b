"""Many scenarios from one file, all of them or none.

In: a CSV or YAML file. Out: stored scenarios; or every fault with the row it is in.
"""

import csv
import io
from collections.abc import Mapping
from typing import Any

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import AugmentError, InvalidDocument
from augment.formats.documents import parse_json, read_yaml
from augment.services.scenarios.scenes import NewScenario, add_scenario

WHAT = "list of scenarios"
NEEDED = ("scene", "type", "instruction")
DOCUMENTS = {"reference": "modification", "intent": "intent"}
"""Columns that hold a document: JSON as text, or in YAML as it is."""
OPTIONAL = ("slug", "keep_traffic", "density", "goal", "follows", "variant_of", *DOCUMENTS)
MOST_ROWS = 10_000
MOST_ROWS_AT_ONCE = 300
"""On a page: adding them holds the database for some seconds."""
_NO, _YES = ("", "no", "false", "0"), ("yes", "true", "1")


def add_rows(
    name: str, content: bytes, *, most: int = MOST_ROWS, actor: User | None = None
) -> list[str]:
    """Add the scenarios of a file, all or none, and return their slugs.

    Args:
        name: Of the file; its ending is .csv, .yaml or .yml.
        content: In CSV a line of names comes first, in YAML a list of mappings.
        most: How many rows are taken.
        actor: Who adds them.

    Raises:
        InvalidDocument: It can't be read, or rows can't be added; every fault names its row.
    """
    slugs, problems = list[str](), list[tuple[str, str]]()
    with transaction.atomic():
        for number, row in enumerate(_read_rows(name, content, most), start=1):
            place = f"row {number}"
            try:
                with transaction.atomic():
                    slugs.append(add_scenario(_read_row(row), actor=actor).slug)
            except InvalidDocument as error:
                problems += [(f"{place}.{path}", str(text)) for path, text in error.problems]
            except AugmentError as error:
                problems.append((place, str(error)))
        if problems:
            raise InvalidDocument(WHAT, problems)
    return slugs


def _read_rows(name: str, content: bytes, most: int) -> list[dict[str, Any]]:
    try:
        text = content.decode("utf-8-sig")
        if name.lower().endswith(".csv"):
            reader = csv.DictReader(io.StringIO(text, newline=""), strict=True)
            rows: object = [{str(key): value for key, value in row.items()} for row in reader]
        elif name.lower().endswith((".yaml", ".yml")):
            rows = read_yaml(text, what=WHAT)
        else:
            raise InvalidDocument(WHAT, [(name, "its name must end in .csv, .yaml or .yml")])
    except (UnicodeDecodeError, csv.Error) as fault:
        raise InvalidDocument(WHAT, [(name, f"can't be read: {fault}")]) from None
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InvalidDocument(WHAT, [("", "a list of mappings is needed")])
    if not 1 <= len(rows) <= most:
        raise InvalidDocument(WHAT, [("", f"{len(rows)} rows; 1 to {most} are read")])
    return rows


def _read_row(row: Mapping[str, Any]) -> NewScenario:
    values = {name: value for name, value in row.items() if value not in (None, "")}
    columns, keep = (*NEEDED, *OPTIONAL), str(values.pop("keep_traffic", "")).strip().lower()
    problems = [
        (name, f"is no column; there are {', '.join(columns)}")
        for name in row
        if name not in columns
    ]
    problems += [(name, "is missing") for name in NEEDED if name not in values]
    problems += [
        (name, f"{value!r} must be text")
        for name, value in values.items()
        if name not in DOCUMENTS and not isinstance(value, str)
    ]
    if keep not in (*_NO, *_YES):
        problems.append(("keep_traffic", f"{keep!r} must be yes or no"))
    if problems:
        raise InvalidDocument("scenario", problems)
    for name, what in DOCUMENTS.items():
        if isinstance(values.get(name), str):
            values[name] = parse_json(values[name].encode(), what=what, place=name)
    return NewScenario(**values, keep_traffic=keep in _YES)
