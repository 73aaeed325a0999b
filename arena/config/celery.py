"""The Celery app; its settings are the CELERY_ ones of Django's settings."""

from __future__ import annotations

import os

from celery import Celery

os.environ.setdefault("DJANGO_SETTINGS_MODULE", "arena.config.settings")

app = Celery("scenario_arena")
app.config_from_object("django.conf:settings", namespace="CELERY")
app.autodiscover_tasks()
