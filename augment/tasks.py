"""Celery tasks of augment: doors that carry one id."""
