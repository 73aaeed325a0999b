"""A study is opened by the wire with all that the form of the page has."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import pytest

from arena.api.studies import WHO_AND_WHAT, StudyBody, study_rules
from arena.models import Study
from arena.services.studies import PlanOptions
from arena.web.study_forms import StudyForm
from tests.api.asking import error_of
from tests.api.tokens import program_of
from tests.study_rows import cast_of
from tests.web.cast import people

OTHER_NAMES = {
    "repeats": "repeat_share",
    "checks": "check_share",
    "overlap": "overlap_share",
    "adaptive": "adaptive_share",
    "show_alike": "settle_alike",
    "no_measures": "allow_measures",
}
"""What the wire calls a field of the form; shares are percent there."""
OF_THE_PAGE_ALONE = {"types"}
"""Ticks all scenarios of a type where no script does."""


def test_the_wire_takes_every_field_of_the_form_and_no_other() -> None:
    of_form = set(StudyForm.base_fields) - OF_THE_PAGE_ALONE
    assert {OTHER_NAMES.get(name, name) for name in of_form} == set(StudyBody().fields)


def test_every_option_of_a_plan_can_be_given() -> None:
    least = {"name": "x", "contestants": [], "scenarios": [], "experts": [], "votes_per_expert": 1}
    rest: dict[str, Any] = {
        **dict.fromkeys(("repeat_share", "check_share", "overlap_share"), 0.25),
        "adaptive_share": 0.25,
        **dict.fromkeys(("allow_both_miss", "allow_text", "allow_replay", "practice"), True),
        "settle_alike": True,
        "allow_measures": False,
        "allow_simulated": True,
        "targets": ["ann 7", "ann vs bob 3"],
        "hypotheses": ["ann above bob"],
        "samples": "all",
        "jobs": ["Round 1"],
    }
    body = StudyBody(data=least | rest)
    assert body.is_valid(), body.errors
    rules = study_rules(dict(body.validated_data))
    assert set(rules) == {*WHO_AND_WHAT, "options"}
    usual = PlanOptions()
    left = [
        one.name
        for one in fields(PlanOptions)
        if getattr(rules["options"], one.name) == getattr(usual, one.name)
    ]
    assert left == []


@pytest.mark.django_db
def test_a_preregistered_study_is_opened_by_the_wire() -> None:
    chosen = cast_of()
    admin = program_of(people()["admin"])
    given = {
        **chosen,
        "name": "Preregistered",
        "votes_per_expert": 6,
        "overlap_share": 0.5,
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
