"""A rating adjusted for what was shown: kept, shown and refused."""

from dataclasses import replace

import numpy as np
import pytest
from django.core.management import CommandError, call_command
from django.urls import reverse

from arena.models import Study
from arena.rating.leaderboard import rate as rate_votes
from arena.results.exports.tables import leaderboard_table
from arena.results.exports.writers import bundle_files
from arena.results.queries.votes import Filters, vote_set
from arena.results.services import ratings
from arena.results.services.analysis import vote_arrays
from arena.results.services.covariates import COVARIATES, with_covariates
from augment.errors import Conflict, UnknownName
from augment.models import Augmentation
from tests.full_study import Size, full_study
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

CAR = {"type": "VEHICLE"}
CONE = {"type": "TRAFFIC_CONE"}


@pytest.fixture
def study() -> Study:
    """Everybody adds something, now more and now less."""
    found = full_study(size=Size(scenarios=10, experts=4, votes_per_expert=90))
    for number, row in enumerate(Augmentation.objects.order_by("pk")):
        cars, cones = number * 7 % 3, number * 5 % 4
        row.modification = {"add": [CAR] * cars + [CONE] * cones, "move": [], "remove": []}
        row.save(update_fields=["modification"])
    return found


def test_the_adjusted_table_stands_with_its_effects(study: Study) -> None:
    snapshot = ratings.rate_now(study=study, seed=2, rounds=300, covariates=["objects", "side"])
    assert snapshot.covariates == ["side", "objects"]
    votes = vote_set(study, filters=Filters(), last=snapshot.last_vote)
    plain = vote_arrays(votes.entrants, votes.counted).comparisons
    objects = {
        str(row.code): len((row.modification or {})["add"]) for row in Augmentation.objects.all()
    }
    more = [float(objects[one.left_code] - objects[one.right_code]) for one in votes.counted]
    board = rate_votes(
        replace(plain, covariates=np.column_stack([np.ones(len(more)), more])), seed=2, rounds=300
    )
    stored = {line.slug: (line.rating, line.lower) for line in snapshot.standings.all()}
    assert stored == {line.name: (line.rating, line.lower) for line in board.lines}
    found = snapshot.results.adjustment
    assert found is not None
    assert [(one.name, one.points) for one in found.effects] == [
        ("side", board.coefficients[0].points),
        ("objects", board.coefficients[1].points),
    ]
    assert "adjusted for side, objects" in leaderboard_table(snapshot).method_text
    assert b'"covariates": [\n      "side",' in bundle_files(snapshot)["manifest.json"]
    shown = signed_in(people()["researcher"]).get(reverse("results", args=[study.code])).content
    assert b"Adjusted for what was shown" in shown
    assert b"the number of objects" in shown
    columns = with_covariates(plain, votes.counted, COVARIATES).covariates
    vehicles = {
        str(row.code): sum(one["type"] == "VEHICLE" for one in (row.modification or {})["add"])
        for row in Augmentation.objects.all()
    }
    first = votes.counted[0]
    assert columns[0, 2] == vehicles[first.left_code] - vehicles[first.right_code]
    assert np.abs(columns[:, 1]).max() > np.abs(columns[:, 2]).max()


def test_what_can_not_be_adjusted_for_is_refused(study: Study) -> None:
    with pytest.raises(UnknownName, match="side, objects, vehicles"):
        ratings.rate_now(study=study, covariates=["length"])
    with pytest.raises(Conflict, match="only Bradley-Terry with intervals in closed form"):
        ratings.rate_now(study=study, covariates=["side"], method="davidson")
    with pytest.raises(CommandError, match="invalid choice"):
        call_command("rate", str(study.code), "--adjust", "length")
    assert not study.snapshots.exists()
