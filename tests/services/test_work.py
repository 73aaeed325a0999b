"""The machine that all kinds of work share, over every kind; on PostgreSQL as well."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from datetime import timedelta
from threading import Barrier
from typing import Any
from unittest.mock import Mock

import pytest
from django.apps import apps
from django.db import connection
from django.utils import timezone
from pytest_django import Settings

from arena import tasks
from arena.models import BenchmarkFile, ScenarioFile, StudyFile
from arena.results.services.ratings import plan_snapshot
from arena.studies.services.opening import close_study
from augment.errors import BudgetSpent, Conflict, LeaseLost, WorkerStopping
from augment.models import (
    Benchmark,
    Endpoint,
    Event,
    JudgeRun,
    PairJudgement,
    SceneUpload,
    Simulation,
    Submission,
    UploadMoment,
    Work,
)
from augment.services.benchmarks.benchmarks import BenchmarkRequest, make_benchmark
from augment.services.driving import simulations
from augment.services.endpoints.known_endpoints import EndpointRequest, ensure_endpoint
from augment.services.endpoints.known_models import model_at
from augment.services.endpoints.probing import plan_probe
from augment.services.running.intent_readings import plan_reading
from augment.services.work import KINDS, Lease, Settlement, WorkKind
from tests.jobs.rows import NOON, add_scenario, launch, only_row
from tests.processes import wait_until
from tests.study_rows import a_study

pytestmark = pytest.mark.django_db
LATER = NOON + timedelta(seconds=30)
MINUTE = timedelta(minutes=1)


def an_upload(**columns: Any) -> SceneUpload:
    return SceneUpload.objects.create(name="log.zip", size_bytes=1, digest="0", **columns)


def a_submission() -> Work:
    benchmark = Benchmark.objects.create(slug="b", title="B", version=1, made_on=NOON.date())
    sent: dict[str, Any] = {"name": "files.zip", "size_bytes": 1, "digest": "0"}
    return Submission.objects.create(benchmark=benchmark, **sent)


def a_drive() -> Work:
    scenario, options = add_scenario("street"), simulations.Options()
    pks = simulations.plan_scenario(scenario=scenario, options=options)
    return Simulation.objects.get(pk=pks[0])


def a_benchmark_file() -> Work:
    street = [add_scenario("street").slug]
    request = BenchmarkRequest(slug="s", title="S", scenarios=street, practice=0.0)
    return BenchmarkFile.objects.create(benchmark=make_benchmark(request))


def here() -> Endpoint:
    return ensure_endpoint(EndpointRequest(label="here", base_url="http://127.0.0.1:1/v1"))


def a_reading() -> Work:
    return plan_reading(scenario=add_scenario("street"), endpoint=here(), model="m")


def a_judgement() -> Work:
    run = JudgeRun.objects.create(endpoint=here(), model="m")
    left, right = launch(contestants=("one", "other")).augmentations.all()
    return PairJudgement.objects.create(run=run, left=left, right=right)


WAITING: dict[str, Callable[[], Work]] = {
    "augmentation": lambda: only_row(launch()),
    "benchmarkfile": a_benchmark_file,
    "intentreading": a_reading,
    "pairjudgement": a_judgement,
    "probe": lambda: plan_probe(model_at(endpoint=here(), model="m")),
    "scenariofile": lambda: ScenarioFile.objects.create(job=launch(), format="json"),
    "sceneupload": an_upload,
    "simulation": a_drive,
    "snapshot": lambda: plan_snapshot(study=close_study(study=a_study()), rounds=10),
    "studyfile": lambda: StudyFile.objects.create(study=a_study(), kind="study"),
    "submission": a_submission,
    "uploadmoment": lambda: UploadMoment.objects.create(upload=an_upload(state="read")),
}
"""How a row of each kind comes to wait."""


def test_every_kind_is_known_to_workers() -> None:
    assert tasks is not None
    assert KINDS.keys() == WAITING.keys()
    every = {model for model in apps.get_models() if issubclass(model, Work)}
    assert {kind.model for kind in KINDS.values()} == every


@pytest.fixture(params=sorted(WAITING))
def kind(request: pytest.FixtureRequest) -> WorkKind[Any]:
    return KINDS[request.param]


@pytest.fixture
def row(kind: WorkKind[Any]) -> Work:
    return WAITING[kind.name]()


def taken(kind: WorkKind[Any], row: Work, now: Any = NOON) -> Lease[Any]:
    held = kind.take(row.pk, now=now)
    assert held is not None
    row.refresh_from_db()
    return held


def waiting(kind: WorkKind[Any]) -> dict[str, str]:
    """What else is set where a failed row is to wait again."""
    return {"state": "queued"} if kind.name == "uploadmoment" else {}


def test_a_waiting_row_is_taken_once_kept_and_settled_once(kind: WorkKind[Any], row: Work) -> None:
    held = taken(kind, row)
    assert (row.state in row.UNDER_WAY, row.claim, row.heartbeat_at) == (True, held.token, NOON)
    assert kind.take(row.pk, now=NOON) is None
    assert kind.take(row.pk + 1000, now=NOON) is None
    assert held.renew(now=NOON + timedelta(seconds=15))
    assert kind.take_back_lost(now=LATER) == []
    assert held.is_held()
    assert held.settle(Settlement(state="failed", reason="no\0 luck"), now=LATER)
    assert not held.settle(Settlement(state="failed", reason="twice"), now=LATER)
    row.refresh_from_db()
    assert (row.state, row.reason, row.finished_at) == ("failed", "no\u2400 luck", LATER)
    assert (row.claim, row.heartbeat_at) == (None, None)
    assert kind.take(row.pk, now=LATER) is None


def test_who_lost_a_lease_writes_nothing(
    kind: WorkKind[Any], row: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kind, "lost_limit", 5)
    kind.mark_sent([row.pk], now=NOON)
    slow = taken(kind, row)
    assert kind.take_back_lost(now=LATER) == [row.pk]
    row.refresh_from_db()
    assert (row.claim, row.heartbeat_at, row.sent_at, row.lost) == (None, None, None, 1)
    current = taken(kind, row, LATER)
    assert not slow.renew(now=LATER)
    assert not slow.is_held()
    assert not slow.settle(Settlement(state="failed"), now=LATER)
    assert not slow.release(now=LATER)
    with pytest.raises(LeaseLost):
        slow.note(reason="mine")
    assert current.settle(Settlement(state="failed"), now=LATER)


def test_a_row_that_ends_worker_after_worker_fails_and_may_be_tried_again(
    kind: WorkKind[Any], row: Work
) -> None:
    for number in range(1, kind.lost_limit + 1):
        now = NOON + number * MINUTE
        taken(kind, row, now)
        waits_again = kind.take_back_lost(now=now + timedelta(seconds=30))
        assert bool(waits_again) == (number < kind.lost_limit)
    row.refresh_from_db()
    assert (row.state, row.claim, row.lost, "ost" in row.reason) == ("failed", None, 0, True)
    assert row.wait_again(**waiting(kind))
    assert (row.state in row.UNDER_WAY, row.reason, row.sent_at) == (True, "", None)
    assert not row.wait_again()


def test_a_rating_that_has_lost_its_last_worker_is_logged_as_failed() -> None:
    ratings, row = KINDS["snapshot"], WAITING["snapshot"]()
    for number in range(1, ratings.lost_limit + 1):
        assert not Event.objects.filter(verb="rating failed").exists()
        taken(ratings, row, NOON + number * MINUTE)
        ratings.take_back_lost(now=NOON + number * MINUTE + timedelta(seconds=30))
    row.refresh_from_db()
    logged = Event.objects.get(verb="rating failed")
    assert logged.after == {"snapshot": str(row.code), "why": row.reason}


def test_rows_without_a_message_or_an_old_one_are_unsent(kind: WorkKind[Any], row: Work) -> None:
    before, age = row.state, timedelta(minutes=10)
    assert row.pk in kind.find_unsent(now=NOON, older_than=age)
    kind.mark_sent([row.pk], now=NOON - MINUTE)
    assert row.pk not in kind.find_unsent(now=NOON, older_than=age)
    kind.mark_sent([row.pk], now=NOON - 11 * MINUTE)
    assert row.pk in kind.find_unsent(now=NOON, older_than=age)
    held = taken(kind, row)
    assert row.pk not in kind.find_unsent(now=NOON, older_than=age)
    assert held.release(now=LATER)
    row.refresh_from_db()
    assert (row.state, row.claim, row.sent_at) == (before, None, None)


BREAKS: list[tuple[BaseException, str | None, str]] = [
    (WorkerStopping("it stops"), None, ""),
    (SystemExit(), None, ""),
    (Conflict("It changed."), "failed", "It changed."),
    (KeyError("nobody foresaw this"), "failed", "unexpected: KeyError: 'nobody foresaw this'"),
    (LeaseLost(), "held", ""),
    (BudgetSpent("5 calls"), None, ""),
]
"""What ends the work, the state of its row then (none for the one before), and its reason."""


def test_no_row_hangs_when_the_work_breaks(
    kind: WorkKind[Any], row: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = row.state
    monkeypatch.setattr(kind, "lost_limit", 5)
    for error, state, reason in BREAKS:
        monkeypatch.setattr(kind, "run", Mock(side_effect=error))
        with pytest.raises(SystemExit) if isinstance(error, SystemExit) else nullcontext():
            assert kind.perform(row.pk)
        row.refresh_from_db()
        assert (row.claim is not None) == (state == "held")
        if state == "held":
            assert kind.take_back_lost(now=timezone.now() + MINUTE) == [row.pk]
        else:
            assert (row.state, row.reason) == (state or before, reason)
        if state == "failed":
            assert row.wait_again(**waiting(kind))
            JudgeRun.objects.update(state="running")  # it was over with its only pair


# --- Threads -------------------------------------------------------------------------------------


@pytest.mark.django_db(transaction=True)
def test_the_heart_beats_while_the_work_goes_on(settings: Settings) -> None:
    settings.HEARTBEAT_S = 0.05
    uploads, row, before = KINDS["sceneupload"], an_upload(), timezone.now() - MINUTE
    held = taken(uploads, row, before)

    def has_beaten() -> bool:
        row.refresh_from_db()
        return row.heartbeat_at is not None and row.heartbeat_at > before

    with held.keep_alive():
        wait_until(has_beaten, what="the heart has beaten")
        assert uploads.take_back_lost() == []


@pytest.mark.django_db(transaction=True)
def test_the_heart_stops_with_the_lease_and_the_work_is_told(settings: Settings) -> None:
    settings.HEARTBEAT_S = 0.01
    uploads, row = KINDS["sceneupload"], an_upload()
    held = taken(uploads, row, timezone.now() - MINUTE)
    held.insist()
    uploads.take_back_lost()
    with held.keep_alive():
        wait_until(lambda: held._is_lost.is_set(), what="it is given up")
    with pytest.raises(LeaseLost):
        held.insist()


@pytest.mark.django_db(transaction=True)
def test_of_eight_workers_that_reach_for_one_row_one_gets_it() -> None:
    row = only_row(launch())
    start = Barrier(8)

    def reach() -> bool:
        start.wait()
        try:
            return KINDS["augmentation"].take(row.pk) is not None
        finally:
            connection.close()

    with ThreadPoolExecutor(8) as pool:
        got = [future.result() for future in [pool.submit(reach) for _ in range(8)]]
    assert sorted(got) == [False] * 7 + [True]
    assert row.attempts.count() == 1
