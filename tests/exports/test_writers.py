import csv
import io
import json
from datetime import UTC, datetime
from typing import Any

import pytest

from arena.exports.latex import escape
from arena.models import Snapshot, Study
from arena.rating.comparisons import Estimate
from arena.rating.lines import whole_percent
from arena.results.exports.tables import (
    EARLY_LOOK,
    SIMULATED_TABLE,
    LeaderboardTable,
    Row,
    for_experts,
)
from arena.results.exports.writers import FORMATS
from arena.templatetags.results import estimate, percent

PAPER = (
    ("interPlan", "", 1, 1042, 9, 11, 1960),
    ("GPT-4o OTM", "OTM", 1, 1039, 9, 11, 1720),
    ("Gemini-1.5-Flash vQA", "vQA", 1, 1025, 12, 13, 720),
)


def row(model: str, variant: str = "", **changes: object) -> Row:
    made: dict[str, Any] = {
        "name": model, "variant": variant, "slug": model.lower(), "kind": "llm",
        "is_simulated": False, "rank": 1, "rating": 1000.0, "lower": 990.0, "upper": 1010.0,
        "votes": 10, "wins": 4, "ties": 3, "losses": 3, "note": "",
    }  # fmt: skip
    return Row(**made | changes)


def table(
    *rows: Row, study: str = "Round 1", left_out: dict[str, int] | None = None, **rating: object
) -> LeaderboardTable:
    values: dict[str, Any] = {
        "method": "bt",
        "rounds": 1000,
        "resampling_unit": "vote",
        "seed": 7,
        "votes_counted": 5760,
        "made_at": datetime(2026, 1, 5, tzinfo=UTC),
        "votes_sha256": "ab" * 32,
    }
    snapshot = Snapshot(study=Study(name=study), **values | rating)
    return LeaderboardTable(snapshot=snapshot, rows=rows, left_out=left_out or {"superseded": 3})


def latex(given: LeaderboardTable) -> str:
    return FORMATS["latex"].write(given).decode()


def papers_rows() -> list[Row]:
    made = []
    for name, variant, rank, elo, low, up, votes in PAPER:
        columns = {
            "rank": rank, "rank_best": 1, "rank_worst": 3, "votes": votes,
            "rating": elo + 0.2, "lower": float(elo - low), "upper": float(elo + up),
        }  # fmt: skip
        made.append(row(name, variant, **columns))
    return made


def test_latex_has_the_form_of_the_papers_table() -> None:
    body = [line for line in latex(table(*papers_rows())).splitlines() if line[0] != "%"]
    assert body[4:13] == [
        r"    \toprule",
        r"    \textbf{Model} & \textbf{Rank} & \textbf{Elo}~$\uparrow$ & "
        r"\textbf{95\% CI} & \textbf{Votes} & \textbf{95\% ranks}\\",
        r"    \midrule",
        r"    interPlan & 1 & 1042 & -9/+11 & 1960 & 1--3\\",
        r"    GPT-4o \texttt{OTM} & 1 & 1039 & -9/+11 & 1720 & 1--3\\",
        r"    Gemini-1.5-Flash \texttt{vQA} & 1 & 1025 & -12/+13 & 720 & 1--3\\",
        r"    \bottomrule",
        r"    \end{tabular}",
        r"    \caption{Elo with 95\% confidence intervals: Bradley-Terry on the Elo scale, 95 \% "
        r"intervals by 1000 resamples of votes, seed 7; 5760 votes.}",
    ]


def test_tex_specials_are_escaped_and_no_line_break_leaves_a_comment() -> None:
    assert "    {}[x] " in latex(table(row("[x]")))
    assert escape("a_b | 5% & $x {#1} ~^\\") == (
        r"a\_b \textbar{} 5\% \& \$x \{\#1\} "
        r"\textasciitilde{}\textasciicircum{}\textbackslash{}"
    )
    text = latex(table(row("x"), study="Round\n\\input{evil}"))
    assert all(line.startswith("%") for line in text.splitlines() if "evil" in line)


def test_a_table_says_that_it_is_simulated_and_an_early_look() -> None:
    plain = latex(table(row("x")))
    marked = latex(table(row("x"), includes_simulated=True, is_early=True))
    for warning in (SIMULATED_TABLE, EARLY_LOOK):
        assert f"% {warning}" in marked
        assert warning not in plain
    assert parsed(table(row("x"), is_early=True))[0]["early"] == "yes"


def test_experts_do_not_read_that_votes_of_authors_are_left_out() -> None:
    shown = for_experts(table(row("x"), left_out={"filtered": 1, "own": 2, "superseded": 3}))
    assert shown.left_out == {"filtered": 3, "superseded": 3}


def parsed(given: LeaderboardTable) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(FORMATS["csv"].write(given).decode())))


def test_csv_has_a_line_per_contestant() -> None:
    first, *_ = parsed(table(*papers_rows()))
    wanted = {
        "model": "interPlan", "rank": "1", "elo": "1042.20", "lower": "1033.00",
        "upper": "1053.00", "votes": "1960", "wins": "4", "ties": "3", "losses": "3",
        "simulated": "no", "study_simulated": "no",
    }  # fmt: skip
    assert {name: first[name] for name in wanted} == wanted


@pytest.mark.parametrize("start", ["=", "+", "-", "@", "\t", "\r", "\n"])
def test_no_cell_is_a_formula(start: str) -> None:
    line = parsed(table(row(f"{start}cmd|calc", note=f"{start}1"), study=f"{start}x"))[0]
    kept = "'" + start.replace("\r", " ").replace("\n", " ")
    cells = [line[name] for name in ("model", "note", "study")]
    assert cells == [f"{kept}cmd|calc", f"{kept}1", f"{kept}x"]


def test_a_negative_rating_is_a_number_not_a_formula() -> None:
    assert parsed(table(row("x", rating=-12.5)))[0]["elo"] == "-12.50"


def test_json_has_everything_that_makes_the_table_again() -> None:
    document = json.loads(FORMATS["json"].write(table(*papers_rows(), includes_simulated=True)))
    assert document["simulated"] is True
    assert document["method"] == {
        "name": "bt",
        "text": "Bradley-Terry on the Elo scale, 95 % intervals by 1000 resamples of votes, "
        "seed 7",
        "resampling_unit": "vote",
        "rounds": 1000,
        "degenerate_rounds": 0,
        "seed": 7,
    }
    assert document["votes"] == {
        "counted": 5760,
        "left_out": {"superseded": 3},
        "sha256": "ab" * 32,
    }
    first = document["standings"][0]
    wanted = ("model", "rank", "rating", "lower", "upper", "votes")
    assert [first[key] for key in wanted] == ["interPlan", 1, 1042.2, 1033.0, 1053.0, 1960]


@pytest.mark.parametrize(
    ("share", "shown"),
    [(0.0, 0), (0.005, 0), (0.015, 2), (0.425, 42), (0.575, 58), (0.995, 100), (1.0, 100)],
)
def test_a_half_goes_to_the_even_number(share: float, shown: int) -> None:
    assert whole_percent(share) == shown


def test_pages_print_it_so() -> None:
    assert percent(0.575) == "58 %"
    assert "58 %" in estimate(Estimate(value=0.575, lower=0.425, upper=0.995), "percent")
