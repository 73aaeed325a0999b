"""What makes a board's tables comparable, and how one is kept."""

import json
from dataclasses import asdict
from typing import Any

import pytest

from arena.rating.board_table import (
    BoardLine,
    BoardTableDocument,
    PooledStudy,
    anchor_lines,
    is_provisional,
    spread_over,
)
from arena.rating.lines import Line
from arena.rating.snapshot_document import read_document
from augment.errors import InvalidDocument


def test_the_founders_keep_their_mean_and_all_differences_stay() -> None:
    lines = [
        Line(name="a", rating=900.0, lower=850.0, upper=950.0),
        Line(name="b", rating=1000.0, upper=1100.0),
        Line(name="new", rating=1100.0),
        Line(name="unrated"),
    ]
    moved = anchor_lines(lines, {"a", "b", "unrated"})
    assert [line.interval for line in moved] == [
        (900.0, 950.0, 1000.0),
        (None, 1050.0, 1150.0),
        (None, 1150.0, None),
        (None, None, None),
    ]


def test_groups_that_cannot_be_compared_stay_where_they_are() -> None:
    lines = [Line(name="a", rating=900.0), Line(name="new", rating=1200.0, part=1)]
    assert anchor_lines(lines, {"a"}) == lines
    assert anchor_lines(lines[1:], {"a"}) == lines[1:]


@pytest.mark.parametrize(
    ("ranked", "chosen"),
    [("", ""), ("a", "a"), ("abc", "abc"), ("abcd", "acd"), ("abcdefg", "adg")],
)
def test_opponents_are_the_first_the_last_and_evenly_between(ranked: str, chosen: str) -> None:
    assert spread_over(ranked, 3) == list(chosen)


def a_table() -> BoardTableDocument:
    day, sha256 = "2026-01-01", "0" * 64
    line = BoardLine(
        name="Ann", slug="ann", kind="submission", since=day, authors=("Ada", "Bo"),
        rating=1000.5, is_open=False, is_simulated=False,
    )  # fmt: skip
    study = PooledStudy(name="Round 1", code="1", closed_at=day, votes=3, preregistration=sha256)
    texts = {"board": "City", "benchmark": "city@1", "question": "Which?", "answer": "Nobody."}
    rated: dict[str, Any] = {
        "lines": (line,), "studies": (study,), "founders": ("ann",), "notes": ("Few.",),
        "votes": 3, "votes_sha256": sha256, "left_out": {"skip": 1},
    }  # fmt: skip
    return BoardTableDocument(
        number=1,
        made_at=f"{day}T12:00:00+00:00",
        benchmark_sha256=sha256,
        method="Bradley-Terry",
        versions={"numpy": "2"},
        includes_simulated=False,
        **texts | rated,
    )


def test_a_table_is_read_as_it_was_kept() -> None:
    document = json.loads(json.dumps(asdict(a_table())))
    assert read_document(BoardTableDocument, document, what="board table") == a_table()


@pytest.mark.parametrize("change", [{"format": "x"}, {"version": 2}, {"votes": "many"}])
def test_what_is_no_table_of_this_version_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(InvalidDocument, match=next(iter(change))):
        read_document(BoardTableDocument, asdict(a_table()) | change, what="board table")


@pytest.mark.parametrize(
    ("lower", "upper", "provisional"),
    [(950.0, 1050.0, False), (950.0, 1051.0, True), (None, 1000.0, True)],
)
def test_a_line_is_provisional_until_its_interval_is_within_the_rule(
    lower: float | None, upper: float | None, provisional: bool
) -> None:
    line = Line(name="a", rating=1000.0, lower=lower, upper=upper)
    assert is_provisional(line, 50) is provisional
