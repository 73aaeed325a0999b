"""Votes come in while the product itself writes or computes something long."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from django.db import connection
from pytest_django import Settings

from arena.errors import VotesUnreadable
from arena.models import ImportedVote, Matchup, Snapshot, Study, Vote, VoteFile
from arena.results.services import ratings, vote_files
from arena.results.services.vote_files import DEAD_AFTER, import_votes
from arena.studies.services.opening import close_study
from arena.voting.services.casting import decision_of, receive_vote
from augment.errors import Conflict
from augment.models import Event
from tests.opening import open_study
from tests.study_rows import a_study, matchups_of, vote

pytestmark = pytest.mark.django_db(transaction=True)

LINES = ("x,y,model_a", "y,z,model_a", "x,z,tie", "z,x,model_b", "y,x,tie", "z,y,model_b")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "votes.csv"
    path.write_text("\n".join(("model_a,model_b,winner", *LINES)))
    return path


@pytest.fixture(autouse=True)
def _impatient(settings: Settings) -> None:
    settings.VOTE_WAIT_S = 1


def store(matchup: Matchup) -> None:
    """A vote that comes in by another thread of the web server."""

    def send() -> None:
        decision = decision_of(matchup_code=matchup.code, key=matchup.code, outcome="left")
        try:
            receive_vote(expert=matchup.expert, decision=decision)
        finally:
            connection.close()

    with ThreadPoolExecutor(1) as web:
        web.submit(send).result()


def between_batches(monkeypatch: pytest.MonkeyPatch, act: Callable[[], None]) -> None:
    """Rows are written two at a time, and this happens before the third one is read."""
    plain = vote_files._rows

    def rows(*given: Any) -> Iterator[Any]:
        for number, row in enumerate(plain(*given)):
            if number == 2:
                act()
            yield row

    monkeypatch.setattr(vote_files, "AT_ONCE", 2)
    monkeypatch.setattr(vote_files, "_rows", rows)


def nothing_is_left() -> bool:
    return not (VoteFile.objects.exists() or ImportedVote.objects.exists())


def test_votes_come_in_between_the_batches_of_an_import_that_nobody_sees_yet(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    matchup = matchups_of(a_study(), "eva")[0]
    seen: list[int] = []

    def act() -> None:
        store(matchup)
        seen.append(ImportedVote.objects.count())
        assert not Study.objects.filter(name="Elsewhere").exists()
        assert not Event.objects.filter(verb="import votes").exists()

    between_batches(monkeypatch, act)
    found = import_votes(path=file, name="Elsewhere")
    assert seen == [2]
    assert Vote.objects.count() == 1
    assert (found.votes, found.contestants) == (6, 3)
    assert ImportedVote.objects.filter(file__study=found.study).count() == 6
    assert Event.objects.filter(verb="import votes").count() == 1


@pytest.mark.parametrize("fault", [KeyboardInterrupt(), VotesUnreadable("gone"), OSError()])
def test_an_import_that_stops_midway_leaves_nothing(
    file: Path, monkeypatch: pytest.MonkeyPatch, fault: BaseException
) -> None:
    def act() -> None:
        assert ImportedVote.objects.count() == 2
        raise fault

    between_batches(monkeypatch, act)
    with pytest.raises(type(fault)):
        import_votes(path=file, name="Elsewhere")
    assert nothing_is_left()
    assert not Study.objects.exists()


def half_written(*, ago: timedelta) -> VoteFile:
    """What a process that was killed leaves behind."""
    left = VoteFile.objects.create(name="half.csv", sha256="0" * 64)
    for line in (2, 3, 4):
        ImportedVote.objects.create(file=left, line=line, first="x", second="y", outcome="tie")
    VoteFile.objects.filter(pk=left.pk).update(written_at=left.made_at - ago)
    return left


def test_the_next_import_removes_what_a_killed_one_left(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(vote_files, "AT_ONCE", 2)
    dead, alive = half_written(ago=2 * DEAD_AFTER), half_written(ago=DEAD_AFTER / 2)
    found = import_votes(path=file, name="Elsewhere")
    assert not VoteFile.objects.filter(pk=dead.pk).exists()
    assert ImportedVote.objects.filter(file=alive).count() == 3
    assert ImportedVote.objects.count() == 3 + found.votes


def test_an_import_that_was_taken_for_dead_says_so_and_leaves_nothing(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def act() -> None:
        VoteFile.objects.update(written_at="2020-01-01T00:00:00Z")
        assert vote_files.remove_dead() == 1

    between_batches(monkeypatch, act)
    with pytest.raises(Conflict, match=r"votes\.csv stood still for more than 10 minutes"):
        import_votes(path=file, name="Elsewhere")
    assert nothing_is_left()


def test_votes_come_in_while_a_rating_is_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    over = a_study(votes_per_expert=3)
    for matchup in over.matchups.all():
        vote(matchup)
    other = open_study(
        name="Round 2",
        votes_per_expert=3,
        seed=1,
        contestants=["ann", "bob"],
        scenarios=["place-0", "place-1", "place-2"],
        experts=["eva"],
    )
    plain = ratings.compute

    def compute(*given: Any) -> Any:
        store(matchups_of(other, "eva")[0])
        assert not Snapshot.objects.exists()
        return plain(*given)

    monkeypatch.setattr(ratings, "compute", compute)
    snapshot = ratings.rate_now(study=close_study(study=over), rounds=10)
    assert (snapshot.state, snapshot.votes_counted) == (Snapshot.State.READY, 6)
    assert Vote.objects.filter(matchup__study=other).count() == 1
