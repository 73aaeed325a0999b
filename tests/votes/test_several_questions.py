"""Several questions about a pair: their order, when a pair is done, skips, and each its rating."""

from typing import Any

import pytest

from arena.errors import AlreadyDecided, InvalidVote
from arena.models import Study, Vote
from arena.results.exports.votes import list_unrated
from arena.results.queries.access import ready_snapshots
from arena.results.queries.votes import Filters, last_vote_id, vote_set
from arena.results.services.ratings import rate_now
from arena.studies.queries import count_progress
from arena.studies.services.opening import close_study
from arena.voting.queries.ballots import own_votes, tallies, upcoming, voting_progress
from augment.errors import Conflict, UnknownName
from tests.opening import open_study
from tests.study_rows import a_study, cast_of, matchups_of, shown_again, vote

pytestmark = pytest.mark.django_db

ASKED = ["realism", "instruction", "difficulty"]


def a_study_of_three(**more: Any) -> Study:
    return a_study(questions=ASKED, **more)


def test_a_pair_comes_until_its_last_question_is_answered() -> None:
    study = a_study_of_three(votes_per_expert=2)
    first, second = matchups_of(study, "eva")
    seen = []
    for question in ASKED:
        shown = upcoming(study=study, expert=first.expert, n=2)
        progress = voting_progress(study=study, expert=first.expert)
        seen.append(([one.asked for one in shown], progress.voted, progress.left))
        vote(first, question=question)
    assert seen == [([asked, ASKED[0]], 0, 2) for asked in ASKED]
    (left,) = upcoming(study=study, expert=first.expert, n=2)
    assert (left, left.asked) == (second, ASKED[0])
    (line,), (tally, _) = count_progress([study], first.expert), tallies(study)
    progress = voting_progress(study=study, expert=first.expert)
    for one in (line, tally, progress):
        assert (one.voted, one.skipped, one.left) == (1, 0, 1)
    asked_last = [one.question for one in own_votes(study, first.expert).reverse()]
    assert asked_last == ASKED[::-1]


def test_questions_come_in_their_order_and_only_those_of_the_study() -> None:
    matchup = matchups_of(a_study(questions=ASKED[:2]), "eva")[0]
    for question in ("instruction", "difficulty", "beauty"):
        with pytest.raises(InvalidVote) as refused:
            vote(matchup, question=question)
        assert "question" in str(vars(refused.value))
    assert vote(matchup).question == "realism", "the primary one where none is named"


def test_a_change_replaces_the_answer_to_its_own_question() -> None:
    matchup = matchups_of(a_study_of_three(), "eva")[0]
    first, second = (vote(matchup, question=one) for one in ASKED[:2])
    with pytest.raises(AlreadyDecided):
        vote(matchup, "right", question="instruction", supersedes=first.key)
    changed = vote(matchup, "right", question="instruction", supersedes=second.key)
    assert vote(matchup, "right", question="instruction", supersedes=second.key, key=changed.key)
    with pytest.raises(AlreadyDecided):
        vote(matchup, "right", question="realism", supersedes=second.key, key=changed.key)
    current = Vote.objects.filter(superseded_by=None)
    assert sorted(current.values_list("question", "outcome")) == [
        ("instruction", "right"),
        ("realism", "left"),
    ]


def test_a_skip_ends_the_pair_and_its_other_answers_do_not_count() -> None:
    study = a_study_of_three(votes_per_expert=1, experts=("eva", "finn"))
    (matchup,) = matchups_of(study, "eva")
    given = [vote(matchup, question=one) for one in ASKED[:2]]
    with pytest.raises(InvalidVote):
        vote(matchup, "skip", reason="other", question="difficulty")
    skip = vote(matchup, "skip", reason="other", supersedes=given[0].key)
    assert upcoming(study=study, expert=matchup.expert, n=1) == []
    progress = voting_progress(study=study, expert=matchup.expert)
    assert (progress.voted, progress.skipped, progress.left) == (0, 1, 0)
    frozen = last_vote_id(study)
    of_instruction = Filters(question="instruction")
    assert vote_set(study, filters=of_instruction, last=frozen).left_out == {"skip": 1}
    vote(matchup, supersedes=skip.key)
    (again,) = upcoming(study=study, expert=matchup.expert, n=1)
    assert again.asked == "difficulty"
    assert vote_set(study, filters=of_instruction, last=frozen).left_out == {"skip": 1}
    assert len(vote_set(study, filters=of_instruction, last=last_vote_id(study)).counted) == 1


def test_each_question_has_a_rating_of_its_own_votes() -> None:
    study = a_study_of_three(votes_per_expert=3, experts=("eva", "finn"))
    outcomes = {"realism": "left", "instruction": "right", "difficulty": "equal"}
    for matchup in [*study.matchups.all(), shown_again(matchups_of(study, "eva")[0])]:
        for question in ASKED:
            vote(matchup, outcomes[question], question=question)
    close_study(study=study)
    study.refresh_from_db()
    for question, outcome in outcomes.items():
        found = vote_set(study, filters=Filters(question=question), last=last_vote_id(study))
        assert {one.outcome for one in found.counted} == {outcome}
        assert (len(found.counted), found.left_out, len(found.repeats)) == (6, {"repeat": 1}, 1)
    usual, other = (
        rate_now(study=study, rounds=10, filters=filters)
        for filters in (None, Filters(question="difficulty"))
    )
    assert [usual.question, other.question] == ["realism", "difficulty"]
    assert ready_snapshots(study).first() == usual, "the primary question's, though an older one"
    assert [usual.results.trust.tie_share, other.results.trust.tie_share] == [0.0, 1.0]
    with pytest.raises(UnknownName, match="beauty"):
        rate_now(study=study, filters=Filters(question="beauty"))
    sheet = list_unrated(study)
    at = [*sheet.columns].index("question")
    assert [row[at] for row in sheet.rows].count("instruction") == 7


def test_checks_are_judged_by_the_primary_question_alone() -> None:
    study = a_study_of_three(votes_per_expert=2, experts=("eva", "finn"))
    for row, *_ in (matchups_of(study, name) for name in ("eva", "finn")):
        row.kind = "check"
        row.save()
        for question in ASKED:
            vote(row, "left" if question == "realism" else "right", question=question)
    found = vote_set(study, filters=Filters(question="difficulty"), last=last_vote_id(study))
    assert [one.question for one in found.checks] == ["realism", "realism"]
    assert found.left_out == {"check": 2}


def test_only_known_questions_each_once_can_be_asked() -> None:
    rules = {"name": "Round 1", "votes_per_expert": 9, "seed": 7, **cast_of()}
    for asked in (["instruction"] * 2, ["beauty"], ["realism", "beauty"]):
        with pytest.raises(Conflict, match="primary one first"):
            open_study(**rules, questions=asked)
    assert open_study(**rules, questions=[]).questions == ["instruction"]
