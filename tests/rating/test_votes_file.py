"""Votes from elsewhere: which files are read as what, and what is said of the others."""

import gzip
import io
import json
import re
import zipfile
from datetime import datetime
from pathlib import Path
from typing import Any

import openpyxl
import pyarrow
import pytest
from pyarrow import parquet

from arena.rating import votes_file
from arena.rating.votes_file import VotesFileUnreadable, read_table
from tests.management.votes import HEAD, PLAIN, WITH_CLUSTERS, write_votes

NAMES = HEAD.split(",")


def columns_of(path: Path) -> list[list[str]]:
    return [read_table(path).columns[name] for name in NAMES]


@pytest.fixture
def plain(tmp_path: Path) -> list[list[str]]:
    """The columns of a file as simple as can be."""
    return columns_of(write_votes(tmp_path, *PLAIN))


def test_a_mark_quotes_other_columns_blank_lines_and_windows_ends_do_not_matter(
    tmp_path: Path, plain: list[list[str]]
) -> None:
    same = [f'x,"{line.replace(",", chr(34) + "," + chr(34))}"' for line in PLAIN]
    path = write_votes(tmp_path, *same, "", head=f"more,{HEAD}", start="\ufeff", end="\r\n")
    assert columns_of(path) == plain
    rows = [f"{line},x" for line in PLAIN]
    assert columns_of(write_votes(tmp_path, *rows, head=f'{HEAD},"a long\nnote"')) == plain


@pytest.mark.parametrize(
    ("separator", "encoding"), [(";", "utf-8"), ("\t", "utf-16"), ("|", "utf-8-sig")]
)
def test_separators_and_utf_16_are_recognised(
    tmp_path: Path, plain: list[list[str]], separator: str, encoding: str
) -> None:
    path = tmp_path / "other.csv"
    text = "\n".join([HEAD, *PLAIN]).replace(",", separator) + "\n"
    path.write_bytes(text.encode(encoding))
    assert columns_of(path) == plain


@pytest.mark.parametrize("kind", ["jsonl", "array", "pretty", "parquet", "gz", "xlsx", "sep"])
def test_other_forms_are_read(tmp_path: Path, plain: list[list[str]], kind: str) -> None:
    rows = [dict(zip(NAMES, line.split(","), strict=True)) for line in PLAIN]
    path = tmp_path / "votes"
    text = "\n".join([HEAD.upper(), "", *PLAIN])
    if kind == "xlsx":
        book = openpyxl.Workbook()
        for line in ["", HEAD, *PLAIN[:50], ",,", *PLAIN[50:]]:
            book.create_sheet("first") if not line else book["first"].append(line.split(","))
        book.save(path)
    elif kind == "gz":
        path.write_bytes(gzip.compress(text.encode()))
    elif kind == "sep":
        path.write_text("sep=;\r\n" + text.replace(",", ";"))
    elif kind in ("array", "pretty"):
        path.write_text(json.dumps(rows, indent=2 if kind == "pretty" else None))
    elif kind == "parquet":
        parquet.write_table(pyarrow.Table.from_pylist(rows), path)
    else:
        path.write_text("\n".join(json.dumps(row | {"more": 1}) for row in rows))
    assert columns_of(path) == plain


def test_newer_words_for_both_bad_are_ties(tmp_path: Path, plain: list[list[str]]) -> None:
    for word in ("both_bad", "bothbad"):
        lines = (line.replace("tie (bothbad)", word) for line in PLAIN)
        assert columns_of(write_votes(tmp_path, *lines)) == plain


def test_what_other_columns_of_json_hold_and_are_called_counts_for_nothing(tmp_path: Path) -> None:
    vote = {"model_a": "a", "model_b": "b", "winner": "tie", "Turns": 1, "turns": 2}
    path = tmp_path / "votes.json"
    path.write_text(json.dumps([vote | {"words": {"Paris": 1, "paris": 2}}]))
    assert columns_of(path) == [["a"], ["b"], ["tie"]]


def test_a_day_of_excel_or_parquet_is_named_as_in_csv(tmp_path: Path) -> None:
    day = {"model_a": datetime(2026, 3, 1), "model_b": datetime(2026, 3, 1, 9), "winner": "tie"}
    parquet.write_table(pyarrow.Table.from_pylist([day]), tmp_path / "votes")
    assert columns_of(tmp_path / "votes") == [["2026-03-01"], ["2026-03-01 09:00:00"], ["tie"]]


@pytest.mark.parametrize(("state", "name"), [("visible", "Sheet"), ("hidden", "Sheet1")])
def test_votes_on_a_further_sheet_are_said_to_be_unread(
    state: str, name: str, tmp_path: Path
) -> None:
    book = openpyxl.Workbook()
    for sheet in (book.active, book.create_sheet(), book.create_sheet("about")):
        sheet.append(["note"] if sheet.title == "about" else NAMES)
        sheet.append(["a", "b", "tie"])
    book.active.sheet_state = state
    book.save(tmp_path / "votes")
    note = read_table(tmp_path / "votes").note
    assert note == f"Only sheet '{name}' is read; 1 more have votes."


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        (["a,b,model_a", "a,b,both"], "line 3: the winner 'both' is none of model_a, model_b, "),
        (["a,b,TIE"], "line 2: the winner 'TIE' is none of"),
        (["a,b,"], "line 2: winner is empty"),
        (["a,b,tie", "a,,tie"], "line 3: model_b is empty"),
        (["a,b,tie", "a, NaN ,tie"], "line 3: model_b is NaN"),
        (["a,b,tie", "a,#REF!,tie"], "line 3: model_b is #REF!"),
        (["a,b,tie", " a ,a,tie"], "line 3: 'a' is compared with itself"),
        (["a,b,tie", "a,b,tie,,x"], "Row #3: Expected 3 columns, got 5"),
        (["a,b,tie", '"a,b,tie'], "Row #3: Expected 3 columns, got 1"),
    ],
)
def test_a_wrong_line_is_named_with_what_is_allowed(
    tmp_path: Path, lines: list[str], sentence: str
) -> None:
    with pytest.raises(VotesFileUnreadable, match=re.escape(sentence)):
        read_table(write_votes(tmp_path, *lines))


@pytest.mark.parametrize(
    ("head", "sentence"),
    [
        ("model_a,model_b,outcome", "line 1: there is no column 'winner'; needed are model_a, "),
        ("model_a,model_b,winner,winner", "line 1: the column 'winner' is there twice"),
    ],
)
def test_a_missing_or_double_column_is_named(tmp_path: Path, head: str, sentence: str) -> None:
    with pytest.raises(VotesFileUnreadable, match=sentence):
        read_table(write_votes(tmp_path, "a,b,tie", head=head))


def _write_repeated(path: Path, rows: int, name: str) -> None:
    """Write votes in which each column has one value, which Parquet stores once."""
    places = pyarrow.array([0] * rows, pyarrow.int8())
    cells = [name, "b", "tie"]
    columns = [pyarrow.DictionaryArray.from_arrays(places, [cell]) for cell in cells]
    parquet.write_table(pyarrow.table(columns, names=NAMES), path)


def test_a_parquet_file_unpacks_within_bounds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(votes_file, "MOST_UNPACKED", 2**20)
    path = tmp_path / "votes.parquet"
    for rows, name in ((2**20, "a"), (1, "a" * 2**21)):
        _write_repeated(path, rows, name)
        with pytest.raises(VotesFileUnreadable, match="unpacks to more than 1 MB"):
            read_table(path)
    _write_repeated(path, 100_000, "a" * 2**19)
    # 52 GB as texts of their own; a dictionary stays one.
    assert {*map(len, read_table(path).columns["model_a"])} == {2**19}


def _zipped(**entries: bytes) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in entries.items():
            archive.writestr(
                zipfile.ZipInfo(name.replace("__", "/").replace("_xml", ".xml")), data
            )
    return content.getvalue()


def _vote(**changes: Any) -> dict[str, Any]:
    return {"model_a": "a", "model_b": "b", "winner": "tie"} | changes


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "it is empty"),
        (HEAD.encode(), "there are no votes in it"),
        (b"[]", "there are no votes in it"),
        (f"{HEAD}\na,b,tie\na\0,b,tie".encode(), "line 3: there is a NUL character"),
        (f"{json.dumps(_vote())}\nnothing\n".encode(), "line 2 column 1"),
        (json.dumps([_vote(), 7]).encode(), "vote 2: an object"),
        (json.dumps([_vote(model_a=["a"])]).encode(), "vote 1: model_a is no text"),
        (json.dumps([_vote(model_a="\0")]).encode(), "vote 1: model_a is no te"),
        (b'{"votes": []}', "there is no column 'model_a'"),
        (json.dumps([{"Model A": "c"} | _vote()]).encode(), "the column 'model_a' twice"),
        (json.dumps([_vote(), {"x": 1}]).encode(), "vote 2: model_a is emp"),
        (b"[" * 100_000, "it can't be read: "),
        (gzip.compress(b"x" * 3_000_000, mtime=0), "it unpacks to more than 1 MB"),
        (gzip.compress(HEAD.encode(), mtime=0)[:-9], "it can't be read: "),
        (_zipped(xl__workbook_xml=b"x" * 3_000_000), "it unpacks to more than 1 MB"),
        (_zipped(xl__workbook_xml=b"<no"), "it can't be read: "),
        (_zipped(votes=b"a,b,tie"), "a zip file without an Excel book"),
        (b"PK\3\4nothing", "it can't be read: "),
        (f"{HEAD}\n\x81é,b,tie".encode("latin-1"), "neither UTF-8, UTF-16 with its mark nor Lat"),
    ],
)
def test_what_is_no_file_of_votes_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes, sentence: str
) -> None:
    monkeypatch.setattr(votes_file, "MOST_UNPACKED", 2**20)
    path = tmp_path / "votes"
    path.write_bytes(content)
    with pytest.raises(VotesFileUnreadable, match=re.escape(sentence)):
        read_table(path)


def test_names_that_look_the_same_are_the_same_and_latin_1_is_said(tmp_path: Path) -> None:
    names = ["R\u00f6ver 1", "Ro\u0308ver 1", " R\u00f6ver\u00a0 1", "R\u00f6\u200bver 1"]
    same = read_table(write_votes(tmp_path, *(f"{name},b,tie" for name in names)))
    assert {*same.columns["model_a"]} == {"Röver 1"}
    lines = [f"A,{alike},tie,j,i" for alike in ("\u0410", "\uff21", "a")]
    for line in [*lines, "a,b,tie,Anna,i\na,b,tie,anna,i", "a,b,tie,j,I1\na,b,tie,j,i1"]:
        note = read_table(write_votes(tmp_path, line, head=WITH_CLUSTERS)).note
        assert note.endswith("look alike and count as two names."), line
    path = tmp_path / "latin1.csv"
    mixed = [f"{HEAD}\nRöver,b,tie\n".encode(coding) for coding in ("latin-1", "utf-8")]
    path.write_bytes(mixed[0] + mixed[1].replace(HEAD.encode(), b""))
    latin = read_table(path)
    assert {*latin.columns["model_a"]} == {"Röver"}
    assert latin.note == votes_file.LATIN_1_NOTE
