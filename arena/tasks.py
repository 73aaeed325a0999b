"""Celery tasks of arena: doors that carry one id.

Rows are the truth. A message may come twice (a ready rating is not computed again) or never (the
page of a rating that waits offers to send it once more).
"""

from __future__ import annotations

import logging

from celery import shared_task
from django.contrib.auth.models import User

from arena.exports import study_files
from arena.exports.scenario_files import write_file
from arena.services import ratings
from augment.broker import open_broker
from augment.models import Scenario
from augment.services.scenarios import attention

logger = logging.getLogger(__name__)


@shared_task(name="arena.compute_snapshot", acks_late=True, ignore_result=True)
def compute_snapshot(snapshot_pk: int) -> None:
    """Compute a planned rating, unless it is ready already."""
    ratings.compute_snapshot(snapshot_pk=snapshot_pk)


def send_snapshot(snapshot_pk: int) -> None:
    """Ask a worker to compute a planned rating; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses; the rating waits until it is sent again.
    """
    with open_broker() as broker:
        compute_snapshot.apply_async((snapshot_pk,), connection=broker, retry=False)


@shared_task(name="arena.write_scenario_file", acks_late=True, ignore_result=True)
def write_scenario_file(file_pk: int) -> None:
    """Write a zip of a job's scenarios, unless it is ready already."""
    write_file(file_pk=file_pk)


def send_scenario_file(file_pk: int) -> None:
    """Ask a worker to write a zip; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses; the row waits until it is sent again.
    """
    with open_broker() as broker:
        write_scenario_file.apply_async((file_pk,), connection=broker, retry=False)


@shared_task(name="arena.write_study_file", acks_late=True, ignore_result=True)
def write_study_file(file_pk: int) -> None:
    """Write a file of a study, unless it is ready already."""
    study_files.write_study_file(file_pk=file_pk)


def send_study_file(file_pk: int) -> None:
    """Ask a worker to write a file of a study; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses; the row waits until it is sent again.
    """
    with open_broker() as broker:
        write_study_file.apply_async((file_pk,), connection=broker, retry=False)


@shared_task(name="arena.draw_checks", acks_late=True, ignore_result=True)
def draw_checks(actor_pk: int) -> None:
    """Draw the attention checks that scenarios with a reference lack; again, none is left."""
    slugs = list(Scenario.objects.exclude(reference=None).values_list("slug", flat=True))
    attention.draw_checks(scenarios=slugs, actor=User.objects.filter(pk=actor_pk).first())


def send_checks(actor_pk: int) -> None:
    """Ask a worker to draw attention checks; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses; nothing is drawn until somebody asks again.
    """
    with open_broker() as broker:
        draw_checks.apply_async((actor_pk,), connection=broker, retry=False)
