"""The columns of a leaderboard: the same in every file, and those of before as they were."""

import csv
import hashlib
import io
import json
from itertools import combinations
from pathlib import Path

import pytest
from django.core.management import call_command
from pyarrow import parquet

from arena.exports.cells import csv_text
from arena.models import Snapshot, Study
from arena.rating.remarks import NOT_RANKED
from arena.results.exports.tables import LeaderboardTable, leaderboard_table
from arena.results.exports.writers import FORMATS, plain_text
from arena.results.services.ratings import rate_now as rate
from tests.results.old import OLD, stored

pytestmark = pytest.mark.django_db

ADDED = ("rank_best", "rank_worst", "preregistration", "options", "question", "sends")
"""The columns that files of an old rating did not have, in their order at the end."""
OF_ALL = ("preregistration", "question")
"""Those that JSON says once."""


@pytest.fixture
def table() -> LeaderboardTable:
    return leaderboard_table(stored(OLD["snapshot"]["results"]))


def digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def test_files_of_an_old_rating_are_what_they_were_but_for_the_ranks_at_their_ends(
    table: LeaderboardTable,
) -> None:
    head, *rows = csv.reader(io.StringIO(FORMATS["csv"].write(table).decode()))
    kept = len(head) - len(ADDED)
    assert tuple(head[kept:]) == ADDED
    before = csv_text(head[:kept], [row[:kept] for row in rows])
    assert digest(before) == OLD["files"]["leaderboard.csv"]
    document = json.loads(FORMATS["json"].write(table))
    for line in document["standings"]:
        of_a_line = [name for name in ADDED if name not in OF_ALL]
        assert list(line)[-len(of_a_line) :] == of_a_line
        for name in of_a_line:
            del line[name]
    for name in (*OF_ALL, "hypotheses"):
        del document[name]
    text = json.dumps(document, indent=2, ensure_ascii=False) + "\n"
    assert digest(text) == OLD["files"]["leaderboard.json"]


def test_best_and_worst_rank_stand_in_every_file(table: LeaderboardTable) -> None:
    wanted = [(row.rank_best, row.rank_worst) for row in table.rows]
    assert len(set(wanted)) > 1
    of_csv = csv.DictReader(io.StringIO(FORMATS["csv"].write(table).decode()))
    assert [(int(line["rank_best"]), int(line["rank_worst"])) for line in of_csv] == wanted
    of_json = json.loads(FORMATS["json"].write(table))["standings"]
    assert [(line["rank_best"], line["rank_worst"]) for line in of_json] == wanted
    of_parquet = parquet.read_table(io.BytesIO(FORMATS["parquet"].write(table))).to_pylist()
    assert [(line["rank_best"], line["rank_worst"]) for line in of_parquet] == wanted
    tex, text = FORMATS["latex"].write(table).decode(), plain_text(table)
    for best, worst in wanted:
        assert f" & {best}--{worst}\\\\\n" in tex
        assert f" {best}–{worst}\n" in text


# --- Open intervals and withheld ranks

ORDER = ["best", "few", "a", "b", "c", "d", "weak"]
RANKS = [1, None, 2, 2, 2, 2, 7]
FEW = (
    "no upper bound: hardly anybody scored; no rank, because the lower bound is not above the "
    "average"
)


def rated(folder: Path, *lines: str, rounds: int) -> Snapshot:
    """The rating of votes that were read from a file."""
    path = folder / "votes.csv"
    path.write_text("\n".join(["model_a,model_b,winner", *lines]) + "\n")
    call_command("import_votes", str(path), "--name", "Open", stdout=io.StringIO())
    return rate(study=Study.objects.get(name="Open"), rounds=rounds)


@pytest.fixture
def snapshot(tmp_path: Path) -> Snapshot:
    """Best won all, weak lost nearly all, few has six votes; four are close to each other."""
    lines = []
    for one, other in combinations("abcd", 2):
        lines += [f"{one},{other},model_a"] * 40 + [f"{one},{other},model_b"] * 38
    lines += [f"best,{one},model_a" for one in "abcd" for _ in range(30)]
    lines += [f"{one},weak,model_a" for one in "abcd" for _ in range(60)] + ["a,weak,model_b"]
    lines += ["few,a,model_a", "few,a,model_a", "few,a,model_b"] * 2
    return rated(tmp_path, *lines, rounds=1000)


def test_tables_of_every_format_have_the_same_order_bounds_and_reasons(snapshot: Snapshot) -> None:
    table = leaderboard_table(snapshot)
    assert [row.slug for row in table.rows] == ORDER
    assert [row.rank for row in table.rows] == RANKS
    document = json.loads(FORMATS["json"].write(table))["standings"]
    lines = list(csv.DictReader(io.StringIO(FORMATS["csv"].write(table).decode())))
    stored = parquet.read_table(io.BytesIO(FORMATS["parquet"].write(table))).to_pylist()
    for rows in (document, stored):
        assert [row["rank"] for row in rows] == RANKS
        assert [row["upper"] is None for row in rows] == [True, True, *[False] * 5]
        assert [row["lower"] is None for row in rows] == [True, *[False] * 5, True]
    assert [line["rank"] for line in lines] == [str(rank or "") for rank in RANKS]
    for rows in (document, stored, lines):
        notes = {row["slug"]: row["note"] for row in rows if row["note"]}
        assert notes == {
            "best": "no upper limit",
            "few": FEW,
            "weak": "no lower bound: hardly any score",
        }


def test_nobody_is_first_where_everybody_would_be(tmp_path: Path) -> None:
    table = leaderboard_table(rated(tmp_path, *["a,b,model_a", "a,b,model_b"] * 40, rounds=100))
    assert [row.rank for row in table.rows] == [None, None]
    assert NOT_RANKED in table.reasons
