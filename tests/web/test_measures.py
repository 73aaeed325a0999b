"""Measures over a pair: the same whoever drew what, right in pixels, only where they may be."""

import uuid

import pytest
from django.contrib.auth.models import User
from django.urls import reverse

from arena.errors import InvalidVote
from arena.models import Matchup, Study
from arena.voting.queries.showings import view_shown
from augment.models import Scenario
from augment.scene.codec import intent_to_document
from tests.intents import LEFT_EDGE, parked, towards
from tests.opening import open_study
from tests.study_rows import a_study, cast_of, matchups_of, vote
from tests.web.cast import signed_in

pytestmark = pytest.mark.django_db


def measured_study() -> Study:
    study = a_study()
    intent = intent_to_document(parked(25.0, lateral=towards(LEFT_EDGE, 1.2)))
    Scenario.objects.update(intent=intent, intent_origin="authored")
    return study


def without_measures() -> Study:
    given = {"votes_per_expert": 9, "seed": 7, "allow_measures": False}
    return open_study(name="Round 1", **given, **cast_of())


def address(matchup: Matchup) -> str:
    return reverse("measures", args=[matchup.code])


def test_lines_stand_where_the_picture_has_the_metres() -> None:
    first = matchups_of(measured_study(), "eva")[0]
    eva = signed_in(User.objects.get(username="eva"))
    found = eva.get(address(first)).json()
    view = view_shown(first)
    (ego_x, ego_y), scale = view["ego_px"], view["px_per_m"]
    ahead, beside = found["lines"]
    assert ahead["label"] == "25 m ahead"
    assert {x for x, _ in ahead["points"]} == {round(ego_x + 25.0 * scale, 1)}
    assert beside["label"] == "1.2 m left"
    assert {y for _, y in beside["points"]} == {round(ego_y - 1.2 * scale, 1)}
    assert ahead["anchor"] != beside["anchor"], "labels go apart"
    assert found["rings"][0] | {"text": None} == {
        "at": [ego_x, ego_y],
        "r": round(10.0 * scale, 1),
        "label": "10 m",
        "text": None,
        "anchor": "middle",
    }
    for one in (*found["lines"], *found["rings"]):
        x, y = one.get("text", one.get("at"))
        assert 0 < x < view["width"]
        assert 0 < y < view["height"]


def test_they_are_the_same_bytes_whoever_drew_the_pictures() -> None:
    study = measured_study()
    eva = signed_in(User.objects.get(username="eva"))
    by_scenario: dict[int, set[bytes]] = {}
    for matchup in matchups_of(study, "eva"):
        by_scenario.setdefault(matchup.scenario_id, set()).add(eva.get(address(matchup)).content)
    assert len(by_scenario) < len(matchups_of(study, "eva")), "some come twice, of other pairs"
    assert all(len(answers) == 1 for answers in by_scenario.values())


def test_a_pair_is_measured_by_its_expert_alone() -> None:
    first = matchups_of(measured_study(), "eva")[0]
    assert signed_in(User.objects.get(username="finn")).get(address(first)).status_code == 404
    stranger = reverse("measures", args=[uuid.uuid4()])
    assert signed_in(User.objects.get(username="eva")).get(stranger).status_code == 404


def test_a_study_that_forbids_them_has_no_trace_of_them() -> None:
    study = without_measures()
    first = matchups_of(study, "eva")[0]
    eva = signed_in(User.objects.get(username="eva"))
    page = reverse("vote", args=[study.code])
    for place in (page, f"{page}help/"):
        shown = eva.get(place).content.decode()
        assert [word for word in ("measures", "Measures", "<kbd>G</kbd>") if word in shown] == []
    assert eva.get(address(first)).status_code == 404
    assert eva.get(address(first), {"x": "1", "y": "1"}).status_code == 404
    with pytest.raises(InvalidVote, match="no measures"):
        vote(first, "left", aids=["measures"])
