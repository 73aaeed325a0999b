"""What a process keeps of its counts: never older than the newest vote, however it came in."""

from typing import Any
from uuid import uuid4

import pytest
from django.db import connection
from django.test.utils import CaptureQueriesContext
from django.utils import timezone

from arena.models import Study, Vote
from arena.results.queries.evidence import vote_page
from arena.results.queries.scores import read_evidence
from arena.results.queries.search import VoteSearch
from arena.results.services.ratings import rate_now as rate
from arena.studies.queries import coverage, expert_lines
from arena.voting.queries.ballots import tallies
from tests import study_rows
from tests.mixed_study import mixed_study

pytestmark = pytest.mark.django_db


def told(study: Study) -> tuple[Any, ...]:
    (main, *_) = coverage(study).kinds
    line = expert_lines(study, timezone.now())[0]
    return main.decided, tallies(study)[0].voted, line.last_seen, line.seconds_per_vote


def test_every_vote_is_counted_at_once_also_one_that_takes_another_s_place() -> None:
    study = study_rows.a_study(votes_per_expert=3)
    first, second, _ = study_rows.matchups_of(study, "eva")
    assert told(study) == (0, 0, None, None)
    vote = study_rows.vote(first, ms_visible=2000)
    assert told(study) == (1, 1, vote.at, 2.0)
    skip = study_rows.vote(first, "skip", reason="other", supersedes=vote.key)
    assert told(study) == (0, 0, skip.at, 2.0)
    study_rows.vote(second, ms_visible=4000)
    assert told(study)[:2] == (1, 1)
    assert told(study)[3] == 3.0


def test_a_vote_that_commits_late_with_a_smaller_number_is_counted() -> None:
    study = study_rows.a_study(votes_per_expert=3)
    first, second, _ = study_rows.matchups_of(study, "eva")
    study_rows.vote(first)
    newest = Vote.objects.get()
    assert told(study)[0] == 1
    late = Vote(
        pk=newest.pk - 1,
        key=uuid4(),
        matchup=second,
        expert=second.expert,
        shown_left=second.left,
        shown_right=second.right,
        outcome="equal",
    )
    late.save(force_insert=True)
    assert told(study)[:2] == (2, 2)


def test_a_second_look_asks_for_no_votes() -> None:
    study = mixed_study()
    snapshot = rate(study=study)
    for look in (
        lambda: tallies(study),
        lambda: read_evidence(snapshot),
        lambda: list(vote_page(snapshot, VoteSearch(order="disputed"), 1)),
    ):
        first = look()
        with CaptureQueriesContext(connection) as captured:
            assert look() == first
        joined = [query["sql"] for query in captured if '"arena_vote" INNER JOIN' in query["sql"]]
        assert not [sql for sql in joined if " IN (" not in sql], joined
