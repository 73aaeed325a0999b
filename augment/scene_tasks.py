"""Celery tasks about scenes and their pictures: doors that carry one id.

`augment.tasks`, which workers load, loads this.
"""

from __future__ import annotations

from celery import shared_task

from augment.broker import send
from augment.services.clock import DATABASE_TIME, Moment
from augment.services.scenarios import prompts, scene_pictures, upload_moments, uploads


@shared_task(name="augment.read_upload", acks_late=True, ignore_result=True)
def read_upload(upload_pk: int) -> None:
    """Find out what an uploaded file holds; a second time nothing is left to do."""
    uploads.read_upload(upload_pk)


@shared_task(name="augment.read_moment", acks_late=True, ignore_result=True)
def read_moment(moment_pk: int) -> None:
    """Draw a moment of an upload, or keep it as a scene."""
    upload_moments.work_on_moment(moment_pk)


def enqueue_upload(upload_pk: int) -> None:
    """Have an uploaded file read; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses; recover sends it later.
    """
    uploads.mark_sent(upload_pk)
    send(read_upload, upload_pk)


def enqueue_moment(moment_pk: int) -> None:
    """Have a moment of an upload drawn or kept; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses; recover sends it later.
    """
    upload_moments.mark_sent(moment_pk)
    send(read_moment, moment_pk)


@shared_task(name="augment.draw_scene", acks_late=True, ignore_result=True)
def draw_scene(scene_pk: int) -> None:
    """Draw the pictures of a scene that are not there yet."""
    scene_pictures.draw_scene(scene_pk)


def enqueue_scene(scene_pk: int) -> None:
    """Have a scene drawn; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses.
    """
    send(draw_scene, scene_pk)


@shared_task(name="augment.draw_scenario", acks_late=True, ignore_result=True)
def draw_scenario(scenario_pk: int) -> None:
    """Draw a scenario before any change, and with its reference, unless that is there."""
    scene_pictures.draw_scenario(scenario_pk)


def enqueue_scenario(scenario_pk: int) -> None:
    """Have a scenario drawn; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses.
    """
    send(draw_scenario, scenario_pk)


@shared_task(name="augment.draw_prompts", acks_late=True, ignore_result=True)
def draw_prompts(scenario_pk: int) -> None:
    """Draw what viewers would be shown of a scenario, unless it is there."""
    prompts.draw_prompts(scenario_pk)


def enqueue_prompts(scenario_pk: int) -> None:
    """Have the pictures of prompts drawn; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses.
    """
    send(draw_prompts, scenario_pk)


def resend_lost(*, now: Moment = DATABASE_TIME) -> None:
    """Send once more what has waited for too long.

    Raises:
        QueueFault: No broker, or it refuses.
    """
    for pk in uploads.find_lost(now=now):
        enqueue_upload(pk)
    for pk in upload_moments.find_lost(now=now):
        enqueue_moment(pk)
