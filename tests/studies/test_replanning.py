"""Handing pairs over, as rows."""

import uuid
from collections import Counter

import pytest

from arena.errors import NotYours
from arena.models import Matchup, Study
from arena.pairing.order import MAIN
from arena.studies.services.taking_part import hand_over
from arena.voting.services.reports import Complaint, report
from augment.errors import Conflict, UnknownName
from augment.models import Event
from tests.opening import open_study
from tests.study_rows import a_study, cast_of, expert, matchups_of, vote

pytestmark = pytest.mark.django_db


def pairs_of(study: Study) -> Counter[frozenset[int]]:
    rows = study.matchups.filter(kind=MAIN).values_list(
        "left__contestant_id", "right__contestant_id"
    )
    return Counter(frozenset(row) for row in rows)


def test_what_one_has_not_judged_goes_to_the_others_with_fresh_tokens() -> None:
    study = a_study(scenarios=8, experts=("eva", "finn", "gus"), votes_per_expert=9)
    before, mine = pairs_of(study), matchups_of(study, "eva")
    for matchup in mine[:3]:
        vote(matchup)
    gone = {matchup.left_token for matchup in mine[3:]}

    taken = hand_over(study=study, username="eva", to=["finn", "gus"])

    with pytest.raises(NotYours):
        vote(mine[5])
    assert taken == {"finn": 3, "gus": 3}
    assert pairs_of(study) == before
    assert [m.position for m in matchups_of(study, "eva")] == [1, 2, 3]
    assert {m.batch for m in matchups_of(study, "finn")[9:]} == {1}
    assert not gone & set(study.matchups.values_list("left_token", flat=True))
    for name in ("finn", "gus"):
        rows = matchups_of(study, name)
        assert [m.position for m in rows] == list(range(1, 13))
        assert len({(m.scenario_id, frozenset((m.left_id, m.right_id))) for m in rows}) == 12
    event = Event.objects.get(verb="hand over")
    assert event.before is not None
    assert event.after == {"batch": 1, "votes": {"finn": 3, "gus": 3}}
    assert len(event.before["matchups"]) == 6


def test_a_pair_that_was_reported_but_not_judged_stays_where_it_is() -> None:
    study = a_study()
    first = matchups_of(study, "eva")[0]
    report(
        expert=first.expert,
        complaint=Complaint(key=uuid.uuid4(), matchup=first.code, reason="picture_wrong"),
    )
    assert hand_over(study=study, username="eva", to=["finn"]) == {"finn": 8}
    assert matchups_of(study, "eva") == [first]


def test_repeats_are_drawn_anew_for_who_takes_over() -> None:
    study = open_study(
        name="Round 1", votes_per_expert=12, seed=1, repeats=25, **cast_of(scenarios=12)
    )
    hand_over(study=study, username="eva", to=["finn"])
    assert not matchups_of(study, "eva")
    rows = Counter(study.matchups.values_list("kind", flat=True))
    assert rows == {"main": 24, "repeat": 6}
    for row in study.matchups.filter(kind="repeat").select_related("repeat_of"):
        assert row.repeat_of is not None
        assert row.repeat_of.left_id == row.right_id


def test_a_hand_over_that_makes_no_sense_is_refused() -> None:
    study = a_study()
    expert("sim", is_simulated=True)
    expert("hans")
    wrong: list[tuple[str, list[str], type[Exception], str]] = [
        ("eva", [], Conflict, "Name at least one"),
        ("eva", ["eva"], Conflict, "other than eva"),
        ("eva", ["nobody"], UnknownName, "Unknown expert 'nobody'"),
        ("eva", ["sim"], Conflict, "Simulated: sim"),
        ("hans", ["finn"], UnknownName, "expert of this study 'hans'. Known: eva, finn"),
    ]
    for giver, to, error, sentence in wrong:
        with pytest.raises(error, match=sentence):
            hand_over(study=study, username=giver, to=to)
    assert study.matchups.count() == 18


@pytest.mark.parametrize("is_vote", [True, False])
def test_a_pair_whose_repeat_was_judged_is_not_handed_over(is_vote: bool) -> None:
    study = open_study(name="Round 1", votes_per_expert=8, seed=7, repeats=25, **cast_of())
    repeat, other = (row for row in matchups_of(study, "eva") if row.kind == Matchup.Kind.REPEAT)
    if is_vote:
        vote(repeat)
    else:
        report(
            expert=repeat.expert,
            complaint=Complaint(key=uuid.uuid4(), matchup=repeat.code, reason="other"),
        )
    taken = hand_over(study=study, username="eva", to=["finn"])
    kept = {row.pk for row in matchups_of(study, "eva")}
    assert kept == {repeat.pk, repeat.repeat_of_id}
    assert taken == {"finn": 7}, "all eight but the one that stays"
    assert not Matchup.objects.filter(pk__in=[other.pk, other.repeat_of_id]).exists()
