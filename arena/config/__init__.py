"""The composition root: settings, urls, Celery and WSGI. Nobody imports it but the processes.

The Celery app is created here, so whoever reads the settings has it. Numerical libraries get one
thread a process before anything loads them: workers share the cores, and matrices here are small.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from arena.config.celery import app as celery_app

__all__ = ["celery_app"]
