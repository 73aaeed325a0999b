"""What a process keeps of its counts: never older than the newest vote, however it came in."""

from __future__ import annotations

from typing import Any
from uuid import uuid4

import pytest
from django.db import connection
from django.test.utils import CaptureQueriesContext
from django.utils import timezone

from arena.models import Snapshot, Study, Vote
from arena.queries.coverage import coverage
from arena.queries.galleries import disputed_pairs, pictures_of
from arena.queries.invitations import expert_lines
from arena.queries.remembering import Remembered
from arena.queries.vote_lists import vote_page
from arena.queries.vote_search import VoteSearch
from arena.queries.votes import tallies
from arena.services.ratings import rate
from arena.services.studies import close_study, open_study
from augment.models import Scenario
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
        pk=newest.pk - 1, key=uuid4(), matchup=second,
        expert=second.expert, shown_left=second.left, shown_right=second.right, outcome="equal",
    )  # fmt: skip
    late.save(force_insert=True)
    assert told(study)[:2] == (2, 2)


def test_a_second_look_asks_for_no_votes() -> None:
    study = mixed_study()
    snapshot = rate(study=study)
    for look in (
        lambda: coverage(study),
        lambda: tallies(study),
        lambda: expert_lines(study, timezone.now()),
        lambda: disputed_pairs(snapshot),
        lambda: pictures_of(snapshot, "ann"),
        lambda: vote_page(snapshot, VoteSearch(), 1),
    ):
        first = look()
        with CaptureQueriesContext(connection) as captured:
            assert look() == first
        joined = [query["sql"] for query in captured if '"arena_vote" INNER JOIN' in query["sql"]]
        assert not [sql for sql in joined if " IN (" not in sql], joined


def test_pages_of_a_type_follow_a_scenario_that_is_given_another() -> None:
    study = close_study(study=_voted())
    snapshot: Snapshot = rate(study=study)
    kinds = [kind.value for kind in Scenario.Type]
    Scenario.objects.update(type=kinds[0])

    def counted(kind: str) -> tuple[int, int]:
        found = vote_page(snapshot, VoteSearch(type=kind), 1)
        return found.total, len(pictures_of(snapshot, "ann", type_name=kind))

    total, pictures = counted(kinds[0])
    assert total
    assert pictures
    Scenario.objects.update(type=kinds[1])
    assert counted(kinds[0]) == (0, 0)
    assert counted(kinds[1]) == (total, pictures)


def _voted() -> Study:
    study = study_rows.a_study(votes_per_expert=9)
    for one in study.matchups.all():
        study_rows.vote(one)
    return study


def test_what_was_not_asked_for_the_longest_is_made_again() -> None:
    kept, made = Remembered[int](2), []

    def make(number: int) -> int:
        made.append(number)
        return number

    for number in (1, 2, 1, 3, 1, 2):
        assert kept.get(number, lambda number=number: make(number)) == number  # type: ignore[misc]
    assert made == [1, 2, 3, 2]


def test_experts_are_listed_with_as_many_queries_however_many_they_are() -> None:
    few = study_rows.a_study()
    many = _second(("gus", "hal", "ida", "jon", "kim"))
    counts = []
    for study in (few, many):
        with CaptureQueriesContext(connection) as captured:
            expert_lines(study, timezone.now())
        counts.append(len(captured))
    assert counts[0] == counts[1]


def _second(experts: tuple[str, ...]) -> Study:
    """Another study of the same scenarios and contestants with other experts."""
    before = Study.objects.get()
    for username in experts:
        study_rows.expert(username)
    return open_study(
        name="Round 2",
        contestants=[row.slug for row in before.contestants.all()],
        scenarios=[row.slug for row in before.scenarios.all()],
        experts=list(experts),
        votes_per_expert=9,
        seed=7,
    )
