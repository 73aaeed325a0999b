"""A study is opened by the wire with all that the form of the page has."""

from dataclasses import asdict
from typing import Any

import pytest

from arena.models import Study
from arena.studies.api import StudyBody
from arena.studies.services.plan import PLAN_INPUTS, StudyPlan
from augment.services.inputs import InputKind
from tests.api.asking import error_of
from tests.api.tokens import program_of
from tests.study_rows import cast_of
from tests.web.cast import people


def test_every_field_of_a_plan_can_be_given() -> None:
    given: dict[str, Any] = {
        **{"name": "x", "contestants": ["ann"], "scenarios": ["place"], "experts": ["eva"]},
        **{"votes_per_expert": 7, "seed": 2, "samples": "all", "jobs": ["Round 1"]},
        **dict.fromkeys(("repeats", "checks", "overlap"), 25.0),
        "hypotheses": ["ann above bob"],
        "questions": ["realism", "instruction"],
    }
    given |= {one.name: not one.default for one in PLAN_INPUTS if one.kind is InputKind.SWITCH}
    body = StudyBody(data=given)
    assert body.is_valid(), body.errors
    plan = StudyPlan.read(body.validated_data)
    assert {
        name: list(v) if isinstance(v, tuple) else v for name, v in asdict(plan).items()
    } == given


def test_what_a_body_leaves_out_is_as_in_the_plan() -> None:
    least = {"name": "x", "contestants": [], "scenarios": [], "experts": [], "votes_per_expert": 1}
    body = StudyBody(data=least)
    assert body.is_valid(), body.errors
    assert StudyPlan.read(body.validated_data) == StudyPlan.read(least)


@pytest.mark.django_db
def test_a_preregistered_study_is_opened_by_the_wire() -> None:
    chosen = cast_of()
    admin = program_of(people()["admin"])
    given = {
        **chosen,
        "name": "Preregistered",
        "votes_per_expert": 6,
        "overlap": 50,
        "hypotheses": ["ann above bob", "Nobody is perfect."],
    }
    wrong = given | {"hypotheses": ["ann above zoe"]}
    answer = admin.post("/api/v1/studies", wrong, content_type="application/json")
    assert "zoe" in error_of(answer, 400, "refused")["message"]
    assert not Study.objects.exists()
    answer = admin.post("/api/v1/studies", given, content_type="application/json")
    assert answer.status_code == 201, answer.content
    study = Study.objects.get()
    assert [one["above"] for one in study.rules["hypotheses"]] == [["ann", "bob"], None]
    assert study.rules["overlap_share"] == 0.5
