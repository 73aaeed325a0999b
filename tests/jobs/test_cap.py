"""Eight workers and a cap that admits about half: never above it, and nothing paid twice."""

import queue
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from decimal import Decimal
from itertools import cycle

import pytest
from django.db import connection
from django.db.models import Q
from django.utils import timezone

from arena.voting.services import turns
from augment.models import Augmentation, GenerationJob, ModelCall
from augment.services.running import jobs, runner
from augment.services.running.budget import Caps
from augment.services.running.jobs import JobRequest
from augment.services.running.progress import count_rows
from augment.services.running.runner import AUGMENTATIONS
from tests.held_lock import kept_busy
from tests.jobs.models import (
    COMPLETION_TOKENS,
    PROMPT_TOKENS,
    Model,
    after_a_second_look,
    llama_job,
)
from tests.jobs.rows import NOON, STALE

pytestmark = [pytest.mark.django_db(transaction=True), pytest.mark.slow]

WORKERS = 8
SCENARIOS = 16
CALLS = 2 * SCENARIOS
USED = PROMPT_TOKENS + COMPLETION_TOKENS
ONE_WORST_CASE = 20_000
"""Tokens; more than one call of these reserves, so that the last ones fit as well."""

HALF: dict[str, Caps] = {
    "calls": Caps(cap_calls=CALLS // 2 + 1),
    "tokens": Caps(cap_tokens=CALLS // 2 * USED + ONE_WORST_CASE),
    "usd": Caps(cap_usd=Decimal(CALLS // 2 * USED + ONE_WORST_CASE) / 1_000_000),
}
"""Caps for a model that costs 1 USD per million tokens."""

ALL: dict[str, Caps] = {
    "calls": Caps(cap_calls=CALLS),
    "tokens": Caps(cap_tokens=CALLS * USED + ONE_WORST_CASE),
    "usd": Caps(cap_usd=Decimal(CALLS * USED + ONE_WORST_CASE) / 1_000_000),
}


class Watcher:
    """Looks at the job's counters while calls are in flight, and remembers what was wrong."""

    def __init__(self, job: GenerationJob) -> None:
        self.job_pk = job.pk
        self.seen = 0
        self.above: list[str] = []

    def __call__(self) -> None:
        job = GenerationJob.objects.get(pk=self.job_pk)
        self.seen += 1
        for name in ("nano_usd", "calls", "tokens"):
            cap = getattr(job, f"cap_{name}")
            held = getattr(job, f"spent_{name}") + getattr(job, f"reserved_{name}")
            if cap is not None and held > cap:
                self.above.append(f"{held} of {cap} {name}")


def run_all(job: GenerationJob, model: Model, watcher: Watcher) -> None:
    """Eight workers, each with what a queue hands it, until nothing is left to hand out."""
    work_off(
        AUGMENTATIONS.find_unsent(now=NOON, older_than=STALE, only=Q(job=job.pk)), model, watcher
    )
    job.refresh_from_db()


def work_off(
    pks: list[int], model: Model, after_each: Callable[[], object], *, workers: int = WORKERS
) -> None:
    waiting: queue.SimpleQueue[int] = queue.SimpleQueue()
    for pk in pks:
        waiting.put(pk)

    def work(number: int) -> None:
        try:
            while True:
                runner.Augmentations(model).perform(waiting.get_nowait(), worker=f"{number}")
                after_each()
        except queue.Empty:
            return
        finally:
            connection.close()

    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(work, range(workers)))


@pytest.mark.parametrize("kind", ["usd", "calls", "tokens"])
def test_eight_workers_stay_below_the_cap_and_resume_pays_for_nothing_twice(kind: str) -> None:
    job = llama_job(scenarios=SCENARIOS, price="1", caps=HALF[kind])
    watcher = Watcher(job)
    model = Model(after_a_second_look, looking_on=watcher)

    run_all(job, model, watcher)

    assert job.get_state_display().lower() == "stopped at cap"
    assert len(model.requests) == pytest.approx(CALLS / 2, abs=CALLS / 4)
    assert count_rows(job).failed == 0
    assert count_rows(job).queued > 0
    assert AUGMENTATIONS.find_unsent(now=NOON, older_than=STALE) == []
    asked_before = len(model.requests)
    check_the_books(job)

    jobs.resume(job, higher=ALL[kind])
    run_all(job, model, watcher)

    assert job.state == GenerationJob.State.FINISHED
    counts = count_rows(job)
    assert counts.by_state[Augmentation.State.DONE] == SCENARIOS
    assert asked_before < len(model.requests) == CALLS
    assert set(Counter(model.requests).values()) == {1}, "no answered call is repeated"
    assert watcher.above == []
    assert watcher.seen > CALLS
    check_the_books(job)
    assert job.spent_calls == CALLS
    assert job.spent_tokens == job.spent_nano_usd // 1000 == CALLS * USED


def test_what_eight_workers_ask_at_once_is_paid_once_whatever_their_clocks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right, hours = timezone.now, cycle((0, 2, -2))
    monkeypatch.setattr(timezone, "now", lambda: right() + timedelta(hours=next(hours)))
    asked = JobRequest(name="Again", contestants=["llama"], scenarios=["street-1"])
    rounds = [llama_job(), *(jobs.launch(asked) for _ in range(WORKERS - 1))]
    model = Model(looking_on=lambda: time.sleep(0.3))
    rows = Augmentation.objects.filter(job__in=rounds)
    work_off(list(rows.values_list("pk", flat=True)), model, lambda: None)
    assert {row.state for row in rows} == {Augmentation.State.DONE}
    assert len(model.requests) == 1
    assert [call.is_cached for call in ModelCall.objects.order_by("pk")] == [False] + 7 * [True]


@pytest.mark.sqlite
def test_no_row_of_forty_workers_fails_by_a_lock() -> None:
    job = llama_job(scenarios=48)
    model = Model(looking_on=lambda: turns.limit_waiting(connection, 0.1))
    with ThreadPoolExecutor(1) as pool:
        pool.submit(hold_now_and_then)
        work_off(list(job.augmentations.values_list("pk", flat=True)), model, int, workers=40)
    assert set(job.augmentations.values_list("state", flat=True)) == {Augmentation.State.DONE}
    assert len(model.requests) == 48


def hold_now_and_then() -> None:
    try:
        for _ in range(8):
            with kept_busy():
                time.sleep(0.3)
            time.sleep(0.2)
    finally:
        connection.close()


def check_the_books(job: GenerationJob) -> None:
    """What the job has reserved and spent is what its calls say."""
    calls = ModelCall.objects.filter(attempt__augmentation__job=job)
    paid = [call for call in calls if not call.is_cached]
    assert all(call.settled_at for call in paid)
    assert (job.reserved_calls, job.reserved_tokens, job.reserved_nano_usd) == (0, 0, 0)
    assert job.spent_calls == len(paid)
    assert job.spent_tokens == sum(call.spent_tokens or 0 for call in paid)
    assert job.spent_nano_usd == sum(call.cost_nano_usd or 0 for call in paid)
