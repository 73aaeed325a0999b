"""Votes that arrive at once, on the database as it is configured."""

import uuid
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from django.db import connection
from pytest_django import Settings

from arena.errors import AlreadyDecided, TooFast
from arena.models import Matchup, Snapshot, Vote
from arena.results.services import ratings
from arena.voting.services.casting import PACE_WINDOW, Decision, receive_vote
from tests.opening import open_study
from tests.study_rows import a_study, matchups_of, vote, vote_all

pytestmark = pytest.mark.django_db(transaction=True)

THREADS = 8


def cast(job: tuple[Matchup, uuid.UUID, str]) -> str:
    """One vote in a thread of its own; what became of it."""
    matchup, key, outcome = job
    try:
        return vote(matchup, outcome, key=key).outcome
    except AlreadyDecided as error:
        return f"decided: {error.outcome}"
    finally:
        connection.close()


def at_once(jobs: list[tuple[Matchup, uuid.UUID, str]]) -> list[str]:
    with ThreadPoolExecutor(max_workers=THREADS) as pool:
        return list(pool.map(cast, jobs))


def test_eight_threads_store_every_vote_once() -> None:
    experts = tuple(f"expert-{number}" for number in range(THREADS))
    study = a_study(experts=experts, scenarios=5, votes_per_expert=10)
    matchups = study.matchups.select_related("expert")
    jobs = [(matchup, uuid.uuid4(), "left") for matchup in matchups]
    replayed = [job for job in jobs for _ in range(2)]

    assert set(at_once(replayed)) == {"left"}

    assert Vote.objects.count() == len(jobs) == 80
    assert set(Vote.objects.values_list("key", flat=True)) == {key for _, key, _ in jobs}


def test_eight_keys_for_one_matchup_leave_one_vote() -> None:
    matchup = a_study().matchups.select_related("expert").first()
    became = Counter(at_once([(matchup, uuid.uuid4(), "equal") for _ in range(THREADS)]))
    assert became == {"equal": 1, "decided: equal": THREADS - 1}
    assert Vote.objects.count() == 1


def test_a_browser_that_floods_gets_no_more_through_than_the_pace(settings: Settings) -> None:
    settings.VOTES_PER_S = 1  # five in five seconds: a slow machine floods as well
    settings.VOTE_WAIT_S = 60  # a busy machine may write slowly
    study = a_study(scenarios=8, votes_per_expert=24)
    eva = study.experts.get(username="eva")
    matchups = list(study.matchups.filter(expert=eva))

    def send(matchup: Matchup) -> bool:
        decision = Decision(matchup=matchup.code, key=uuid.uuid4(), outcome="left")
        try:
            receive_vote(expert=eva, decision=decision)
        except TooFast:
            return False
        finally:
            connection.close()
        return True

    with ThreadPoolExecutor(max_workers=THREADS) as pool:
        stored = sum(pool.map(send, matchups))

    # Each thread sees the stored votes; those under way beside it are all it can overlook. On a
    # machine that takes longer than the five seconds more may follow.
    times = list(Vote.objects.order_by("at").values_list("at", flat=True))
    spans = (times[-1] - times[0]) // PACE_WINDOW + 1
    assert 5 <= stored <= (5 + THREADS - 1) * spans
    assert len(times) == stored


def test_votes_come_in_while_a_rating_is_computed(
    monkeypatch: pytest.MonkeyPatch, settings: Settings
) -> None:
    over = vote_all(a_study(votes_per_expert=3))
    other = open_study(
        name="Round 2",
        votes_per_expert=3,
        seed=1,
        contestants=["ann", "bob"],
        scenarios=["place-0", "place-1", "place-2"],
        experts=["eva"],
    )
    plain = ratings.compute
    settings.VOTE_WAIT_S = 1

    def store(matchup: Matchup) -> None:
        decision = Decision(matchup=matchup.code, key=matchup.code, outcome="left")
        try:
            receive_vote(expert=matchup.expert, decision=decision)
        finally:
            connection.close()

    def compute(*given: Any) -> Any:
        with ThreadPoolExecutor(1) as web:  # another thread of the web server
            web.submit(store, matchups_of(other, "eva")[0]).result()
        assert not Snapshot.objects.exists()
        return plain(*given)

    monkeypatch.setattr(ratings, "compute", compute)
    snapshot = ratings.rate_now(study=over, rounds=10)
    assert (snapshot.state, snapshot.votes_counted) == (Snapshot.State.READY, 6)
    assert Vote.objects.filter(matchup__study=other).count() == 1
