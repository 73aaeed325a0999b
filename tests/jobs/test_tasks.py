from datetime import timedelta
from io import StringIO

import pytest
from celery import current_app
from django.core.management import CommandError, call_command
from django.utils import timezone

from augment import tasks
from augment.errors import QueueUnreachable
from augment.management.commands.generate import Command
from augment.management.waiting import wait
from augment.models import Augmentation, GenerationJob
from augment.services.driving.simulations import DRIVES
from augment.services.running.progress import count_rows
from augment.services.running.runner import AUGMENTATIONS
from augment.tasks import check_broker
from tests.brokers import Broker
from tests.jobs.rows import add_scenario, done, launch, leased, only_row

pytestmark = pytest.mark.django_db
State = Augmentation.State


def test_a_job_is_sent_once(broker: Broker) -> None:
    job = launch(scenarios=3)
    assert tasks.enqueue_job(job.pk) == 3
    assert tasks.enqueue_job(job.pk) == 0
    assert len(broker) == 3
    assert not job.augmentations.filter(sent_at=None).exists()


def test_without_a_broker_the_error_names_the_address_and_the_rows_wait(no_broker: None) -> None:
    job = launch()
    with pytest.raises(QueueUnreachable, match=r"No Redis at .*nowhere.*manage\.py serve"):
        tasks.enqueue_job(job.pk)
    row = only_row(job)
    assert (row.state, row.sent_at) == (State.QUEUED, None)


def test_the_address_of_a_broker_is_named_without_its_password(no_broker: None) -> None:
    current_app.conf.broker_url = "redis://:sekret@127.0.0.1:1/0"
    with pytest.raises(QueueUnreachable) as caught:
        check_broker()
    assert "127.0.0.1:1" in str(caught.value)
    assert "sekret" not in str(caught.value)


def test_the_task_runs_its_row() -> None:
    row = only_row(launch())
    tasks.work.run("augmentation", row.pk)
    row.refresh_from_db()
    assert row.state == State.DONE
    assert row.attempts.get().worker.startswith("here ")


def test_recover_takes_back_and_sends_what_a_dead_worker_held(broker: Broker) -> None:
    row = only_row(launch())
    now = timezone.now()
    AUGMENTATIONS.mark_sent([row.pk], now=now - timedelta(minutes=1))
    leased(row, now=now - timedelta(minutes=1))
    tasks.recover(now=now)
    row.refresh_from_db()
    assert row.state == State.QUEUED
    assert row.sent_at is not None
    assert len(broker) == 1


@pytest.mark.parametrize(
    ("is_forgotten", "minutes", "at_start", "waiting"),
    [
        (False, 5, False, 2),
        (False, 11, False, 4),
        (True, 0, False, 0),
        (True, 1, False, 2),
        (False, 0, True, 4),
    ],
)
def test_messages_are_sent_again_when_old_or_forgotten_and_as_a_worker_starts(
    broker: Broker, is_forgotten: bool, minutes: int, at_start: bool, waiting: int
) -> None:
    tasks.enqueue_job(launch(scenarios=2).pk)
    if is_forgotten:
        broker.purge()
        tasks.recover(now=timezone.now())  # looks what is waiting there
    tasks.recover(now=timezone.now() + timedelta(minutes=minutes), at_start=at_start)
    assert len(broker) == waiting


def test_recover_finishes_a_job_whose_last_worker_died_before_it_could(broker: Broker) -> None:
    job = launch()
    leased(only_row(job)).settle(done(), now=timezone.now() + timedelta(minutes=1))
    tasks.recover(now=timezone.now())
    job.refresh_from_db()
    assert job.state == GenerationJob.State.FINISHED


def test_a_fault_of_one_kind_of_work_leaves_the_others_theirs(
    broker: Broker, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: object) -> None:
        raise RuntimeError("nothing is tidy")

    launch()
    monkeypatch.setattr(DRIVES, "cleanup", fail)
    tasks.recover(now=timezone.now(), at_start=True)
    assert "Could not take back lost work of Simulation." in caplog.text
    assert len(broker) == 1


def test_generate_launches_what_all_and_catalogue_stand_for(
    broker: Broker, django_capture_on_commit_callbacks: object
) -> None:
    add_scenario("own")
    add_scenario("shipped", catalogue_set="paper")
    said = StringIO()
    with django_capture_on_commit_callbacks(execute=True):  # type: ignore[operator]
        call_command("generate", "--contestants", "all", "--scenarios", "catalogue", stdout=said)
    job = GenerationJob.objects.get()
    assert set(job.augmentations.values_list("contestant__slug", "scenario__slug")) == {
        ("reference", "shipped"),
        ("rule-placer", "shipped"),
        ("quantised-5m", "shipped"),
    }
    assert "3 to run" in said.getvalue()
    assert len(broker) == 3


def test_generate_without_a_broker_says_what_to_do_and_launches_nothing(no_broker: None) -> None:
    add_scenario("street")
    with pytest.raises(CommandError, match=r"No Redis at .*start `manage.py serve`"):
        call_command("generate", "--contestants", "reference", "--scenarios", "all")
    assert not GenerationJob.objects.exists()


def test_waiting_ends_with_the_job() -> None:
    job = launch()
    leased(only_row(job)).settle(done(), now=timezone.now())
    said = StringIO()
    wait(Command(stdout=said), job, timeout_s=1.0)
    assert said.getvalue() == "1 of 1, 0 running\nOver.\n"
    assert count_rows(job).by_state[Augmentation.State.DONE] == 1
