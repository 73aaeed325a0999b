"""The composition root: settings, urls, Celery and WSGI. Nobody imports it but the processes.

The Celery app is created here, so whoever reads the settings has it.
"""

from arena.config.celery import app as celery_app

__all__ = ["celery_app"]
