"""Votes come in while the product itself writes or computes something long."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from django.db import connection
from pytest_django import Settings

from arena.models import Matchup, Snapshot, Vote
from arena.results.services import ratings
from arena.studies.services.opening import close_study
from arena.voting.services.casting import Decision, receive_vote
from tests.opening import open_study
from tests.study_rows import a_study, matchups_of, vote

pytestmark = pytest.mark.django_db(transaction=True)


@pytest.fixture(autouse=True)
def _impatient(settings: Settings) -> None:
    settings.VOTE_WAIT_S = 1


def store(matchup: Matchup) -> None:
    """A vote that comes in by another thread of the web server."""

    def send() -> None:
        decision = Decision(matchup=matchup.code, key=matchup.code, outcome="left")
        try:
            receive_vote(expert=matchup.expert, decision=decision)
        finally:
            connection.close()

    with ThreadPoolExecutor(1) as web:
        web.submit(send).result()


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
