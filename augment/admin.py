"""Django's admin of augment, for rare edits; everything else has pages of its own."""

from typing import Any

from django.contrib import admin
from django.http import HttpRequest

from augment.models import BaseScene, Contestant, Endpoint, Scenario


class MadeElsewhere:
    """Rows that services make, because they check what they are given and log it."""

    model: Any

    def lookup_allowed(self, lookup: str, value: str, request: HttpRequest) -> bool:
        """Refuse filters that follow a relation backwards.

        Django lets an address filter a list by one such step: contestants by the ranks of their
        standings, augmentations by the votes that they won.
        """
        fields = (*self.model._meta.fields, *self.model._meta.many_to_many)
        own = {"pk"} | {name for field in fields for name in (field.name, field.attname)}
        is_own = lookup.split("__")[0] in own
        return is_own and super().lookup_allowed(lookup, value, request)  # type: ignore[misc]

    def has_add_permission(self, request: HttpRequest) -> bool:
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
        return not is_used and super().has_delete_permission(request, obj)  # type: ignore[misc]


@admin.register(BaseScene)
class BaseSceneAdmin(MadeElsewhere, admin.ModelAdmin):
    """Scenes; their documents come from files and are not typed in."""

    list_display = ("slug", "source", "created_at")
    list_filter = ("source",)
    search_fields = ("slug", "provenance")
    exclude = ("document", "recording")
    readonly_fields = ("code", "slug", "source", "created_at")


@admin.register(Scenario)
class ScenarioAdmin(MadeElsewhere, admin.ModelAdmin):
    """Scenarios; what contestants were asked stays as it was asked."""

    list_display = ("slug", "type", "base_scene", "catalogue_set", "keep_traffic")
    list_filter = ("type", "catalogue_set", "language", "keep_traffic")
    list_select_related = ("base_scene",)
    search_fields = ("slug", "instruction")
    exclude = ("reference",)
    readonly_fields = (
        *("code", "slug", "type", "base_scene", "instruction", "keep_traffic"),
        *("original_image", "created_at"),
    )


@admin.register(Endpoint)
class EndpointAdmin(MadeElsewhere, admin.ModelAdmin):
    """Endpoints; they are changed on their own pages, and deleted here while nobody asks them."""

    list_display = ("label", "base_url", "key_variable", "is_simulated", "max_concurrency")
    readonly_fields = (
        *("code", "label", "base_url", "key_variable", "is_simulated"),
        *("max_concurrency", "requests_per_minute"),
    )


@admin.register(Contestant)
class ContestantAdmin(MadeElsewhere, admin.ModelAdmin):
    """Contestants; only what people read can be changed, the rest is what was rated."""

    list_display = ("slug", "name", "kind", "variant", "model", "endpoint")
    list_filter = ("kind", "variant")
    list_select_related = ("endpoint",)
    search_fields = ("slug", "name", "model")
    readonly_fields = (
        *("code", "slug", "kind", "variant", "endpoint", "model", "roles", "error_rates"),
        *("options", "frozen_options", "sends", "created_at", "retired_at"),
    )
