"""Votes that arrive at once, on the database as it is configured."""

import uuid
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import pytest
from django.db import connection
from pytest_django import Settings

from arena.errors import AlreadyDecided, TooFast
from arena.models import Matchup, Vote
from arena.voting.services.casting import PACE_WINDOW, Decision, receive_vote
from tests.study_rows import a_study, vote

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
    study = a_study(experts=experts, scenarios=10, votes_per_expert=20)
    matchups = study.matchups.select_related("expert")
    jobs = [(matchup, uuid.uuid4(), "left") for matchup in matchups]
    replayed = [job for job in jobs for _ in range(2)]

    assert set(at_once(replayed)) == {"left"}

    assert Vote.objects.count() == len(jobs) == 160
    assert set(Vote.objects.values_list("key", flat=True)) == {key for _, key, _ in jobs}


def test_eight_keys_for_one_matchup_leave_one_vote() -> None:
    matchup = a_study().matchups.select_related("expert").first()
    became = Counter(at_once([(matchup, uuid.uuid4(), "equal") for _ in range(THREADS)]))
    assert became == {"equal": 1, "decided: equal": THREADS - 1}
    assert Vote.objects.count() == 1


def test_one_key_eight_times_is_one_vote() -> None:
    matchup = a_study().matchups.select_related("expert").first()
    key = uuid.uuid4()
    assert set(at_once([(matchup, key, "right")] * THREADS)) == {"right"}
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
