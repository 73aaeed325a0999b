"""Celery tasks of arena: doors that carry one id."""
