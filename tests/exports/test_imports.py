"""Votes from elsewhere: kept whole or not at all, then rated and written like any other."""

from pathlib import Path

import pytest
from django.core.management import CommandError, call_command

from arena.models import ImportedVote, Study, VoteFile
from arena.results.exports.tables import leaderboard_table
from arena.results.exports.votes import VOTE_FORMATS, vote_table
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.importing import import_votes
from augment.models import Event

pytestmark = pytest.mark.django_db

HEAD = "model_a,model_b,winner,judge,item"


def written(folder: Path, *lines: str, head: str = HEAD) -> Path:
    path = folder / "arena.csv"
    path.write_text("\n".join([head, *lines]) + "\n")
    return path


def lines(votes: int = 36) -> list[str]:
    """x beats y and z mostly, y beats z mostly; three judges, four items."""
    pairs = (("x", "y"), ("y", "z"), ("z", "x"))
    found = []
    for number in range(votes):
        one, other = pairs[number % 3]
        better = "model_a" if (one, other) != ("z", "x") else "model_b"
        worse = "model_b" if better == "model_a" else "model_a"
        winner = (better, better, "tie", worse, "tie (bothbad)")[number // 3 % 5]
        found.append(f"{one},{other},{winner},j{number % 4},i{number // 3 % 5}")
    return found


def test_a_file_becomes_a_closed_study_that_is_rated(tmp_path: Path) -> None:
    found = import_votes(path=written(tmp_path, *lines()), name="Elsewhere")
    assert (found.votes, found.contestants) == (36, 3)
    study = Study.objects.get(name="Elsewhere")
    assert study.state == "closed"
    assert Event.objects.filter(verb="import votes").count() == 1
    snapshot = rate(study=study, rounds=200)
    assert snapshot.resampling_unit == "two-way"
    assert [row.slug for row in leaderboard_table(snapshot).rows] == ["x", "y", "z"]
    assert {row.kind for row in leaderboard_table(snapshot).rows} == {"imported"}
    assert snapshot.votes_counted == 36


@pytest.mark.parametrize(
    ("faulty", "sentence"),
    [
        ("x,y,left,j0,i0", r"line 38: .*model_a.*tie \(bothbad\)"),
        (f"{'x' * 201},y,tie,j0,i0", "line 38: model_a has 201 signs, 200 are allowed"),
    ],
)
def test_a_fault_has_its_line_and_keeps_nothing(
    tmp_path: Path, faulty: str, sentence: str
) -> None:
    with pytest.raises(CommandError, match=sentence):
        call_command("import_votes", str(written(tmp_path, *lines(), faulty)))
    for model in (Study, VoteFile, ImportedVote):
        assert not model.objects.exists()


def test_what_was_exported_can_be_imported_and_gives_the_same_table(tmp_path: Path) -> None:
    study = import_votes(path=written(tmp_path, *lines()), name="First").study
    first = rate(study=study, rounds=100, seed=3)
    again = tmp_path / "again.csv"
    again.write_bytes(VOTE_FORMATS["csv"].write(vote_table(first)))
    second = rate(study=import_votes(path=again, name="Second").study, rounds=100, seed=3)
    one, other = (leaderboard_table(snapshot).rows for snapshot in (first, second))
    assert one == other
