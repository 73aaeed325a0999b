"""The columns of a leaderboard: the same in every file, and those of before as they were."""

import csv
import hashlib
import io
import json

import pytest
from pyarrow import parquet

from arena.exports.cells import csv_text
from arena.results.exports.tables import LeaderboardTable, leaderboard_table
from arena.results.exports.writers import FORMATS, plain_text
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
