"""Votes from a file with the columns model_a, model_b, winner, and maybe judge and item.

The file is CSV with any usual separator, JSON lines or Parquet; what it is follows from its
content, not from its name.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, IntArray

NEEDED = ("model_a", "model_b", "winner")
OPTIONAL = ("judge", "item")
SIMULATED = "simulated"
"""A column that our own files have; a yes in it marks a vote as made up."""
WINNERS = {"model_a": WIN, "model_b": LOSS, "tie": TIE, "tie (bothbad)": TIE}
SEPARATORS = ",;\t|"
_FIRST_BYTES = 65_536
_MOST_IN_A_LINE = 2**26
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")


class VotesFileUnreadable(ValueError):
    """The file is not what it should be; the text has the line and what is allowed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VotesTable:
    """The columns of a file that matter, as text without spaces around it.

    Attributes:
        first_line: The number of the first vote's line; blank lines are not counted.
    """

    columns: dict[str, list[str]]
    first_line: int

    def refuse(self, place: int, reason: str) -> VotesFileUnreadable:
        """Return the error that a vote, from 0, is wrong."""
        return VotesFileUnreadable(f"line {place + self.first_line}: {reason}")

    def check_filled(self, names: Sequence[str]) -> None:
        """Refuse columns in which a cell says nothing: empty, or what other programs write."""
        for name in names:
            for place, cell in enumerate(self.columns[name]):
                if not cell or cell.lower() == "nan":
                    raise self.refuse(place, f"{name} is {cell or 'empty'}")


def read_table(path: Path) -> VotesTable:
    """Read the known columns that a file has; text is UTF-8, or UTF-16 with its mark.

    Raises:
        VotesFileUnreadable: It can't be read, a column is missing, a winner is unknown, a name is
            missing, or a model meets itself.
    """
    from pyarrow import ArrowException, compute, string

    try:
        table, first_line = _load(path, {*NEEDED, *OPTIONAL, SIMULATED})
        for name in NEEDED:
            if name not in table.column_names:
                raise VotesFileUnreadable(
                    f"line 1: there is no column {name!r}; needed are {', '.join(NEEDED)}"
                )
        columns = {
            name: compute.utf8_trim_whitespace(table[name].cast(string()).fill_null(""))
            for name in table.column_names
        }
    except (ArrowException, UnicodeError, csv.Error) as error:
        raise VotesFileUnreadable(f"it can't be read: {error}") from error
    found = VotesTable(
        columns={name: column.to_pylist() for name, column in columns.items()},
        first_line=first_line,
    )
    found.check_filled(NEEDED)
    votes = zip(*(found.columns[name] for name in NEEDED), strict=True)
    for place, (model_a, model_b, winner) in enumerate(votes):
        if winner not in WINNERS:
            raise found.refuse(place, f"the winner {winner!r} is none of {', '.join(WINNERS)}")
        if model_a == model_b:
            raise found.refuse(place, f"{model_a!r} is compared with itself")
    return found


def as_comparisons(table: VotesTable, clusters: Sequence[str]) -> tuple[Comparisons, int | None]:
    """Number the names in alphabetical order, so that no order of lines counts.

    Args:
        table: What was read.
        clusters: Which of the optional columns to use; every line must fill them. A column that
            is not used is one judge or item for all.

    Returns:
        The votes, experts are judges and scenarios items; and how many of them repeat an earlier
        one of the same judge, item and pair, None where these are not both used.

    Raises:
        VotesFileUnreadable: A cell that is needed is empty.
    """
    table.check_filled(clusters)
    columns = table.columns
    names, ends = _number(columns["model_a"] + columns["model_b"])
    outcome = np.array([2 * WINNERS[winner] for winner in columns["winner"]], dtype=np.int64)
    codes = [_number(columns[name])[1] for name in clusters]
    rows = np.column_stack([*np.split(ends, 2), outcome, *codes])
    rows, count = np.unique(rows, axis=0, return_counts=True)
    nobody = np.zeros(len(rows), dtype=np.int64)
    of_clusters = dict(zip(clusters, rows.T[len(NEEDED) :], strict=True))
    comparisons = Comparisons(
        names=tuple(names),
        first=rows[:, 0].copy(),
        second=rows[:, 1].copy(),
        score=rows[:, 2] / 2.0,
        expert=of_clusters.get("judge", nobody).copy(),
        scenario=of_clusters.get("item", nobody).copy(),
        count=count,
    )
    if len(clusters) < len(OPTIONAL):
        return comparisons, None
    keys = np.column_stack([np.sort(rows[:, :2], axis=1), rows[:, len(NEEDED) :]])
    return comparisons, comparisons.votes - len(np.unique(keys, axis=0))


# --- Private -----------------------------------------------------------------------------------


def _load(path: Path, wanted: set[str]) -> tuple[Any, int]:
    """Return an Arrow table with those of the columns that there are, and its first line."""
    from pyarrow import csv as arrow_csv
    from pyarrow import json as arrow_json
    from pyarrow import parquet, string

    with path.open("rb") as file:
        start = file.read(_FIRST_BYTES)
    if start.startswith(b"PAR1"):
        there = set(parquet.read_schema(path).names)
        return parquet.read_table(path, columns=sorted(wanted & there)), 2
    if start.lstrip(b"\xef\xbb\xbf \r\n\t").startswith(b"{"):
        options = arrow_json.ReadOptions(use_threads=False, block_size=_MOST_IN_A_LINE)
        table = arrow_json.read_json(path, read_options=options)
        return table.select([name for name in table.column_names if name in wanted]), 1
    encoding = "utf-16" if start.startswith(_UTF_16) else "utf-8-sig"
    with path.open(encoding=encoding, newline="") as lines:
        separator, header = _read_header(lines.readline(_FIRST_BYTES))
    known = [name for name in dict.fromkeys(header) if name in wanted]
    for name in known:
        if header.count(name) > 1:
            raise VotesFileUnreadable(f"line 1: the column {name!r} is there twice")
    table = arrow_csv.read_csv(
        path,
        arrow_csv.ReadOptions(
            use_threads=False,
            encoding=encoding,
            block_size=_MOST_IN_A_LINE,
            column_names=header,
            skip_rows=1,
        ),
        arrow_csv.ParseOptions(delimiter=separator, newlines_in_values=True),
        arrow_csv.ConvertOptions(
            include_columns=known, column_types={name: string() for name in known}
        ),
    )
    return table, 2


def _read_header(line: str) -> tuple[str, list[str]]:
    """Return the separator that finds most of the known columns, and the columns."""
    headers = [
        (separator, [name.strip() for name in next(csv.reader([line], delimiter=separator), [])])
        for separator in SEPARATORS
    ]
    return max(headers, key=lambda found: len({*found[1]} & {*NEEDED, *OPTIONAL}))


def _number(cells: Sequence[str]) -> tuple[list[str], IntArray]:
    """Return the names in alphabetical order, and the number of each cell's."""
    names = sorted(set(cells))
    number = {name: index for index, name in enumerate(names)}
    return names, np.array([number[cell] for cell in cells], dtype=np.int64)
