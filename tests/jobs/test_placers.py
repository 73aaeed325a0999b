"""Rows of the contestants that ask no language model."""

from __future__ import annotations

from typing import Any

import pytest

from augment.errors import Conflict
from augment.models import Augmentation, Contestant
from augment.scene.codec import intent_to_document, modification_to_document
from augment.scene.entities import Modification
from augment.scene.intent import Intent
from augment.services.endpoints import contestants
from augment.services.running import jobs
from tests.intents import parked
from tests.jobs.rows import add_kind, add_scenario, only_row
from tests.jobs.running import ran

pytestmark = pytest.mark.django_db
State = Augmentation.State


def one_job(kind: str, **columns: Any) -> Augmentation:
    add_kind("someone", kind)
    add_scenario("street", **columns)
    return only_row(jobs.launch(name="R", contestants=["someone"], scenarios=["street"]))


def test_a_reference_that_does_not_fit_is_a_failure_with_a_sentence() -> None:
    gone = modification_to_document(Modification(removed=("Agent9",)))
    row = ran(one_job(Contestant.Kind.REFERENCE, reference=gone))
    assert row.state == State.FAILED
    assert row.reason.startswith("The modification does not fit the scene: Agent9")


def test_the_rule_placer_places_the_same_each_time() -> None:
    first = ran(one_job(Contestant.Kind.RULE))
    assert first.state == State.DONE
    again = jobs.launch(name="R2", contestants=["someone"], scenarios=["street"])
    second = ran(only_row(again))
    assert second.modification == first.modification
    assert second.image == first.image


PARKED = parked(22.0)


def quantised(slug: str, intent: Intent) -> Augmentation:
    add_scenario(f"street-{slug}", intent=intent_to_document(intent))
    contestants.ensure_builtin()
    job = jobs.launch(name="Q", contestants=[slug], scenarios=[f"street-{slug}"])
    return ran(only_row(job))


@pytest.mark.parametrize("slug", ["quantised-5m", "quantised-20m"])
def test_the_quantised_baselines_place_vehicles_and_tell_their_codes(slug: str) -> None:
    row = quantised(slug, PARKED)
    assert row.state == State.DONE
    assert "Agent2: front right, 20 to " in row.notes
    assert "direction same, stands" in row.notes


def test_simulated_errors_of_an_earlier_version_run_no_more() -> None:
    add_kind("someone", Contestant.Kind.SIMULATED)
    Contestant.objects.filter(slug="someone").update(error_rates={"position": 0.1})
    add_scenario("street")
    with pytest.raises(Conflict, match="A job can't run someone"):
        jobs.launch(name="R", contestants=["someone"], scenarios=["street"])
