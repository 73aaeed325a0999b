"""Votes from elsewhere: how they are rated, and what is printed."""

import csv
import io
import re
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from django.core.management import call_command

from arena.management.rate_csv import COLUMNS, CsvNotRated, run
from arena.rating.comparisons import Comparisons
from arena.rating.leaderboard import rate
from tests.house.source import ROOT
from tests.management.votes import PLAIN, WITH_CLUSTERS, clustered, document
from tests.rating.votes import simulated


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
    found = document(file, method="elo", rounds=50)
    assert (found["method"], found["resample"]) == ("elo", "vote")
    assert any("does not shrink with more votes" in note for note in found["notes"])
    with pytest.raises(CsvNotRated, match="elo resamples single votes only; 'expert' needs"):
        run(file=file, method="elo", resample="expert")


def test_the_same_seed_gives_the_same_text_and_the_order_of_lines_does_not_count(
    votes: Any,
) -> None:
    lines = clustered()
    first = run(file=votes(*lines, head=WITH_CLUSTERS), seed=3, rounds=200)
    assert first == run(file=votes(*reversed(lines), head=WITH_CLUSTERS), seed=3, rounds=200)
    assert first != run(file=votes(*lines, head=WITH_CLUSTERS), seed=4, rounds=200)


def test_csv_cells_are_no_formulas(votes: Any, capsys: pytest.CaptureFixture[str]) -> None:
    lines = [line.replace("a,", "=1+1,").replace(",a,", ",=1+1,") for line in PLAIN]
    said = run(file=votes(*lines), rounds=100, format="csv")
    rows = list(csv.DictReader(io.StringIO(said)))
    assert list(rows[0]) == list(COLUMNS)
    assert {row["model"] for row in rows} >= {"'=1+1"}
    assert "does not name both" in capsys.readouterr().err


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
        assert "told apart" not in run(file=file, rounds=100, **blind), blind
        assert document(file, rounds=100, **blind)["pairs"] is None, blind


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


def test_what_votes_do_not_determine_is_null_and_explained(votes: Any) -> None:
    found = document(votes())
    assert (found["status"], found["standings"]) == ("no votes", [])
    found = document(votes("a,b,model_a"))
    assert found["status"] == "unbounded"
    assert all(row["elo"] is None for row in found["standings"])
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


def a_file(votes: Any) -> tuple[Any, Comparisons]:
    """Votes of three models with how many objects each showed."""
    drawn = simulated([1060.0, 1000, 940], 240, 3, experts=6, scenarios=24)
    rng = np.random.default_rng(2)
    objects = rng.integers(0, 5, (240, 2))
    winner = {1.0: "model_a", 0.5: "tie", 0.0: "model_b"}
    lines = [
        f"{drawn.names[a]},{drawn.names[b]},{winner[score]},j{judge},i{item:02d},{mine},{theirs}"
        for a, b, score, judge, item, (mine, theirs) in zip(
            drawn.first.tolist(),
            drawn.second.tolist(),
            drawn.score.tolist(),
            drawn.expert.tolist(),
            drawn.scenario.tolist(),
            objects.tolist(),
            strict=True,
        )
    ]
    more = np.column_stack([np.ones(240), objects[:, 0] - objects[:, 1]]).astype(np.float64)
    file = votes(*lines, head=f"{WITH_CLUSTERS},objects_a,objects_b")
    return file, replace(drawn, covariates=more)


def test_ratings_are_adjusted_for_the_side_and_for_columns_of_numbers(votes: Any) -> None:
    file, drawn = a_file(votes)
    board = rate(drawn)
    found = document(file, adjust=("side", "objects"))
    ratings = {row["model"]: row["elo"] for row in found["standings"]}
    assert ratings == pytest.approx({line.name: line.rating for line in board.lines}, abs=1e-3)
    assert [one["name"] for one in found["covariates"]] == ["side", "objects"]
    points = [one["points"] for one in found["covariates"]]
    assert points == pytest.approx([one.points.value for one in board.coefficients], abs=1e-3)
    table = run(file=str(file), adjust=("objects",))
    assert "adjusted for objects; 95 % intervals" in table
    assert re.search(r"^objects: [+-]\d+\.\d points for one, 95 % ", table, re.M)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"adjust": ("length",)}, "no column 'length_a', which --adjust needs"),
        ({"adjust": ("weight",)}, "no column 'weight_a'"),
        ({"adjust": ("side", "side")}, "names something twice"),
        ({"adjust": ("side",), "method": "elo"}, "needs --method bt with intervals in closed"),
    ],
)
def test_what_the_file_does_not_have_is_refused(
    votes: Any, options: dict[str, Any], said: str
) -> None:
    file, _ = a_file(votes)
    with pytest.raises(CsvNotRated, match=said):
        run(file=str(file), **options)


@pytest.mark.parametrize("cell", ["x", "inf", "-1e999"])
def test_a_covariate_that_is_no_number_is_named_with_its_line(votes: Any, cell: str) -> None:
    file = votes(f"a,b,model_a,2,{cell}", "a,b,tie,2,1", head="model_a,model_b,winner,o_a,o_b")
    with pytest.raises(CsvNotRated, match=f"line 2: o_b is '{cell}', which is no number"):
        run(file=str(file), adjust=("o",))


@pytest.mark.parametrize(
    "options",
    [{"intervals": "resamples"}, {"method": "elo", "order": "recorded"}],
    ids=lambda options: " ".join(options),
)
def test_django_passes_every_option_on(votes: Any, options: dict[str, Any]) -> None:
    said = io.StringIO()
    file = votes(*clustered(), head=WITH_CLUSTERS)
    call_command("rate_csv", file, rounds=50, format="json", stdout=said, **options)
    assert said.getvalue() == run(file=file, rounds=50, format="json", **options)
    assert said.getvalue() != run(
        file=file, rounds=50, format="json", method=options.get("method", "bt")
    )


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
