"""A pair whose hidden repeat has an answer or a report stays with its expert."""

import uuid

import pytest

from arena.models import Matchup
from arena.studies.services.taking_part import hand_over
from arena.voting.services.reports import Complaint, report
from tests.opening import open_study
from tests.study_rows import cast_of, matchups_of, vote

pytestmark = pytest.mark.django_db


@pytest.mark.parametrize("is_vote", [True, False])
def test_a_pair_whose_repeat_was_judged_is_not_handed_over(is_vote: bool) -> None:
    study = open_study(name="Round 1", votes_per_expert=8, seed=7, repeats=25, **cast_of())
    repeat, other = (row for row in matchups_of(study, "eva") if row.kind == Matchup.Kind.REPEAT)
    if is_vote:
        vote(repeat)
    else:
        report(
            expert=repeat.expert,
            complaint=Complaint(key=uuid.uuid4(), matchup=repeat.code, reason="other", comment=""),
        )
    taken = hand_over(study=study, username="eva", to=["finn"])
    kept = {row.pk for row in matchups_of(study, "eva")}
    assert kept == {repeat.pk, repeat.repeat_of_id}
    assert taken == {"finn": 7}, "all eight but the one that stays"
    assert not Matchup.objects.filter(pk__in=[other.pk, other.repeat_of_id]).exists()
