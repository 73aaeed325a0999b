"""Which drives a study plays under its pictures, to whom, and how little they tell."""

import json
import uuid

import pytest
from django.contrib.auth.models import User

from arena.errors import InvalidVote, NotYours
from arena.models import Matchup, Study, Vote
from arena.voting.queries.showings import drives_of_pair
from arena.voting.services.casting import Decision, cast_vote
from augment.models import Augmentation
from augment.simulation.trace import blind_trace
from tests.drives import drive_pictures
from tests.opening import open_study
from tests.study_rows import Cast, cast_of, matchups_of

pytestmark = pytest.mark.django_db


def played(cast: Cast, **options: object) -> Study:
    return open_study(
        name="Round 1", votes_per_expert=12, seed=7, allow_replay=True, **options, **cast
    )


def pictures(*places: str) -> list[Augmentation]:
    rows = Augmentation.objects.select_related("contestant", "scenario")
    return list(rows.filter(scenario__slug__in=places) if places else rows)


def decided(matchup: Matchup, *aids: str) -> Decision:
    return Decision(matchup=matchup.code, key=uuid.uuid4(), outcome="left", aids=aids)


def eva() -> User:
    return User.objects.get(username="eva")


def test_a_scenario_is_played_where_all_of_its_pictures_were_driven_in_one_way() -> None:
    cast = cast_of()
    drive_pictures(pictures("place-0", "place-3"))
    drive_pictures(pictures("place-1")[:2])  # one is missing
    drive_pictures(pictures("place-2")[:2])
    drive_pictures(pictures("place-2")[2:], offsets="original")  # the third in another way
    study = played(cast)
    assert study.allow_replay
    assert study.rules["replays"] == {
        "planner": "pdm-closed",
        "offsets": "paper",
        "is_reactive": False,
        "version": 1,
        "scenarios": ["place-0", "place-3"],
    }
    for matchup in matchups_of(study, "eva"):
        found = drives_of_pair(user=eva(), code=matchup.code)
        assert (found is not None) == (matchup.scenario.slug in {"place-0", "place-3"})


def test_who_made_a_picture_can_not_be_told_from_a_single_byte_of_its_drive() -> None:
    cast = cast_of()
    drive_pictures(pictures())
    study = played(cast)
    for matchup in matchups_of(study, "eva"):
        found = drives_of_pair(user=eva(), code=matchup.code)
        assert found is not None
        # Three contestants that made the same change have the same drive to the last byte.
        assert json.dumps(found["a"]) == json.dumps(found["b"])
        said = json.dumps(found)
        for word in ("ann", "bob", "cid", "pdm", "Agent", "0.43", "scores", "plans", "events"):
            assert word not in said, word


def test_ids_and_their_order_are_gone() -> None:
    one = {"id": "Agent2", "type": "VEHICLE", "poses": [[1.0, 2.0, 0.0, 0.0]]}
    two = {"id": "Agent3", "type": "TRAFFIC_CONE", "poses": [[5.0, 2.0, 0.0, 0.0]]}
    plain = {"format": "f", "version": 1, "step_s": 0.1, "steps": 1, "ego": {}, "road": {}}
    first = plain | {"objects": [one, two], "plans": [{"scores": [0.5]}], "braking": [0]}
    second = plain | {"objects": [two | {"id": "b"}, one | {"id": "a"}], "plans": [], "events": []}
    assert json.dumps(blind_trace(first)) == json.dumps(blind_trace(second))


def test_a_pair_is_played_to_its_expert_and_to_admins_alone() -> None:
    cast = cast_of()
    drive_pictures(pictures())
    mine = matchups_of(played(cast), "eva")[0]
    assert drives_of_pair(user=eva(), code=mine.code)
    for user, code in [(User.objects.get(username="finn"), mine.code), (eva(), uuid.uuid4())]:
        with pytest.raises(NotYours):
            drives_of_pair(user=user, code=code)


def test_without_the_rule_nothing_is_played_and_no_vote_can_say_so() -> None:
    cast = cast_of()
    drive_pictures(pictures())
    study = open_study(name="Round 1", votes_per_expert=9, seed=7, **cast)
    assert not study.allow_replay
    assert "replays" not in study.rules
    first = matchups_of(study, "eva")[0]
    assert drives_of_pair(user=eva(), code=first.code) is None
    decision = decided(first, "replay")
    with pytest.raises(InvalidVote, match="no drives to play"):
        cast_vote(expert=eva(), decision=decision)
    assert not Vote.objects.exists()
