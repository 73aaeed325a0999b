"""Django's admin, whose filters can't reveal what its rows do not show."""

from typing import Any

from django.contrib.admin import AdminSite, ModelAdmin
from django.contrib.admin.apps import AdminConfig
from django.http import HttpRequest


class SiteConfig(AdminConfig):
    """In the place of django.contrib.admin."""

    default_site = "arena.config.admin_site.Site"


class Site(AdminSite):
    """An admin whose lists are filtered by their own fields alone."""

    def register(self, model_or_iterable: Any, admin_class: Any = None, **options: Any) -> None:
        """Register with `OwnLookups` in front, so that no class can go without."""
        given = admin_class or ModelAdmin
        careful = type(given.__name__, (OwnLookups, given), {"__module__": given.__module__})
        super().register(model_or_iterable, careful, **options)


class OwnLookups:
    """Refuse filters that follow a relation backwards.

    Django lets an address filter a list by one such step: contestants by the ranks of their
    standings, augmentations by the votes that they won.
    """

    model: Any

    def lookup_allowed(self, lookup: str, value: str, request: HttpRequest) -> bool:
        """Return whether a lookup begins with a field of the row itself and Django allows it."""
        fields = (*self.model._meta.fields, *self.model._meta.many_to_many)
        own = {"pk"} | {name for field in fields for name in (field.name, field.attname)}
        is_own = lookup.split("__")[0] in own
        return is_own and super().lookup_allowed(lookup, value, request)  # type: ignore[misc]
