"""The stopping rule in a worker: a thread of its own takes the looks as they fall due."""

from __future__ import annotations

from collections.abc import Iterator
from threading import Thread
from threading import enumerate as enumerate_threads

import pytest

from arena import tasks
from arena.models import Study
from arena.rating.stopping import StoppingRule
from arena.services.looks import take_due_looks
from arena.services.plan_options import PlanOptions
from arena.services.studies import open_study
from augment.models import Event
from augment.services.running import stopping
from tests import study_rows
from tests.processes import wait_until

EXPERTS = ("eva", "finn")
RULE = StoppingRule(half_width=900.0, looks=2, closes=True)


@pytest.fixture
def worker() -> Iterator[None]:
    """A worker that is ready and looks after its studies; told to stop at the end."""
    stopping.withdraw_stop()
    try:
        tasks.start_watching()
        yield
    finally:
        stopping.request_stop()
        for thread in _watching():
            thread.join(60)
        stopping.withdraw_stop()


def _watching() -> list[Thread]:
    return [thread for thread in enumerate_threads() if thread.name == "looks"]


def _due(name: str = "Round 1") -> Study:
    """An open study, all of whose votes are in: its last look is due, and closes it."""
    study = open_study(
        name=name,
        votes_per_expert=9,
        seed=7,
        options=PlanOptions(stopping=RULE),
        **study_rows.cast_of(experts=EXPERTS),
    )
    for number, one in enumerate(study.matchups.order_by("position", "pk")):
        study_rows.vote(one, ("left", "right", "equal")[number % 3])
    return study


@pytest.mark.django_db(transaction=True)
def test_a_worker_that_is_ready_takes_what_is_due_and_ends_with_it(
    request: pytest.FixtureRequest,
) -> None:
    study = _due()
    request.getfixturevalue("worker")
    closed = Study.objects.filter(pk=study.pk, state=Study.State.CLOSED)
    wait_until(closed.exists, what="the rule closes the study")
    study.refresh_from_db()
    assert [look["met"] for look in study.looks] == [True]
    event = Event.objects.get(verb="look", object_code=str(study.code))
    assert event.actor is None
    assert len(_watching()) == 1, "it goes on after a look"
    stopping.request_stop()
    wait_until(lambda: not _watching(), what="it ends with its worker")


@pytest.mark.django_db
def test_a_study_whose_look_breaks_keeps_no_other_from_its_own(
    caplog: pytest.LogCaptureFixture,
) -> None:
    study = _due()
    broken = Study.objects.create(
        name="Broken", state=Study.State.OPEN, votes_per_expert=1, seed=1,
        rules={"stopping": {"no_such_rule": 1}, "experts": ["eva"]},
    )  # fmt: skip
    Study.objects.filter(pk=broken.pk).update(id=study.pk - 1)  # comes first
    assert take_due_looks() == [study]
    assert f"The look at study {broken.code} broke" in caplog.text
