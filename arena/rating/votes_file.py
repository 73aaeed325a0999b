"""Votes from a file with the columns model_a, model_b, winner, and maybe judge and item.

The file is CSV with any usual separator, JSON (an array, or an object a line), Parquet or an Excel
book, as it is or packed by gzip; what it is follows from its content, not from its name.
"""

import codecs
import csv
import gzip
import io
import itertools
import json
import re
import unicodedata
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons, IntArray

NEEDED = ("model_a", "model_b", "winner")
OPTIONAL = ("judge", "item")
SIMULATED = "simulated"
"""A column that our own files have; a yes in it marks a vote as made up."""
WINNERS = {"model_a": WIN, "model_b": LOSS, "tie": TIE, "tie (bothbad)": TIE}
_BOTH_BAD = ("both_bad", "bothbad")
"""As newer votes of Chatbot Arena call it."""
SEPARATORS = ",;\t|"
MOST_UNPACKED = 2**27
"""Bytes that a packed file may hold."""
_KNOWN = (*NEEDED, *OPTIONAL, SIMULATED)
_MOST_IN_A_LINE = 2**26
_MOST_ROWS, _MOST_COLUMNS = 2**20, 2**10
"""Of an Excel sheet; columns beyond are passed over."""
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_UNSEEN = re.compile(
    "[\u00ad\u034f\u061c\u115f\u1160\u180b-\u180f\u200b-\u200f\u202a-\u202e\u2060-\u206f\u2800"
    "\u3164\ufe00-\ufe0f\ufeff\uffa0"
    "\U000e0000-\U000e0fff]"
)
"""Characters without a picture of their own: zero-width, of direction, variants."""
_ALIKE = str.maketrans(
    "АВЕКМНОРСТУХасеорхуіѕјΑΒΕΖΗΙΚΜΝΟΡΤΥΧο\u2010\u2011\u2012\u2013\u2212’‘",
    "ABEKMHOPCTYXaceopxyisjABEZHIKMNOPTYXo-----''",
)
"""Cyrillic and Greek letters, hyphens and quotes that look as those of ASCII."""
_NO_TEXT = re.compile("[\0\ud800-\udfff]")
_NO_VALUES = frozenset({"nan", "<na>"}) | {
    *("#n/a", "#ref!", "#value!", "#name?", "#null!", "#num!", "#div/0!", "#spill!")
}
"""What pandas and Excel write where there is no value."""
NO_VOTES = "there are no votes in it"
LATIN_1_NOTE = (
    "What is not UTF-8 in the file was read as Latin-1 (Windows-1252). If names look wrong, save "
    "it as UTF-8."
)


class VotesFileUnreadable(ValueError):
    """The file is not what it should be; the text has the line and what is allowed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VotesTable:
    """The columns of a file that matter, as text that looks the same where it is the same.

    Attributes:
        lines: The number of each vote's line; blank lines of CSV are not counted.
        word: What a line is called: line, row of a sheet, vote of JSON.
        note: What was assumed to read it, empty where nothing was.
    """

    columns: dict[str, list[Any]]
    lines: Sequence[int]
    word: str = "line"
    note: str = ""

    def refuse(self, place: int, reason: str) -> VotesFileUnreadable:
        """Return the error that a vote, from 0, is wrong."""
        return VotesFileUnreadable(f"{self.word} {self.lines[place]}: {reason}")

    def check_filled(self, names: Sequence[str]) -> None:
        """Refuse columns in which a cell says nothing: empty, or what other programs write."""
        for name in names:
            for place, cell in enumerate(self.columns[name]):
                if not cell or cell[:9].lower() in _NO_VALUES:
                    raise self.refuse(place, f"{name} is {cell or 'empty'}")


def read_table(path: Path) -> VotesTable:
    """Read the known columns that a file has.

    Raises:
        VotesFileUnreadable: It can't be read, a column is missing, a winner is unknown, a name is
            missing, a model meets itself, or there are no votes.
    """
    from pyarrow import ArrowException

    try:
        table = _clean_cells(_load(path))
    except VotesFileUnreadable:
        raise
    except (ArrowException, csv.Error, RecursionError, ValueError, *_BROKEN_ARCHIVE) as error:
        raise VotesFileUnreadable(f"it can't be read: {error}") from error
    if not table.lines:
        raise VotesFileUnreadable(NO_VOTES)
    table.check_filled(NEEDED)
    winners = table.columns["winner"]
    winners[:] = ["tie (bothbad)" if cell in _BOTH_BAD else cell for cell in winners]
    votes = zip(*(table.columns[name] for name in NEEDED), strict=True)
    for place, (model_a, model_b, winner) in enumerate(votes):
        if winner not in WINNERS:
            raise table.refuse(place, f"the winner {winner!r} is none of {', '.join(WINNERS)}")
        if model_a == model_b:
            raise table.refuse(place, f"{model_a!r} is compared with itself")
    return replace(table, note=" ".join(filter(None, [table.note, _find_alike(table)])))


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
    # (R, 3 to 5): votes that agree in everything become one row with their number.
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
    # Who met, whichever way round, by whom and on what.
    keys = np.column_stack([np.sort(rows[:, :2], axis=1), rows[:, len(NEEDED) :]])
    return comparisons, comparisons.votes - len(np.unique(keys, axis=0))


# --- Private -----------------------------------------------------------------------------------


_BROKEN_ARCHIVE = (
    *(gzip.BadGzipFile, zlib.error, EOFError, zipfile.BadZipFile, NotImplementedError),
    *(KeyError, TypeError, IndexError, AttributeError, SyntaxError, RuntimeError, OverflowError),
)
"""What gzip, zip and Excel's XML raise where they are not what they should be."""


def _find_alike(table: VotesTable) -> str:
    """Return a note on two names that are not the same and look nearly so, empty without any."""
    models = table.columns["model_a"] + table.columns["model_b"]
    for names in (models, *(table.columns.get(name, []) for name in OPTIONAL)):
        seen = dict[str, str]()
        for name in sorted({*names}):
            look = unicodedata.normalize("NFKC", name).translate(_ALIKE).casefold()
            if (other := seen.setdefault(look, name)) != name:
                return f"{other!a} and {name!a} look alike and count as two names."
    return ""


def _load(path: Path) -> VotesTable:
    """Return the known columns of a file with their values as they are."""
    content = path.read_bytes()
    if content.startswith(b"\x1f\x8b"):
        with gzip.open(path) as file:
            content = file.read(MOST_UNPACKED + 1)
        _check_size(len(content))
    for mark, read in _BINARY.items():
        if content.startswith(mark):
            return read(io.BytesIO(content))
    text, note = _decode(content)
    if not text.strip():
        raise VotesFileUnreadable("it is empty")
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise VotesFileUnreadable(f"line {line}: there is a NUL character, which no text has")
    read_text = _read_json if text.lstrip().startswith(("{", "[")) else _read_csv
    return replace(read_text(text), note=note)


def _check_size(size: int) -> None:
    if size > MOST_UNPACKED:
        most = MOST_UNPACKED // 2**20
        raise VotesFileUnreadable(f"it unpacks to more than {most} MB, which are allowed")


def _decode(content: bytes) -> tuple[str, str]:
    """Return a text, and a note where its encoding is a guess."""
    try:
        return content.decode("utf-16" if content.startswith(_UTF_16) else "utf-8-sig"), ""
    except UnicodeDecodeError as error:
        try:
            # Lines of several programs may stand in one file.
            return content.decode("utf-8-sig", "cp1252"), LATIN_1_NOTE
        except UnicodeDecodeError:
            raise VotesFileUnreadable(
                "its text is neither UTF-8, UTF-16 with its mark nor Latin-1 (Windows-1252)"
            ) from error


def _decode_latin_1(fault: UnicodeError) -> tuple[str, int]:
    """Decode a sequence that is not UTF-8; return its text and where it ends."""
    assert isinstance(fault, UnicodeDecodeError)
    return fault.object[fault.start : fault.end].decode("cp1252"), fault.end


codecs.register_error("cp1252", _decode_latin_1)


def _read_csv(text: str) -> VotesTable:
    from pyarrow import csv as arrow_csv
    from pyarrow import string

    lines, above, separators = io.StringIO(text, newline=""), 0, SEPARATORS
    while not (line := lines.readline()).strip():
        above += 1
    # Excel's word on the separator stands before the head.
    if stated := re.fullmatch(r"\"?sep=([^\"\w])\"?[,;\t|]*\s*", line, re.ASCII | re.IGNORECASE):
        above, separators = above + 1, stated[1]
    separator, header, above = _read_header(text, above, separators)
    _find_columns(header)
    if not any(line.strip() for line in _lines_below(text, above)):
        raise VotesFileUnreadable(NO_VOTES)
    table = arrow_csv.read_csv(
        io.BytesIO(text.encode()),
        arrow_csv.ReadOptions(
            use_threads=False, block_size=_MOST_IN_A_LINE, column_names=header, skip_rows=above
        ),
        arrow_csv.ParseOptions(delimiter=separator, newlines_in_values=True),
        arrow_csv.ConvertOptions(
            include_columns=[name for name in dict.fromkeys(header) if name in _KNOWN],
            column_types=dict.fromkeys(_KNOWN, string()),
        ),
    )
    first = above + 1
    return VotesTable(columns=table.to_pydict(), lines=range(first, first + table.num_rows))


def _lines_below(text: str, above: int) -> Iterator[str]:
    return itertools.islice(io.StringIO(text, newline=""), above, None)


def _read_header(text: str, above: int, separators: str) -> tuple[str, list[str], int]:
    """Return the separator that finds most of the known columns, these, and the lines so far."""
    headers = []
    for separator in separators:
        reader = csv.reader(_lines_below(text, above), delimiter=separator)
        names = [_column_name(name) for name in next(reader, [])]
        headers.append((separator, names, above + reader.line_num))
    return max(headers, key=lambda header: len({*header[1]} & {*_KNOWN}))


def _read_json(text: str) -> VotesTable:
    """Read objects, and arrays of objects, one after the other."""
    decoder, votes, end = json.JSONDecoder(object_pairs_hook=_name_columns), list[Any](), 0
    while rest := re.compile(r"\S").search(text, end):
        value, end = decoder.raw_decode(text, rest.start())
        votes += value if isinstance(value, list) else [value]
    for number, vote in enumerate(votes, start=1):
        if not isinstance(vote, dict):
            raise VotesFileUnreadable(
                f"vote {number}: an object with {', '.join(NEEDED)} is needed, not {vote!r:.40}"
            )
    there = set[str]().union(*votes) if votes else {*NEEDED}
    _find_columns(list(there))
    columns = {name: [vote.get(name) for vote in votes] for name in _KNOWN if name in there}
    return VotesTable(columns=columns, lines=range(1, len(votes) + 1), word="vote")


def _name_columns(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a vote, or an object within one: other columns may hold and name what they like."""
    names = [_column_name(name) for name, _ in pairs]
    for name in _KNOWN:
        if names.count(name) > 1:
            raise VotesFileUnreadable(f"an object names the column {name!r} twice")
    return dict(zip(names, (value for _, value in pairs), strict=True))


def _read_parquet(content: io.BytesIO) -> VotesTable:
    from pyarrow import parquet

    schema = parquet.read_schema(content)
    names, places = schema.names, _find_columns([_column_name(name) for name in schema.names])
    texts = [names[at] for at in places.values() if str(schema.types[at]).endswith("string")]
    file = parquet.ParquetFile(content, read_dictionary=texts)
    groups = [file.metadata.row_group(number) for number in range(file.num_row_groups)]
    parts = [group.column(at) for group in groups for at in range(group.num_columns)]
    wanted = [names[at] for at in places.values()]
    sizes = [chunk.total_uncompressed_size for chunk in parts if chunk.path_in_schema in wanted]
    _check_size(sum(sizes))
    # A dictionary counts once there however often it is named: a cell of CSV has two bytes.
    _check_size(2 * file.metadata.num_rows * len(places))
    table = file.read(columns=wanted)
    columns = {name: _list_cells(table[names[place]]) for name, place in places.items()}
    return VotesTable(columns=columns, lines=range(2, table.num_rows + 2))


def _list_cells(column: Any) -> list[Any]:
    """Return the values of a column of Arrow, one object for those of a dictionary."""
    cells = list[Any]()
    for chunk in column.chunks:
        values = getattr(chunk, "dictionary", chunk).to_pylist()
        named = chunk.indices.to_pylist() if hasattr(chunk, "indices") else range(len(values))
        cells += [None if at is None else values[at] for at in named]
    return cells


def _read_book(content: io.BytesIO) -> VotesTable:
    """Read the first sheet of an Excel book that has the columns, else name what it lacks."""
    from openpyxl import load_workbook

    with zipfile.ZipFile(content) as archive:
        if "xl/workbook.xml" not in archive.namelist():
            raise VotesFileUnreadable("it is a zip file without an Excel book; unpack it first")
        # No entry gives more than it declares.
        _check_size(sum(entry.file_size for entry in archive.infolist()))
    book = load_workbook(content, read_only=True, data_only=True)
    heads = [(next(rows, (0, ())), rows) for rows in map(_sheet_rows, book.worksheets)]
    if not heads:
        raise VotesFileUnreadable("it has no sheet")
    names = [[_column_name(str(cell)) for cell in head] for (_, head), _ in heads]
    is_shown = [sheet.sheet_state == "visible" for sheet in book.worksheets]
    best = max(range(len(heads)), key=lambda n: (len({*names[n]} & {*_KNOWN}), is_shown[n]))
    places = _find_columns(names[best])
    unread = sum({*NEEDED} <= {*head} for head in names) - 1
    note = f"Only sheet {book.worksheets[best].title!a} is read; {unread} more have votes."
    rows = list(heads[best][1])
    columns = {name: [row[at] for _, row in rows] for name, at in places.items()}
    numbers = [number for number, _ in rows]
    return VotesTable(columns=columns, lines=numbers, word="row", note=note if unread else "")


def _sheet_rows(sheet: Any) -> Iterator[tuple[int, tuple[Any, ...]]]:
    """Yield the numbers and the values of rows that are not blank, all of one length."""
    rows = sheet.iter_rows(max_row=_MOST_ROWS, max_col=_MOST_COLUMNS, values_only=True)
    return ((number, row) for number, row in enumerate(rows, start=1) if {*row} - {None, ""})


def _refuse_old_book(content: io.BytesIO) -> VotesTable:
    raise VotesFileUnreadable(
        "it is an Excel book of the old kind or with a password; save it as .xlsx or CSV"
    )


_BINARY: dict[bytes, Callable[[io.BytesIO], VotesTable]] = {
    b"PAR1": _read_parquet,
    b"PK": _read_book,
    b"\xd0\xcf\x11\xe0": _refuse_old_book,
}
"""What reads a content that begins so."""


def _find_columns(header: Sequence[str]) -> dict[str, int]:
    """Return the places of the known columns."""
    for name in _KNOWN:
        if header.count(name) > 1:
            raise VotesFileUnreadable(f"line 1: the column {name!r} is there twice")
    for name in NEEDED:
        if name not in header:
            raise VotesFileUnreadable(
                f"line 1: there is no column {name!r}; needed are {', '.join(NEEDED)}"
            )
    return {name: header.index(name) for name in _KNOWN if name in header}


def _clean_cells(table: VotesTable) -> VotesTable:
    """Return the votes as clean text, without lines and rows that have no cell filled."""
    columns: dict[str, list[str]] = {}
    for name, cells in table.columns.items():
        texts = [cell if type(cell) is str else _as_text(cell) for cell in cells]
        # Each text once: a column may name a long one a million times.
        broken = {text for text in set(texts) if text is None or _NO_TEXT.search(text)}
        if broken:
            place = next(at for at, text in enumerate(texts) if text in broken)
            raise table.refuse(place, f"{name} is no text: {cells[place]!r:.40}")
        clean = {text: _clean(text or "") for text in set(texts)}
        columns[name] = [clean[text] for text in texts]
    rows, is_json = zip(*columns.values(), strict=True), table.word == "vote"
    filled = [place for place, row in enumerate(rows) if is_json or any(row)]
    return replace(
        table,
        columns={name: [cells[place] for place in filled] for name, cells in columns.items()},
        lines=[table.lines[place] for place in filled],
    )


def _as_text(value: Any) -> str | None:
    """Return a value as a CSV file would have it; None for what is no single value."""
    if value is None:
        return ""
    if isinstance(value, list | dict | bytes):
        return None
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    text = str(value).removesuffix(" 00:00:00")  # Excel's days begin at midnight
    return text.lower() if isinstance(value, bool) else text


def _clean(text: str) -> str:
    """Return the same text for texts that look the same: composed, unseen signs dropped."""
    return unicodedata.normalize("NFC", " ".join(_UNSEEN.sub("", text).split()))


@lru_cache(maxsize=1024)
def _column_name(name: str) -> str:
    return _clean(name).lower().replace(" ", "_")


def _number(cells: Sequence[str]) -> tuple[list[str], IntArray]:
    """Return the names in alphabetical order, and the number of each cell's."""
    names = sorted(set(cells))
    number = {name: index for index, name in enumerate(names)}
    return names, np.array([number[cell] for cell in cells], dtype=np.int64)
