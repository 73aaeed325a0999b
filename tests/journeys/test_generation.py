"""A generation job on a real Redis and real workers that are killed in the middle of it."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from tests.formats.hostile_files import scenarionet_of_nested_tuples_as_a_key
from tests.processes import Machine, WaitingModel, machine, wait_until
from tests.variants.playing import GOOD

pytestmark = [pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(600)]

SEED = """
from augment.models import Endpoint
from augment.services.endpoints import contestants
from augment.services.endpoints.contestants import ContestantRequest
from tests.jobs.rows import add_scenario
contestants.ensure_builtin()
Endpoint.objects.create(label="waiting", base_url="{base_url}", is_simulated=True)
contestants.add_contestant(
    ContestantRequest(slug="waiting", variant="otm", endpoint="waiting", model="waits")
)
for number in range(1, 4):  # the last has the first one's prompt, which waits for no other
    add_scenario(f"street-{{number}}", instruction=f"Set out {{1 + number % 2}} cones.")
"""
CHOSEN = ("--contestants", "reference", "waiting", "--scenarios", "all")
UPLOAD_THEN_GENERATE = """
import time
from pathlib import Path
from django.core.files.base import ContentFile
from django.core.management import call_command
from augment.models import SceneUpload
from augment.tasks import enqueue_row
from augment.services.scenarios.uploads import keep_upload
content = ContentFile(Path("{path}").read_bytes())
enqueue_row(keep_upload(name="made.pkl", content=content, source="scenarionet"))
while SceneUpload.objects.get().state != "running":
    time.sleep(0.05)
call_command("generate", *{chosen})
"""
BY_STATE = "SELECT state, COUNT(*) FROM augment_augmentation GROUP BY state"
DONE = "SELECT id FROM augment_augmentation WHERE state = 'done'"
RUNNING = "SELECT id FROM augment_augmentation WHERE state = 'running'"
ATTEMPTS = "SELECT augmentation_id, number, outcome FROM augment_attempt ORDER BY 1, 2"


@pytest.fixture(scope="module")
def served() -> Iterator[WaitingModel]:
    with WaitingModel(GOOD) as served:
        yield served


@pytest.fixture(scope="module")
def seeded(migrated: Path, served: WaitingModel) -> Iterator[Path]:
    """A database with three scenarios and the contestants; every test has a copy."""
    with machine(database=migrated) as made:
        made.must("shell", "--verbosity", "0", "-c", SEED.format(base_url=served.base_url))
        yield made.database


@pytest.fixture
def model(served: WaitingModel) -> Iterator[WaitingModel]:
    served.start_anew()
    yield served
    served.gate.set()


@pytest.fixture
def place(seeded: Path) -> Iterator[Machine]:
    with machine(database=seeded) as made:
        yield made


def wait_for_the_job(place: Machine) -> None:
    state = "SELECT state FROM augment_generationjob"
    wait_until(lambda: place.rows(state) == [("finished",)], what="the job is over", within_s=240)


def in_flight(place: Machine, model: WaitingModel, *, at_once: int = 2) -> set[int]:
    """Wait until every thread of the worker waits for a model; for which rows that is."""
    wait_until(lambda: model.asked == at_once, what="models are asked")
    return {pk for (pk,) in place.rows(RUNNING)}


def check_each_row_is_done_once(place: Machine, killed: set[int]) -> None:
    assert place.rows(BY_STATE) == [("done", 6)]
    tries: dict[int, list[tuple[int, str]]] = {}
    for pk, number, outcome in place.rows(ATTEMPTS):
        tries.setdefault(pk, []).append((number, outcome))
    assert len(tries) == 6
    for pk, numbered in tries.items():
        assert numbered == ([(1, "lost"), (2, "done")] if pk in killed else [(1, "done")])
    answered = "SELECT COUNT(*) FROM augment_modelcall WHERE answer IS NOT NULL"
    assert place.rows(answered) == [(3,)]
    images = {name for (name,) in place.rows("SELECT image FROM augment_augmentation")}
    assert all((place.media / name).is_file() for name in images)


class Processes:
    """A Redis and a worker, which a test may kill and start again."""

    def __init__(self, place: Machine, **options: Any) -> None:
        self._place, self._options = place, options
        self.start()

    def start(self, *, redis: bool = True, worker: bool = True) -> None:
        if redis:
            self.redis = self._place.redis()
        if worker:
            self.worker = self._place.worker(**self._options)


@contextmanager
def processes(place: Machine, **options: Any) -> Iterator[Processes]:
    started = Processes(place, **options)
    try:
        yield started
    finally:
        started.worker.stop()
        started.redis.stop()


@pytest.mark.parametrize(("pool", "redis"), [("prefork", False), ("threads", True)])
def test_a_job_survives_kill_9_of_its_worker_and_the_loss_of_all_messages(
    place: Machine, model: WaitingModel, pool: str, redis: bool
) -> None:
    with processes(place, pool=pool) as running:
        place.must("generate", *CHOSEN)
        killed = in_flight(place, model)
        running.worker.kill()
        if redis:
            running.redis.kill()
        assert len(killed) == 2
        place.age("heartbeat_at", state="running")
        model.gate.set()
        running.start(redis=redis)
        wait_for_the_job(place)
        check_each_row_is_done_once(place, killed)


def test_a_job_goes_on_when_redis_alone_comes_back_empty(
    place: Machine, model: WaitingModel
) -> None:
    with processes(place, concurrency=1) as running:
        place.must("generate", *CHOSEN)
        in_flight(place, model, at_once=1)
        running.redis.kill()
        place.age("sent_at", state="queued")
        running.start(worker=False)
        model.gate.set()
        wait_for_the_job(place)
        check_each_row_is_done_once(place, killed=set())


def test_a_worker_that_is_told_to_stop_waits_for_its_calls_and_takes_nothing_on(
    place: Machine, model: WaitingModel
) -> None:
    place.environment["ARENA_KEY_VARIABLES"] = "NO_SUCH_API_KEY=127.0.0.1"
    with processes(place) as running:
        place.must("generate", *CHOSEN)
        flying, worker = in_flight(place, model), running.worker
        stopping = Thread(target=worker.stop)
        stopping.start()
        wait_until(lambda: "Warm shutdown" in worker.said(), what="the worker was told to stop")
        model.gate.set()
        stopping.join(200)
        assert not worker.is_alive()
        assert "Cold shutdown" not in worker.said()
        assert flying <= {pk for (pk,) in place.rows(DONE)}
        assert place.rows(RUNNING) == []
        assert place.rows("SELECT COUNT(*) FROM augment_worker WHERE ended_at IS NULL") == [(0,)]
        running.start(redis=False)
        wait_for_the_job(place)
        check_each_row_is_done_once(place, killed=set())
        assert model.asked == 2, "the third has the same prompt; nothing was asked again"
        check_that_the_command_waits_and_reports(place, model)


def check_that_the_command_waits_and_reports(place: Machine, model: WaitingModel) -> None:
    """What was done by its table; a failure by its reason, and ends with 1."""
    facts = ("--variant", "otm", "--endpoint", "cloud", "--model", "m")
    address = ("--base-url", model.base_url, "--key-variable", "NO_SUCH_API_KEY")
    chosen = ("--contestants", "cloudy", "--scenarios", "street-1", "street-2", "--wait")
    said = place.must("generate", *CHOSEN, "--wait", "--timeout", "240")
    place.must("add_contestant", "cloudy", *facts, *address)
    ended = place.manage("generate", *chosen)
    assert said.splitlines()[-2:] == ["Over.", "6 done, 0 unreadable, 0 refused, 0 failed"]
    assert ended.returncode == 1
    assert "failed x 2: The environment variable NO_SUCH_API_KEY" in ended.stdout
    assert "2 failed" in ended.stderr
    assert model.asked == 2, "answers come from the store, and without a key nobody is asked"


def test_a_job_goes_on_in_a_worker_that_reads_a_freezing_pickle(
    place: Machine, model: WaitingModel, tmp_path: Path
) -> None:
    _, pickle = scenarionet_of_nested_tuples_as_a_key(tmp_path)
    model.gate.set()
    upload = "SELECT state, lost, reason FROM augment_sceneupload"
    meanwhile = (
        "SELECT COUNT(*) FROM augment_augmentation a, augment_sceneupload u "
        "WHERE a.state = 'done' AND a.finished_at < u.finished_at"
    )
    with processes(place):
        code = UPLOAD_THEN_GENERATE.format(path=pickle, chosen=CHOSEN)
        place.must("shell", "--verbosity", "0", "-c", code)
        wait_for_the_job(place)
        wait_until(lambda: place.rows(upload)[0][0] == "failed", what="the file is refused")
        ((_, lost, reason),) = place.rows(upload)
        assert lost == 0, "no worker was lost over it"
        assert "made.pkl: takes more than 8 s of computing to read" in reason
        assert place.rows(BY_STATE) == [("done", 6)]
        assert place.rows(meanwhile)[0][0] > 0
