"""Caps: which there can be, how they are raised, and what becomes of a job that reached one."""

from __future__ import annotations

from decimal import Decimal

import pytest

from augment.errors import Conflict
from augment.models import Event, GenerationJob
from augment.services.running import jobs
from augment.services.running.budget import Caps
from tests.jobs.models import add_llama, llama_job
from tests.jobs.rows import add_scenario, launch

pytestmark = pytest.mark.django_db


def test_a_money_cap_needs_every_price() -> None:
    with pytest.raises(Conflict, match=r"nobody knows that of llama3\.1 at local: cap the job by"):
        llama_job(caps=Caps(usd=Decimal(1)))
    assert not GenerationJob.objects.exists()


def test_a_money_cap_takes_contestants_that_cost_nothing() -> None:
    add_llama(price="1")
    add_scenario("street")
    launch()
    job = jobs.launch(
        name="R",
        contestants=["llama", "reference"],
        scenarios=["street"],
        caps=Caps(usd=Decimal("2.50")),
    )
    assert job.cap_usd == Decimal("2.5")
    event = Event.objects.filter(verb="launch").first()
    assert event is not None
    assert event.after is not None
    assert event.after["cap"] == "2.5 USD"


@pytest.mark.parametrize(
    "given",
    [
        Caps(usd=Decimal(0)),
        Caps(usd=Decimal("NaN")),
        Caps(usd=Decimal("-1")),
        Caps(calls=0),
        Caps(tokens=-5),
        Caps(calls=10**12),
    ],
)
def test_a_cap_that_can_not_be_is_refused(given: Caps) -> None:
    with pytest.raises(Conflict, match="is more than 0 and at most"):
        given.columns()
