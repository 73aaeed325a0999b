"""What pairs show: windows that are drawn after the opening, and drives."""

import json
import time
import uuid
from contextlib import closing
from typing import Any

import pytest
from django.contrib.auth.models import User
from django.db import connection
from django.urls import reverse

from arena.errors import InvalidVote, NotYours
from arena.models import Matchup, Study, Vote
from arena.studies.services.opening import open_study as open_undrawn
from arena.studies.services.plan import StudyPlan
from arena.studies.services.taking_part import hand_over
from arena.voting.queries.ballots import find_undrawn, upcoming
from arena.voting.queries.showings import drives_of_pair, view_shown
from arena.voting.services.casting import Decision, cast_vote
from arena.voting.services.drawing import draw_pictures
from augment.models import Augmentation
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.scenarios import camera_key
from augment.simulation.trace import blind_trace
from tests import opening
from tests.api.asking import error_of
from tests.drives import drive_pictures
from tests.opening import open_study
from tests.scenes import vehicle
from tests.study_rows import Cast, cast_of, expert, matchups_of
from tests.web.cast import signed_in

pytestmark = pytest.mark.django_db


AHEAD_M = {"ann": 20.0, "bob": 20.3, "cid": 45.0}
COLUMNS = ("left_image", "right_image", "original_image", "view")


def undrawn(scenarios: int = 1, experts: tuple[str, ...] = ("eva",)) -> Study:
    """Open a study of three pairs a scenario, all of them for each expert."""
    cast = cast_of(contestants=tuple(AHEAD_M), scenarios=scenarios, experts=experts)
    for name, ahead_m in AHEAD_M.items():
        change = Modification(added=(vehicle("New1", ahead_m, 0.0),))
        row = Augmentation.objects.filter(contestant__slug=name)
        row.update(modification=modification_to_document(change))
    votes = 3 * scenarios
    return open_undrawn(
        StudyPlan.read({**cast, "name": "s", "votes_per_expert": votes, "seed": 7})
    )


@pytest.fixture
def study() -> Study:
    return undrawn()


def test_pairs_wait_until_they_are_drawn_each_in_its_own_window(study: Study) -> None:
    eva = study.experts.get()
    assert upcoming(study=study, expert=eva, n=5) == []
    page = reverse("vote", args=[study.code])
    client, pairs = signed_in(eva), f"/api/v1/matchups?study={study.code}"
    assert "being drawn" in client.get(page).content.decode()
    answer = client.get(pairs)
    error_of(answer, 409, "being_drawn")
    assert answer.headers["Retry-After"] == "2"
    assert draw_pictures(study, within_s=0.0)
    assert len(client.get(pairs).json()) == 1
    assert len(upcoming(study=study, expert=eva, n=5)) == 1
    # A worker died there, and then its clock was set back.
    find_undrawn(study).update(view={"since": time.time() + 7200.0})
    assert not draw_pictures(study)
    rows = upcoming(study=study, expert=eva, n=5)
    assert len(rows) == 3
    assert not find_undrawn(study).exists()
    scales = {}
    for row in rows:
        names = row.left_image, row.right_image, row.original_image
        assert len({camera_key(name) for name in names}) == 1
        assert len(set(names)) == 3
        pair = {row.left.contestant.slug, row.right.contestant.slug}
        scales[frozenset(pair)] = view_shown(row)["px_per_m"]
    near = scales[frozenset({"ann", "bob"})]
    assert all(near > scale for pair, scale in scales.items() if "cid" in pair)
    # 0.3 m are few pixels: an inset lies over the ground, beside the scale.
    shown = {
        pair: len(view_shown(row)["covered_px"]) for pair, row in zip(scales, rows, strict=True)
    }
    assert shown[frozenset({"ann", "bob"})] == 2
    assert json.loads(study.preregistration)["rules"]["windows"] == "pair"


@pytest.mark.django_db(transaction=True)
def test_a_pair_is_drawn_while_others_write_and_many_wait() -> None:
    study = undrawn(scenarios=6, experts=("eva", "finn", "gus"))
    waiting = find_undrawn(study).count()
    assert waiting > 50, "more than are read at once"

    def after_a_write_by_another(execute: Any, sql: str, *rest: Any) -> Any:
        if sql.startswith("UPDATE"):
            other: Any = connection.copy()
            with closing(other), other.cursor() as cursor:
                cursor.execute("UPDATE arena_study SET name = 'renamed'")
        return execute(sql, *rest)

    with connection.execute_wrapper(after_a_write_by_another):
        assert draw_pictures(study, within_s=0.0)
    assert find_undrawn(study).count() < waiting


def test_a_repeat_and_a_pair_handed_over_show_what_was_drawn(study: Study) -> None:
    draw_pictures(study)
    before = {row.left_id + row.right_id: row for row in study.matchups.all()}
    finn = expert("finn")
    hand_over(study=study, username="eva", to=["finn"])
    assert not find_undrawn(study).exists()
    for row in study.matchups.filter(expert=finn):
        first = before[row.left_id + row.right_id]
        assert {row.left_image, row.right_image} == {first.left_image, first.right_image}
        assert (row.original_image, row.view) == (first.original_image, first.view)


def test_a_study_with_one_window_a_scenario_keeps_it() -> None:
    cast = cast_of(contestants=("ann", "bob"), scenarios=2, experts=("eva",))
    Augmentation.objects.update(modification=modification_to_document(Modification()))
    study = opening.open_study(**cast, name="old", votes_per_expert=2, seed=7)
    legend = {"scene": ["lane"], "pair": []}
    for row in study.matchups.all():
        row.view, row.original_image = {**(row.view or {}), "legend": legend}, "bev/original.png"
        row.save()
    study.rules.pop("windows")
    study.save()
    shown = {frozenset(row[:2]): row[2:] for row in study.matchups.values_list(*COLUMNS)}
    finn = expert("finn")
    hand_over(study=study, username="eva", to=["finn"])
    rows = study.matchups.filter(expert=finn).values_list(*COLUMNS)
    assert {frozenset(row[:2]): row[2:] for row in rows} == shown


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


def test_a_pair_is_played_blind_to_its_expert_and_to_admins_alone() -> None:
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
    for user, code in [(User.objects.get(username="finn"), matchup.code), (eva(), uuid.uuid4())]:
        with pytest.raises(NotYours):
            drives_of_pair(user=user, code=code)


def test_ids_and_their_order_are_gone() -> None:
    one = {"id": "Agent2", "type": "VEHICLE", "poses": [[1.0, 2.0, 0.0, 0.0]]}
    two = {"id": "Agent3", "type": "TRAFFIC_CONE", "poses": [[5.0, 2.0, 0.0, 0.0]]}
    plain = {"format": "f", "version": 1, "step_s": 0.1, "steps": 1, "ego": {}, "road": {}}
    first = plain | {"objects": [one, two], "plans": [{"scores": [0.5]}], "braking": [0]}
    second = plain | {"objects": [two | {"id": "b"}, one | {"id": "a"}], "plans": [], "events": []}
    assert json.dumps(blind_trace(first)) == json.dumps(blind_trace(second))


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
