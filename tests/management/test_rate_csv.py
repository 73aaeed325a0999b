"""Votes from elsewhere: how they are rated, and what is printed."""

import csv
import io
import re
import subprocess
import sys
from typing import Any

import pytest
from django.core.management import call_command

from arena.management.rate_csv import COLUMNS, CsvNotRated, run
from tests.house.source import ROOT
from tests.management.votes import PLAIN, WITH_CLUSTERS, clustered, document


def test_json_has_standings_best_first(votes: Any) -> None:
    found = document(votes(*PLAIN))
    assert [list(row) for row in found["standings"]] == [list(COLUMNS)] * 3
    ratings = [row["elo"] for row in found["standings"]]
    assert ratings == sorted(ratings, reverse=True)
    assert sum(ratings) == pytest.approx(3000, abs=0.01)
    assert {row["model"]: row["votes"] for row in found["standings"]} == {
        "a": 69,
        "b": 76,
        "c": 35,
    }
    assert found["tie_share"] == pytest.approx(14 / 90, abs=1e-4)
    for row in found["standings"]:
        assert row["lower"] < row["elo"] < row["upper"]


def test_online_elo_resamples_votes_and_says_what_its_interval_is_not(votes: Any) -> None:
    file = votes(*clustered(), head=WITH_CLUSTERS)
    found = document(file, method="elo", rounds=100)
    assert (found["method"], found["resample"]) == ("elo", "vote")
    assert any("does not shrink with more votes" in note for note in found["notes"])
    with pytest.raises(CsvNotRated, match="Elo resamples single votes only, not by expert"):
        run(file=file, method="elo", resample="expert")
    with pytest.raises(CsvNotRated, match="resamples are of single votes, not of experts"):
        run(file=file, resample="expert", intervals="resamples")
    with pytest.raises(CsvNotRated, match="single votes have no effects to draw"):
        run(file=file, resample="vote", intervals="bootstrap")


def test_a_column_that_is_resampled_must_be_there_and_filled(votes: Any) -> None:
    with pytest.raises(CsvNotRated, match="no column 'judge', which --resample expert needs"):
        run(file=votes(*PLAIN), resample="expert")
    file = votes("a,b,tie,j,i", "a,b,tie,,i", head=WITH_CLUSTERS)
    with pytest.raises(CsvNotRated, match=r"votes.csv: line 3: judge is empty\.\Z"):
        run(file=file)
    assert document(file, resample="vote", rounds=100)["votes"] == 2


@pytest.mark.parametrize("options", [{"rounds": 99}, {"rounds": 100_001}, {"seed": -1}])
def test_options_out_of_range_are_errors(votes: Any, options: dict[str, Any]) -> None:
    with pytest.raises(CsvNotRated, match=r"not .*\d\.\Z"):
        run(file=votes(*PLAIN), **options)


def test_the_same_seed_gives_the_same_text_and_the_order_of_lines_does_not_count(
    votes: Any,
) -> None:
    lines = clustered()
    how: dict[str, Any] = {"rounds": 200}
    first = run(file=votes(*lines, head=WITH_CLUSTERS), seed=3, **how)
    assert first == run(file=votes(*reversed(lines), head=WITH_CLUSTERS), seed=3, **how)
    assert first != run(file=votes(*lines, head=WITH_CLUSTERS), seed=4, **how)


def test_csv_cells_are_no_formulas(votes: Any, capsys: pytest.CaptureFixture[str]) -> None:
    lines = [line.replace("a,", "=1+1,").replace(",a,", ",=1+1,") for line in PLAIN]
    said = run(file=votes(*lines), rounds=100, format="csv")
    rows = list(csv.DictReader(io.StringIO(said)))
    assert list(rows[0]) == list(COLUMNS)
    assert {row["model"] for row in rows} >= {"'=1+1"}
    assert "no column judge and no column item" in capsys.readouterr().err


def test_davidson_rank_sets_and_pairs_are_offered(votes: Any) -> None:
    file = votes(*clustered(900), head=WITH_CLUSTERS)
    found = document(file, method="davidson", rounds=100)
    assert found["method"] == "davidson"
    found = document(file, rounds=100)
    assert [pair["a"] + pair["b"] for pair in found["pairs"]] == ["ab", "ac", "bc"]
    assert all(0.0 < pair["p_adjusted"] <= 1.0 for pair in found["pairs"])
    for line in found["standings"]:
        assert 1 <= line["rank_best"] <= line["rank_worst"] <= 3
    said = run(file=file, rounds=100)
    assert "of 3 pairs are told apart with all of them judged at once" in said
    blinds: list[dict[str, Any]] = [
        {"resample": "vote"},
        {"resample": "expert"},
        {"method": "elo"},
    ]
    for blind in blinds:
        said = run(file=file, rounds=100, **blind)
        assert "told apart" not in said, blind
        assert "95% ranks" not in said, blind
        assert "nobody is called better by them" in said, blind
        found = document(file, rounds=100, **blind)
        assert found["pairs"] is None, blind
        assert {line["rank_best"] for line in found["standings"]} == {None}, blind


@pytest.mark.parametrize("alone", ["judge", "item"])
def test_one_judge_or_item_speaks_for_no_whole_table(votes: Any, alone: str) -> None:
    one = re.compile({"judge": r"j\d+", "item": r"i\d+"}[alone])
    file = votes(*[one.sub("x", line) for line in clustered(600)], head=WITH_CLUSTERS)
    said = run(file=file, rounds=100)
    assert "told apart" not in said
    assert "95% ranks" not in said
    assert f"All votes belong to one {alone}" in said
    said = run(file=file, rounds=100, resample={"judge": "expert", "item": "scenario"}[alone])
    assert f"No intervals can be given: all votes belong to one {alone}, of which" in said


def test_what_votes_do_not_determine_is_null_and_explained(votes: Any) -> None:
    found = document(votes("a,b,model_a"))
    assert found["status"] == "unbounded"
    assert all(row["elo"] is None for row in found["standings"])
    assert found["notes"][0] == (
        "Nobody else scored against a: there is no upper limit. "
        "b scored against nobody else: there is no lower limit."
    )
    assert "-0/+0" not in run(file=votes("a,b,tie"))
    two = [*PLAIN, *[line.replace("a,", "x,").replace("b,", "y,") for line in PLAIN[:55]]]
    parts = document(votes(*two), rounds=100)
    assert parts["status"] == "disconnected"
    assert [row["part"] for row in parts["standings"]] == [0, 0, 0, 1, 1]


# --- The process ---------------------------------------------------------------------------------


def test_django_passes_every_option_on(votes: Any) -> None:
    printed = io.StringIO()
    file = votes(*clustered(), head=WITH_CLUSTERS)
    options = {"rounds": 100, "format": "json", "intervals": "closed", "seed": 2}
    call_command("rate_csv", file, stdout=printed, **options)
    assert printed.getvalue() == run(file=file, **options)  # type: ignore[arg-type]


def manage(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "manage.py", "rate_csv", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )


def test_the_command_line_prints_the_table_or_one_sentence(votes: Any) -> None:
    done = manage(votes(*PLAIN), "--rounds", "100")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("Model")
    failed = manage(votes("a,b,draw"))
    assert (failed.returncode, failed.stdout) == (1, "")
    assert failed.stderr.count("\n") == 1
    assert "line 2: the winner 'draw' is none of model_a, model_b, tie" in failed.stderr
