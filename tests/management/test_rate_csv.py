"""Votes from elsewhere: which files are taken, what is said of the others, what is printed."""

from __future__ import annotations

import csv
import io
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pyarrow
import pytest
from django.core.management import CommandError, call_command
from pyarrow import parquet

from arena.management.rate_csv import COLUMNS, CsvNotRated, run
from tests.house.source import ROOT

HEAD = "model_a,model_b,winner"
PLAIN = [
    *["a,b,model_a"] * 30,
    *["a,b,tie"] * 5,
    *["b,a,model_a"] * 20,
    *["b,c,tie (bothbad)"] * 9,
    *["c,b,model_b"] * 12,
    *["c,a,model_a"] * 14,
]


@pytest.fixture
def votes(tmp_path: Path) -> Any:
    def written(*lines: str, head: str = HEAD, start: str = "", end: str = "\n") -> str:
        path = tmp_path / "votes.csv"
        path.write_bytes((start + end.join([head, *lines]) + end).encode())
        return str(path)

    return written


def document(file: str, **options: Any) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads(run(file=file, format="json", **options))
    return loaded


def clustered(number: int = 400) -> list[str]:
    winners = ["model_a", "tie", "model_b", "model_a", "model_b"]
    pairs = ["a,b", "b,c", "c,a", "b,a"]
    return [
        f"{pairs[n % 4]},{winners[(n * n) % 5]},j{(n * 7) % 23},i{n % 29}" for n in range(number)
    ]


WITH_CLUSTERS = f"{HEAD},judge,item"


# --- What comes out ------------------------------------------------------------------------------


def test_json_has_standings_best_first(votes: Any) -> None:
    found = document(votes(*PLAIN))
    assert [list(row) for row in found["standings"]] == [
        [*COLUMNS, "check_lower", "check_upper"]
    ] * 3
    ratings = [row["rating"] for row in found["standings"]]
    assert ratings == sorted(ratings, reverse=True)
    assert sum(ratings) == pytest.approx(3000, abs=0.01)
    assert {row["model"]: row["votes"] for row in found["standings"]} == {
        "a": 69, "b": 76, "c": 35,
    }  # fmt: skip
    assert found["tie_share"] == pytest.approx(14 / 90, abs=1e-4)
    for row in found["standings"]:
        assert row["lower"] < row["rating"] < row["upper"]


def test_without_judge_and_item_votes_are_resampled_and_a_note_says_so(votes: Any) -> None:
    found = document(votes(*PLAIN))
    assert (found["method"], found["resample"], found["rounds"]) == ("bt", "vote", 10_000)
    assert "does not name both judge and item" in found["notes"][0]


def test_with_judge_and_item_both_are_resampled(votes: Any) -> None:
    found = document(votes(*clustered(), head=WITH_CLUSTERS))
    assert found["resample"] == "two-way"
    assert not any("does not name" in note for note in found["notes"])


@pytest.mark.parametrize("resample", ["vote", "judge", "item", "two-way"])
def test_every_unit_can_be_asked_for(votes: Any, resample: str) -> None:
    file = votes(*clustered(), head=WITH_CLUSTERS)
    assert document(file, resample=resample, rounds=200)["resample"] == resample


def test_above_half_a_million_votes_a_thousand_rounds_are_enough(votes: Any) -> None:
    assert document(votes(*PLAIN * 5_600))["rounds"] == 1000


def test_online_elo_resamples_votes_and_says_what_its_interval_is_not(votes: Any) -> None:
    file = votes(*clustered(), head=WITH_CLUSTERS)
    found = document(file, method="elo", rounds=50)
    assert (found["method"], found["resample"]) == ("elo", "vote")
    assert any("does not shrink with more votes" in note for note in found["notes"])
    with pytest.raises(CsvNotRated, match="elo resamples single votes only; 'judge' needs"):
        run(file=file, method="elo", resample="judge")


def test_the_same_seed_gives_the_same_text_and_the_order_of_lines_does_not_count(
    votes: Any,
) -> None:
    lines = clustered()
    first = run(file=votes(*lines, head=WITH_CLUSTERS), seed=3, rounds=200)
    assert first == run(file=votes(*reversed(lines), head=WITH_CLUSTERS), seed=3, rounds=200)
    assert first != run(file=votes(*lines, head=WITH_CLUSTERS), seed=4, rounds=200)


def test_the_table_names_the_method_beneath(votes: Any) -> None:
    lines = run(file=votes(*PLAIN), rounds=100, seed=2).splitlines()
    assert lines[0].split() == ["Model", "Rank", "Elo", "95%", "CI", "Votes", "95%", "ranks"]
    assert re.fullmatch(r"c +1 +\d+ +-\d+/\+\d+ +35 +1–3", lines[1])
    assert "Bradley-Terry" in lines[5]
    assert "100 resamples (vote), seed 2; 90 votes; 15.6% ties" in lines[5]


def test_csv_cells_are_no_formulas(votes: Any, capsys: pytest.CaptureFixture[str]) -> None:
    lines = [line.replace("a,", "=1+1,").replace(",a,", ",=1+1,") for line in PLAIN]
    said = run(file=votes(*lines), rounds=100, format="csv")
    rows = list(csv.DictReader(io.StringIO(said)))
    assert list(rows[0]) == list(COLUMNS)
    assert {row["model"] for row in rows} >= {"'=1+1"}
    assert "does not name both" in capsys.readouterr().err


def test_latex_has_the_form_of_the_papers_table(votes: Any) -> None:
    said = run(file=votes(*[line.replace("c", "c_50%") for line in PLAIN]), format="latex")
    assert r"\textbf{Model} & \textbf{Rank} & \textbf{Elo}~$\uparrow$ & \textbf{95\% CI}" in said
    rows = re.findall(r"^    (\S+) & (\d+) & (\d+) & (-\d+/\+\d+) & (\d+)\\\\$", said, re.M)
    assert len(rows) == 3
    assert r"c\_50\%" in {row[0] for row in rows}


# --- Which files are taken -----------------------------------------------------------------------


def test_a_mark_quotes_other_columns_blank_lines_and_windows_ends_do_not_matter(
    votes: Any,
) -> None:
    plain = document(votes(*PLAIN), rounds=100)["standings"]
    same = [f'x,"{line.replace(",", chr(34) + "," + chr(34))}"' for line in PLAIN]
    file = votes(*same, "", head=f"more,{HEAD}", start="﻿", end="\r\n")
    assert document(file, rounds=100)["standings"] == plain


@pytest.mark.parametrize(
    ("separator", "encoding"),
    [(";", "utf-8"), ("\t", "utf-16"), ("|", "utf-16-le"), (",", "utf-16-be"), (";", "utf-16")],
)
def test_separators_and_utf_16_are_recognised(
    votes: Any, tmp_path: Path, separator: str, encoding: str
) -> None:
    plain = document(votes(*PLAIN), rounds=100)["standings"]
    path = tmp_path / "other.csv"
    text = "\n".join([HEAD, *PLAIN]).replace(",", separator) + "\n"
    path.write_bytes(text.encode(encoding))
    assert document(str(path), rounds=100)["standings"] == plain


def test_spaces_around_names_and_empty_columns_at_the_end_do_not_count(votes: Any) -> None:
    plain = document(votes(*PLAIN), rounds=100)["standings"]
    lines = [f" {line.replace(',', ' ,')},," if n % 2 else line for n, line in enumerate(PLAIN)]
    assert document(votes(*lines, head=f"{HEAD},"), rounds=100)["standings"] == plain


def test_a_cell_of_a_column_that_is_passed_over_may_be_long(votes: Any) -> None:
    lines = [f"{PLAIN[0]},{'x' * 200_000}", *(f"{line}," for line in PLAIN[1:])]
    plain = document(votes(*PLAIN), rounds=100)["standings"]
    assert document(votes(*lines, head=f"{HEAD},comment"), rounds=100)["standings"] == plain


@pytest.mark.parametrize("kind", ["jsonl", "parquet"])
def test_json_lines_and_parquet_are_read(votes: Any, tmp_path: Path, kind: str) -> None:
    plain = document(votes(*PLAIN), rounds=100)["standings"]
    rows = [dict(zip(HEAD.split(","), line.split(","), strict=True)) for line in PLAIN]
    path = tmp_path / "votes"
    if kind == "parquet":
        parquet.write_table(pyarrow.Table.from_pylist(rows), path)
    else:
        path.write_text("\n".join(json.dumps(row | {"more": 1}) for row in rows))
    assert document(str(path), rounds=100)["standings"] == plain


def test_a_wrong_line_of_json_is_named(tmp_path: Path) -> None:
    path = tmp_path / "votes.jsonl"
    good = json.dumps({"model_a": "a", "model_b": "b", "winner": "tie"})
    path.write_text(f"{good}\n{good}\nnothing\n")
    with pytest.raises(CsvNotRated, match="line 3: no JSON object"):
        run(file=str(path))


def test_a_file_with_a_judge_and_no_item_is_clustered_by_judge(votes: Any) -> None:
    lines = [line.rpartition(",")[0] for line in clustered()]
    found = document(votes(*lines, head=f"{HEAD},judge"), rounds=100)
    assert (found["resample"], found["intervals"]) == ("judge", "closed form")
    assert "names no item" in found["notes"][0]


def test_davidson_rank_sets_pairs_and_cross_check_are_offered(votes: Any) -> None:
    file = votes(*clustered(900), head=WITH_CLUSTERS)
    found = document(file, method="davidson", rounds=100)
    assert found["method"] == "davidson"
    found = document(file, rounds=100)
    assert [pair["a"] + pair["b"] for pair in found["pairs"]] == ["ab", "ac", "bc"]
    assert all(0.0 < pair["p_adjusted"] <= 1.0 for pair in found["pairs"])
    for line in found["standings"]:
        assert 1 <= line["rank_best"] <= line["rank_worst"] <= 3
        assert line["check_lower"] <= line["rating"] <= line["check_upper"]
    said = run(file=file, rounds=100)
    assert "of 3 pairs are told apart with all of them judged at once" in said
    assert "Bounds by the plain sandwich differ" in said


def test_groups_that_were_never_compared_stand_apart_in_the_table(votes: Any) -> None:
    other = [line.replace("a,", "x,").replace("b,", "y,").replace("c,", "z,") for line in PLAIN]
    lines = run(file=votes(*PLAIN, *other), rounds=100).splitlines()
    assert [n for n, line in enumerate(lines) if "rated by itself:" in line] == [1, 5]


def test_online_elo_does_not_depend_on_the_order_of_lines_unless_asked_to(votes: Any) -> None:
    def standings(lines: list[str], order: str) -> Any:
        return document(votes(*lines), method="elo", order=order, rounds=40)["standings"]

    turned = list(reversed(PLAIN))
    assert standings(PLAIN, "shuffled") == standings(turned, "shuffled")
    assert standings(PLAIN, "recorded") != standings(turned, "recorded")


def test_names_may_hold_commas_quotes_and_line_breaks(votes: Any) -> None:
    lines = [line.replace("b,", '"b, ""the\nother""",') for line in PLAIN]
    found = document(votes(*lines), rounds=50)
    assert 'b, "the\nother"' in {row["model"] for row in found["standings"]}


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        (["a,b,model_a", "a,b,both"], "line 3: the winner 'both' is none of model_a, model_b, "),
        (["a,b,TIE"], "line 2: the winner 'TIE' is none of"),
        (["a,b,"], "line 2: winner is empty"),
        (["a,b,tie", "", "a,,tie"], "line 4: model_b is empty"),
        (["a,b,tie", "a, NaN ,tie"], "line 3: model_b is 'NaN', which is no name"),
        (["a,b,tie", " a ,a,tie"], "line 3: 'a' is compared with itself"),
        (["a,b,tie", "a,b,tie,,x"], "line 3: there are 5 cells, in the first line 3"),
        (["a,b,tie", "a,a,model_a"], "line 3: 'a' is compared with itself"),
        (["a,b,tie", "a,b"], "line 3: there are 2 cells, in the first line 3"),
        (['"a\nx",b,tie', "a,b,nobody"], "line 4: the winner 'nobody'"),
        (["a,b,tie", '"a,b,tie'], "line 3: unexpected end of data"),
    ],
)
def test_a_wrong_line_is_named_with_what_is_allowed(
    votes: Any, lines: list[str], sentence: str
) -> None:
    with pytest.raises(CsvNotRated, match=re.escape(sentence)):
        run(file=votes(*lines))


def test_a_wrong_line_far_down_has_its_number(votes: Any) -> None:
    with pytest.raises(CsvNotRated, match="line 45002: the winner 'left' is none of"):
        run(file=votes(*PLAIN * 500, "a,b,left", *PLAIN))


@pytest.mark.parametrize(
    ("head", "sentence"),
    [
        ("model_a,model_b,outcome", "line 1: there is no column 'winner'; needed are model_a, "),
        ("model_a,model_b,winner,winner", "line 1: the column 'winner' is there twice"),
    ],
)
def test_a_missing_or_double_column_is_named(votes: Any, head: str, sentence: str) -> None:
    with pytest.raises(CsvNotRated, match=sentence):
        run(file=votes("a,b,tie", head=head))


def test_an_empty_file_a_missing_one_and_foreign_letters_are_errors(tmp_path: Path) -> None:
    path = tmp_path / "votes.csv"
    with pytest.raises(CsvNotRated, match="No such file"):
        run(file=str(path))
    path.write_bytes(b"")
    with pytest.raises(CsvNotRated, match="line 1: the file is empty; needed are model_a"):
        run(file=str(path))
    path.write_bytes(f"{HEAD}\na,b,tie\nb\xfc,b,tie\n".encode("latin-1"))
    with pytest.raises(CsvNotRated, match="can't decode byte 0xfc"):
        run(file=str(path))


def test_a_column_that_is_resampled_must_be_there_and_filled(votes: Any) -> None:
    with pytest.raises(CsvNotRated, match="no column 'judge', which --resample judge needs"):
        run(file=votes(*PLAIN), resample="judge")
    file = votes("a,b,tie,j,i", "a,b,tie,,i", head=WITH_CLUSTERS)
    with pytest.raises(CsvNotRated, match="line 3: judge is empty"):
        run(file=file)
    assert document(file, resample="vote", rounds=10)["votes"] == 2


@pytest.mark.parametrize("options", [{"rounds": 0}, {"rounds": 100_001}, {"seed": -1}])
def test_options_out_of_range_are_errors(votes: Any, options: dict[str, Any]) -> None:
    with pytest.raises(CsvNotRated, match="not "):
        run(file=votes(*PLAIN), **options)


def test_votes_that_repeat_one_are_counted_and_named(votes: Any) -> None:
    lines = clustered()
    found = document(votes(*lines, *lines[:5], head=WITH_CLUSTERS), rounds=50)
    plain = document(votes(*lines, head=WITH_CLUSTERS), rounds=50)
    assert found["votes"] == len(lines) + 5
    before = re.search(r"(\d+) votes repeat an earlier one", " ".join(plain["notes"]))
    after = re.search(r"(\d+) votes repeat an earlier one", " ".join(found["notes"]))
    assert after is not None
    assert int(after[1]) == 5 + (int(before[1]) if before else 0)


def test_what_votes_do_not_determine_is_null_and_explained(votes: Any) -> None:
    found = document(votes())
    assert (found["status"], found["standings"]) == ("no votes", [])
    found = document(votes("a,b,model_a"))
    assert found["status"] == "unbounded"
    assert all(row["rating"] is None for row in found["standings"])
    assert found["notes"][0] == (
        "Nobody else scored against a: there is no upper limit. "
        "b scored against nobody else: there is no lower limit."
    )
    assert "-0/+0" not in run(file=votes("a,b,tie"))
    two = [*PLAIN, *[line.replace("a,", "x,").replace("b,", "y,") for line in PLAIN[:55]]]
    parts = document(votes(*two), rounds=50)
    assert parts["status"] == "disconnected"
    assert [row["part"] for row in parts["standings"]] == [0, 0, 0, 1, 1]


# --- The process ---------------------------------------------------------------------------------


def test_django_takes_the_same_way(votes: Any) -> None:
    said = io.StringIO()
    file = votes(*PLAIN)
    call_command("rate_csv", file, "--rounds", "50", "--format", "json", stdout=said)
    assert said.getvalue() == run(file=file, rounds=50, format="json")
    with pytest.raises(CommandError, match="line 2"):
        call_command("rate_csv", votes("a,b,x"))


def manage(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "manage.py", "rate_csv", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )


def test_the_command_line_prints_the_table_or_one_sentence(votes: Any) -> None:
    done = manage(votes(*PLAIN), "--rounds", "50")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("Model")
    failed = manage(votes("a,b,draw"))
    assert (failed.returncode, failed.stdout) == (1, "")
    assert failed.stderr.count("\n") == 1
    assert "line 2: the winner 'draw' is none of model_a, model_b, tie" in failed.stderr
    assert manage(votes(*PLAIN), "--method", "glicko").returncode == 2
