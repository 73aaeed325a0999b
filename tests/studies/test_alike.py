"""Pairs that nobody can tell apart are settled when the study opens, unless it is to show them."""

from __future__ import annotations

import pytest

from arena.models import Study
from arena.pairing.plan import plan
from arena.queries.judged import automatic_ties
from arena.services.plans import rules_of
from arena.services.studies import PlanOptions, open_study
from augment.models import Augmentation
from augment.scene.codec import modification_to_document
from augment.scene.modification import Modification
from tests.scenes import vehicle
from tests.study_rows import cast_of

pytestmark = pytest.mark.django_db

PLACES_M = {"ann": 20.0, "bob": 20.1, "cid": 20.3}


def opened(*, settle_alike: bool = False) -> Study:
    cast = cast_of(scenarios=4, experts=("eva",))
    for row in Augmentation.objects.select_related("contestant"):
        car = vehicle("New1", PLACES_M[row.contestant.slug], 0.0)
        row.modification = modification_to_document(Modification(added=(car,)))
        row.save(update_fields=["modification"])
    return open_study(
        name="Round 1",
        votes_per_expert=8,
        seed=7,
        options=PlanOptions(settle_alike=settle_alike),
        **cast,
    )


def pairs_shown(study: Study) -> set[frozenset[str]]:
    rows = study.matchups.values_list("left__contestant__slug", "right__contestant__slug")
    return {frozenset(sides) for sides in rows}


def test_pairs_within_the_tolerance_are_ties_that_nobody_sees() -> None:
    study = opened(settle_alike=True)
    assert pairs_shown(study) == {frozenset({"ann", "cid"}), frozenset({"bob", "cid"})}
    ties = automatic_ties(study)
    assert {(tie.left, tie.right, tie.outcome) for tie in ties} == {("ann", "bob", "equal")}
    assert len(ties) == 4
    again = plan(rules_of(study))
    assert len(again.matchups) == study.matchups.count()


def test_a_study_may_show_them() -> None:
    study = opened()
    assert frozenset({"ann", "bob"}) in pairs_shown(study)
    assert automatic_ties(study) == []
