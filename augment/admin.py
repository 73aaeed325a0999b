"""Django's admin of augment: rows to look at, and to delete while nothing hangs on them."""

from typing import Any

from django.contrib import admin
from django.http import HttpRequest

from augment.models import BaseScene, Contestant, Endpoint, Scenario


@admin.register(BaseScene, Contestant, Endpoint, Scenario)
class MadeElsewhere(admin.ModelAdmin):
    """Rows that services make and change, because they check what they are given and log it."""

    exclude = ("document", "recording", "reference")

    def lookup_allowed(self, lookup: str, value: str, request: HttpRequest) -> bool:
        """Refuse filters that follow a relation backwards.

        Django lets an address filter a list by one such step: contestants by the ranks of their
        standings, augmentations by the votes that they won.
        """
        fields = (*self.model._meta.fields, *self.model._meta.many_to_many)
        own = {"pk"} | {name for field in fields for name in (field.name, field.attname)}
        is_own = lookup.split("__")[0] in own
        return is_own and super().lookup_allowed(lookup, value, request)

    def has_add_permission(self, request: HttpRequest) -> bool:
        """Never by hand."""
        return False

    def has_change_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """Never by hand."""
        return False

    def has_delete_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """Allow it one by one, as long as nothing hangs on the row.

        Else the page that refuses would list what hangs on it, a rank or a vote among it.
        """
        if obj is None:
            return False
        is_used = any(
            one.related_model._default_manager.filter(**{one.field.name: obj}).exists()
            for one in obj._meta.related_objects
        )
        return not is_used and super().has_delete_permission(request, obj)
