"""The Django app of augment."""

from django.apps import AppConfig


class AugmentConfig(AppConfig):
    """From a recorded scene to a changed one."""

    name = "augment"
    default_auto_field = "django.db.models.BigAutoField"
