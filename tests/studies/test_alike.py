"""Pairs that nobody can tell apart are settled when the study opens, unless it is to show them."""

import pytest

from arena.models import Study
from arena.pairing.plan import plan
from arena.results.queries.votes import Filters, last_vote_id, vote_set
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from arena.studies.services.planning import frozen_rules
from augment.models import Augmentation
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from tests.opening import open_study
from tests.scenes import vehicle
from tests.study_rows import cast_of, vote

pytestmark = pytest.mark.django_db

PLACES_M = {"ann": 20.0, "bob": 20.1, "cid": 20.3}


def opened(*, show_alike: bool = True, scenarios: int = 4) -> Study:
    cast = cast_of(scenarios=scenarios, experts=("eva",))
    for row in Augmentation.objects.select_related("contestant"):
        car = vehicle("New1", PLACES_M[row.contestant.slug], 0.0)
        row.modification = modification_to_document(Modification(added=(car,)))
        row.save(update_fields=["modification"])
    return open_study(
        name="Round 1", votes_per_expert=2 * scenarios, seed=7, show_alike=show_alike, **cast
    )


def pairs_shown(study: Study) -> set[frozenset[str]]:
    rows = study.matchups.values_list("left__contestant__slug", "right__contestant__slug")
    return {frozenset(sides) for sides in rows}


def test_pairs_within_the_tolerance_are_ties_that_nobody_sees() -> None:
    study = opened(show_alike=False)
    assert pairs_shown(study) == {frozenset({"ann", "cid"}), frozenset({"bob", "cid"})}
    again = plan(frozen_rules(study))
    assert len(again.matchups) == study.matchups.count()
    for matchup in study.matchups.all():
        vote(matchup, "left")
    found = vote_set(study, filters=Filters(), last=last_vote_id(study))
    ties = [line for line in found.counted if line.kind == "automatic"]
    # Eva judged each of the eight pairs that can be shown once, so she ties each of the four.
    assert {(tie.left, tie.right, tie.outcome) for tie in ties} == {("ann", "bob", "equal")}
    assert [tie.item for tie in ties] == [f"place-{number}" for number in range(4)]
    assert {tie.judge_name for tie in ties} == {found.counted[0].judge_name}


def test_a_tenth_of_them_is_shown_and_their_share_of_ties_is_told() -> None:
    study = opened(show_alike=False, scenarios=20)
    shown = study.rules["alike_shown"]
    assert [pair[1:] for pair in shown] == [["ann", "bob"]] * 2
    assert len(study.rules["identical"]) == 18
    study = hand_in(study)
    (remark,) = [one for one in rate(study=study, rounds=20).results.board.warnings if "18" in one]
    seen = study.matchups.filter(left__contestant__slug__in=["ann", "bob"])
    seen = seen.filter(right__contestant__slug__in=["ann", "bob"])
    number = seen.count()
    assert number > 0
    assert f"Of {number} votes on 2 such pairs that were shown all the same, {number} " in remark
    assert remark.endswith("are ties (100 %).")


def hand_in(study: Study) -> Study:
    """Whoever is far off loses; alike ones tie."""
    for number, matchup in enumerate(study.matchups.all()):
        slugs = {matchup.left.contestant.slug, matchup.right.contestant.slug}
        vote(matchup, "equal" if slugs == {"ann", "bob"} else ("left", "right")[number % 2])
    return close_study(study=study)
