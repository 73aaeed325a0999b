import uuid
from datetime import timedelta
from typing import Any

import pytest
from django.db import IntegrityError, transaction
from django.utils import timezone

from arena.errors import AlreadyDecided, InvalidVote, NotYours, StudyNotOpen, TooFast
from arena.models import EarlyLook, Vote
from arena.studies.services.opening import close_study
from arena.voting.queries.ballots import current_votes, own_votes, upcoming
from arena.voting.services.casting import PACE_WINDOW, Decision, FaultMark, cast_vote, receive_vote
from augment.errors import Conflict
from tests.study_rows import a_study, expert, matchups_of, vote

pytestmark = pytest.mark.django_db


def test_a_vote_stores_the_winner_apart_from_the_side() -> None:
    first, second, third, *_ = matchups_of(a_study(), "eva")
    for matchup, outcome, winner in (
        (first, "left", first.left_id),
        (second, "equal", None),
        (third, "right", third.right_id),
    ):
        stored = vote(matchup, outcome, ms_visible=4200)
        assert stored.winner_id == winner, outcome
        assert (stored.shown_left_id, stored.shown_right_id) == (matchup.left_id, matchup.right_id)
        assert (stored.ms_visible, stored.is_simulated) == (4200, False)


def test_a_key_is_one_vote_on_one_matchup_with_one_outcome() -> None:
    first, second, *_ = matchups_of(a_study(), "eva")
    key = uuid.uuid4()
    stored = vote(first, "left", key=key)
    assert vote(first, "left", key=key) == stored
    for again in ({"outcome": "right", "key": key}, {"outcome": "left"}):
        with pytest.raises(AlreadyDecided) as refused:
            vote(first, **again)
        assert refused.value.outcome == "left"
    with pytest.raises(Conflict, match="another vote"):
        vote(second, key=key)
    assert Vote.objects.count() == 1


def test_a_change_is_appended_and_supersedes_the_current_vote() -> None:
    study = a_study()
    matchup = matchups_of(study, "eva")[0]
    first = vote(matchup, "left")
    second = vote(matchup, "right", supersedes=first.key)
    third = vote(matchup, "equal", supersedes=second.key)
    assert Vote.objects.count() == 3
    assert list(current_votes(study)) == [third]
    assert list(own_votes(study, matchup.expert)) == [third]
    for former in (first, second):
        with pytest.raises(AlreadyDecided) as refused:
            vote(matchup, "right", supersedes=former.key)
        assert refused.value.outcome == "equal"


def test_a_changed_vote_is_held_against_the_studys_rules_as_a_first_one_is() -> None:
    first_matchup, second_matchup, *_ = matchups_of(a_study(), "eva")
    first = vote(first_matchup, "left")
    wrong: list[tuple[str, dict[str, Any]]] = [
        ("equal", {"both_miss": True}),
        ("right", {"aids": ["replay"]}),
        ("right", {"strength": "clearly"}),
        ("right", {"faults": [FaultMark("left", 0, "heading")]}),
    ]
    for outcome, more in wrong:
        with pytest.raises(InvalidVote) as fresh:
            vote(second_matchup, outcome, **more)
        with pytest.raises(InvalidVote) as changed:
            vote(first_matchup, outcome, supersedes=first.key, **more)
        assert changed.value.args == fresh.value.args
        assert next(iter(more)) in str(vars(changed.value))
    assert list(Vote.objects.all()) == [first]


@pytest.mark.parametrize("set_back_h", [0, 2])
def test_changes_count_towards_the_pace_that_a_person_can_keep(
    set_back_h: int, settings: Any
) -> None:
    """Unless the clock was set back since: what then lies ahead is no pace."""
    matchup = matchups_of(a_study(), "eva")[0]
    with pytest.MonkeyPatch.context() as clock:
        ahead = timezone.now() + timedelta(hours=set_back_h)
        clock.setattr(timezone, "now", lambda: ahead)
        first = vote(matchup, "left")
    settings.VOTES_PER_S = 1 / PACE_WINDOW.total_seconds()
    change = Decision(
        matchup=matchup.code, key=uuid.uuid4(), outcome="right", supersedes=first.key
    )
    if not set_back_h:
        with pytest.raises(TooFast):
            receive_vote(expert=matchup.expert, decision=change)
        settings.VOTES_PER_S = 2 / PACE_WINDOW.total_seconds()
    receive_vote(expert=matchup.expert, decision=change)
    assert Vote.objects.count() == 2


def test_who_has_opened_the_results_of_a_study_no_longer_votes_in_it() -> None:
    study = a_study()
    (one, *_), (other, *_) = matchups_of(study, "eva"), matchups_of(study, "finn")
    EarlyLook.objects.create(study=study, user=one.expert)
    with pytest.raises(NotYours):
        vote(one)
    assert vote(other).expert == other.expert
    assert Vote.objects.count() == 1


def test_nobody_votes_on_somebody_elses_matchup() -> None:
    theirs = matchups_of(a_study(), "finn")[0]
    for stranger in (matchups_of(theirs.study, "eva")[0].expert, expert("gus")):
        decision = Decision(matchup=theirs.code, key=uuid.uuid4(), outcome="left")
        with pytest.raises(NotYours):
            cast_vote(expert=stranger, decision=decision)
    assert not Vote.objects.exists()


def test_a_closed_study_takes_no_votes_but_knows_the_ones_it_has() -> None:
    study = a_study()
    first, second, *_ = matchups_of(study, "eva")
    stored = vote(first)
    close_study(study=study)
    with pytest.raises(StudyNotOpen):
        vote(second)
    with pytest.raises(StudyNotOpen):
        vote(first, "right", supersedes=stored.key)
    assert vote(first, key=stored.key) == stored


def test_parts_that_do_not_go_together_are_refused() -> None:
    matchup = matchups_of(a_study(), "eva")[0]
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"outcome": "skip"}, "reason"),
        ({"outcome": "left", "reason": "unclear"}, "reason"),
        ({"outcome": "right", "both_miss": True}, "both_miss"),
        ({"outcome": "equal", "strength": "slightly"}, "strength"),
        ({"outcome": "left", "strength": "a bit"}, "strength"),
        ({"outcome": "left", "comment": "x" * 1001}, "comment"),
        ({"outcome": "left", "aids": ["zoom", "glasses"]}, "aids"),
    ]
    for said, field in wrong:
        with pytest.raises(InvalidVote) as refused:
            vote(matchup, **said)
        assert list(refused.value.fields) == [field], said
    assert not Vote.objects.exists()


def test_a_skip_is_a_decision_that_can_be_taken_back() -> None:
    study = a_study()
    first, second, *_ = matchups_of(study, "eva")
    skip = vote(first, "skip", reason="other", comment="Two cars in one place.")
    assert skip.winner_id is None
    assert upcoming(study=study, expert=first.expert, n=1) == [second]
    again = vote(first, "left", supersedes=skip.key)
    assert list(current_votes(study)) == [again]
    with pytest.raises(AlreadyDecided):
        vote(first, "skip", reason="unclear", key=skip.key)


def test_the_database_itself_refuses_two_first_votes_and_a_winner_that_was_not_shown() -> None:
    first, second, *_ = matchups_of(a_study(), "eva")
    stored = vote(first)

    def copy(**changes: object) -> Vote:
        row = {
            "matchup": first, "expert": first.expert, "key": uuid.uuid4(), "outcome": "left",
            "winner": first.left, "shown_left": first.left, "shown_right": first.right,
        }  # fmt: skip
        return Vote(**row | changes)

    twice = copy()
    same_key = copy(key=stored.key, matchup=second)
    not_shown = copy(matchup=second, winner=first.right)
    nobody_wins = {"matchup": second, "winner": None}
    wrong = [
        copy(**nobody_wins),
        copy(**nobody_wins, outcome="draw"),
        copy(**nobody_wins, outcome="skip"),
        copy(**nobody_wins, outcome="skip", reason="bored"),
        copy(**nobody_wins, outcome="equal", reason="unclear"),
        copy(**nobody_wins, outcome="skip", reason="unclear", both_miss=True),
        copy(**nobody_wins, outcome="equal", aids="zoom glasses"),
        copy(outcome="skip", reason="unclear", matchup=second),
    ]
    for bad in (twice, same_key, not_shown, *wrong):
        with pytest.raises(IntegrityError), transaction.atomic():
            bad.save()
    assert Vote.objects.count() == 1


def test_the_next_matchups_follow_the_experts_own_order() -> None:
    study = a_study()
    mine = matchups_of(study, "eva")
    eva = mine[0].expert
    assert upcoming(study=study, expert=eva, n=1) == [mine[0]]
    vote(mine[0])
    vote(mine[2])
    assert upcoming(study=study, expert=eva, n=3) == [mine[1], mine[3], mine[4]]
    for matchup in [mine[1], *mine[3:]]:
        vote(matchup)
    assert upcoming(study=study, expert=eva, n=1) == []
