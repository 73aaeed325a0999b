"""The Celery app; its settings are the CELERY_ ones of Django's settings."""

import os

from celery import Celery
from celery.signals import setup_logging

os.environ.setdefault("DJANGO_SETTINGS_MODULE", "arena.config.settings")

app = Celery("scenario_arena")
app.config_from_object("django.conf:settings", namespace="CELERY")
app.autodiscover_tasks()


@setup_logging.connect
def leave_the_log_alone(**_: object) -> None:
    """Keep Django's log settings: Celery configures none when this signal has a receiver."""
