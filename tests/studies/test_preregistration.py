"""What is frozen at the opening, and what the results answer."""

import hashlib
import json
from dataclasses import replace
from typing import Any

import pytest
from django.urls import reverse

from arena.errors import NothingToPlan
from arena.models import Study
from arena.rating.ranking import PairP
from arena.results.exports.tables import leaderboard_table
from arena.results.exports.writers import FORMATS, bundle_files, plain_text
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study, preregistration_sha256
from arena.studies.services.plan import HypothesisVerdict, answer_hypotheses
from augment.models import Contestant
from tests import study_rows
from tests.opening import open_study
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

LINES = ("ann above cid", "cid  above ann", "Experts agree more on nudges than on overtaking.")


def opened(*, votes: int = 9, **options: Any) -> Study:
    return open_study(
        name="Round 1",
        votes_per_expert=votes,
        seed=7,
        **options,
        **study_rows.cast_of(experts=("eva", "finn", "gus", "hal", "ida")),
    )


def voted(study: Study, most: int = 1000, *, slips: int = 7) -> None:
    """Ann is best, cid worst; of so many votes one is the other way round, every fifth a tie."""
    order = ["cid", "bob", "ann"]
    for number, one in enumerate(study.matchups.order_by("position", "pk")[:most]):
        left, right = (order.index(side.contestant.slug) for side in (one.left, one.right))
        better = "left" if left > right else "right"
        worse = "right" if better == "left" else "left"
        outcome = worse if number % slips == 0 else "equal" if number % 5 == 0 else better
        study_rows.vote(one, outcome)


def test_the_file_is_frozen_at_the_opening_and_names_everything_but_people() -> None:
    study = opened(hypotheses=LINES, overlap=20)
    frozen = study.preregistration.encode()
    document = json.loads(frozen)
    assert document["hypotheses"] == [
        {"text": "ann above cid", "above": ["ann", "cid"]},
        {"text": "cid above ann", "above": ["cid", "ann"]},
        {"text": LINES[2], "above": None},
    ]
    assert document["seed"] == 7
    assert document["rules"]["overlap_share"] == 0.2
    assert [one["slug"] for one in document["contestants"]] == ["ann", "bob", "cid"]
    assert document["product"]["version"] == "0.1.0"
    assert len(document["pictures"]) == 18
    assert document["plan"]["matchups"] == 45
    assert "eva" not in frozen.decode()
    Contestant.objects.filter(slug="ann").update(name="Another name")
    assert Study.objects.get().preregistration.encode() == frozen
    assert preregistration_sha256(study) == hashlib.sha256(frozen).hexdigest()


def test_a_hypothesis_that_can_not_be_answered_opens_nothing() -> None:
    rules = {"name": "Round 1", "votes_per_expert": 9, "seed": 7, **study_rows.cast_of()}
    for line, said in (
        ("ann above zoe", "two of the contestants ann, bob, cid"),
        ("ann above ann", "two of the contestants ann, bob, cid"),
        ("x" * 501, "at most 500 signs"),
    ):
        with pytest.raises(NothingToPlan, match=said):
            open_study(**rules, hypotheses=(line,))
    assert not Study.objects.exists()


@pytest.mark.slow
def test_the_results_answer_the_pairs_and_every_export_names_the_hash() -> None:
    study = opened(votes=18, hypotheses=LINES)
    voted(study, slips=4)
    snapshot = rate(study=close_study(study=study))
    # So few votes tell nobody apart; larger ones would.
    found = replace(
        snapshot.results.board,
        above=(("ann", "cid"),),
        p_values=(PairP(a="cid", b="ann", p=0.01),),
    )
    snapshot.results = replace(snapshot.results, board=found)
    snapshot.save()
    table = leaderboard_table(snapshot)
    sha = preregistration_sha256(study)
    verdicts = [one.verdict for one in table.hypotheses]
    assert verdicts == [HypothesisVerdict.HELD, HypothesisVerdict.CONTRADICTED, None]
    for name in ("csv", "json", "latex", "parquet"):
        assert sha.encode() in FORMATS[name].write(table), name
    assert sha in plain_text(table)
    assert "Hypothesis: cid above ann: contradicted (" in plain_text(table)
    files = bundle_files(snapshot)
    assert files["preregistration.json"] == study.preregistration.encode()
    assert sha in files["manifest.json"].decode()
    assert (
        files["hypotheses.csv"].decode().splitlines()[1].startswith("ann above cid,ann,cid,held,")
    )
    person = people()["researcher"]
    page = signed_in(person).get(reverse("results", args=[study.code])).content.decode()
    assert sha in page
    assert "contradicted" in page
    assert table.hypotheses[0].difference is not None
    apart = replace(snapshot.results.board, parts={"ann": 0, "bob": 0, "cid": 1})
    snapshot.results = replace(snapshot.results, board=apart)
    assert {one.difference for one in answer_hypotheses(snapshot)} == {None}
