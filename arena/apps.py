"""The Django app of arena."""

from django.apps import AppConfig


class ArenaConfig(AppConfig):
    """From two pictures to a rated table."""

    name = "arena"
    default_auto_field = "django.db.models.BigAutoField"
