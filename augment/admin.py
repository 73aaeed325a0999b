"""Django's admin of augment, for rare edits. What is a record of the past can only be read."""

from __future__ import annotations

from typing import Any

from django import forms
from django.contrib import admin
from django.http import HttpRequest

from augment.errors import InvalidDocument
from augment.models import (
    Attempt,
    Augmentation,
    BaseScene,
    Contestant,
    Endpoint,
    EndpointModel,
    Event,
    GenerationJob,
    ModelCall,
    Scenario,
)
from augment.services.endpoints.known_endpoints import check_key_variable, log_move, move_of
from augment.services.endpoints.known_models import facts_of
from augment.services.events import log_event


class ReadOnlyRows:
    """Nobody adds, changes or deletes a row by hand."""

    def has_add_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """Never."""
        return False

    def has_change_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """Never."""
        return False

    def has_delete_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """Never."""
        return False


class MadeElsewhere:
    """Rows that services make, because they check what they are given and log it."""

    def has_add_permission(self, request: HttpRequest) -> bool:
        """Never by hand."""
        return False

    def has_delete_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """One by one, as long as nothing hangs on it.

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


class EndpointModelInline(admin.StackedInline):
    """The models of an endpoint: what they can do, what they cost, what the probe saw."""

    model = EndpointModel
    extra = 0
    readonly_fields = ("refused_parameters", "probed_at", "probe_report")
    fieldsets = (
        (None, {"fields": (("model", "model_class"),)}),
        (
            "Abilities (unknown until probed or entered)",
            {
                "fields": (
                    ("native_tools", "vision", "json_schema", "temperature"),
                    ("reasoning_effort", "context_tokens", "max_output_tokens"),
                    "refused_parameters",
                )
            },
        ),
        (
            "Price per million tokens (unknown where empty)",
            {"fields": (("price_in_usd", "price_out_usd"), ("price_as_of", "price_source"))},
        ),
        ("Last probe", {"classes": ("collapse",), "fields": ("probed_at", "probe_report")}),
    )


class EndpointForm(forms.ModelForm):
    """An endpoint; what its key variable holds goes to no other server without being asked."""

    move_key = forms.BooleanField(
        required=False,
        label="Move the key",
        help_text="the key may go to another server than so far; asked for where it would",
    )

    def clean_key_variable(self) -> str:
        """A variable that is meant for keys, or none.

        Raises:
            ValidationError: It is another.
        """
        variable = str(self.cleaned_data["key_variable"])
        try:
            check_key_variable(variable)
        except InvalidDocument as error:
            raise forms.ValidationError([problem for _, problem in error.problems]) from error
        return variable

    def clean(self) -> dict[str, Any]:
        """Ask once more where the key would go to another server."""
        cleaned: dict[str, Any] = super().clean() or self.cleaned_data
        self.move = None
        if self.instance.pk and "base_url" in cleaned and "key_variable" in cleaned:
            self.move = move_of(
                endpoint=Endpoint.objects.get(pk=self.instance.pk),
                base_url=cleaned["base_url"],
                key_variable=cleaned["key_variable"],
            )
        if self.move is not None and not cleaned.get("move_key"):
            before, after = self.move
            problem = (
                f"The key in {cleaned['key_variable']} went to {before} and would go to {after}. "
                "Tick this box if that is meant."
            )
            self.add_error("move_key", problem)
        return cleaned


@admin.register(Endpoint)
class EndpointAdmin(admin.ModelAdmin):
    """Endpoints; every change is logged, and who is simulated stays so."""

    form = EndpointForm
    list_display = ("label", "base_url", "key_variable", "is_simulated", "max_concurrency")
    list_filter = ("is_simulated",)
    inlines = (EndpointModelInline,)

    def get_readonly_fields(self, request: HttpRequest, obj: Any = None) -> tuple[str, ...]:
        """What contestants were named and rated by can't be changed any more."""
        return ("code",) if obj is None else ("code", "label", "is_simulated")

    def save_model(self, request: HttpRequest, obj: Any, form: Any, change: bool) -> None:
        """Remember how it was, for the log."""
        form.before = facts_of(obj) if change else None
        super().save_model(request, obj, form, change)

    def save_related(self, request: HttpRequest, form: Any, formsets: Any, change: bool) -> None:
        """Log the endpoint with its models, before and after."""
        super().save_related(request, form, formsets, change)
        log_event(
            actor=request.user,  # type: ignore[arg-type]
            verb="change" if change else "add",
            object_kind="endpoint",
            object_code=form.instance.code,
            before=form.before,
            after=facts_of(form.instance),
        )
        log_move(form.move, endpoint=form.instance, actor=request.user)  # type: ignore[arg-type]


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


class AugmentationInline(ReadOnlyRows, admin.TabularInline):
    """The rows of a job."""

    model = Augmentation
    fields = ("scenario", "contestant", "sample", "state", "reason", "finished_at")
    extra = 0
    show_change_link = True

    def get_queryset(self, request: HttpRequest) -> Any:
        """With what a line shows, in one query."""
        return super().get_queryset(request).select_related("scenario", "contestant")


@admin.register(GenerationJob)
class GenerationJobAdmin(ReadOnlyRows, admin.ModelAdmin):
    """Jobs; they are launched, cancelled and retried on their own pages."""

    list_display = ("name", "state", "launched_by", "created_at", "finished_at")
    list_filter = ("state",)
    list_select_related = ("launched_by",)
    date_hierarchy = "created_at"
    inlines = (AugmentationInline,)


class AttemptInline(ReadOnlyRows, admin.TabularInline):
    """The tries at an augmentation."""

    model = Attempt
    extra = 0
    show_change_link = True


@admin.register(Augmentation)
class AugmentationAdmin(ReadOnlyRows, admin.ModelAdmin):
    """Augmentations; only workers write them."""

    list_display = ("code", "scenario", "contestant", "state", "finished_at")
    list_filter = ("state", "contestant")
    list_select_related = ("scenario", "contestant")
    search_fields = ("code", "scenario__slug", "contestant__slug", "reason")
    inlines = (AttemptInline,)


class ModelCallInline(ReadOnlyRows, admin.TabularInline):
    """The calls of an attempt, without their long texts."""

    model = ModelCall
    fields = ("number", "role", "finish_reason", "prompt_tokens", "completion_tokens", "fault")
    extra = 0
    show_change_link = True


@admin.register(Attempt)
class AttemptAdmin(ReadOnlyRows, admin.ModelAdmin):
    """Attempts."""

    list_display = ("augmentation", "number", "worker", "started_at", "finished_at", "outcome")
    list_filter = ("outcome",)
    list_select_related = ("augmentation",)
    inlines = (ModelCallInline,)


@admin.register(ModelCall)
class ModelCallAdmin(ReadOnlyRows, admin.ModelAdmin):
    """Calls to language models, with the raw answers."""

    list_display = ("code", "role", "model_returned", "finish_reason", "started_at", "latency_s")
    list_filter = ("role", "finish_reason", "model_returned")
    search_fields = ("code", "answer", "fault")


@admin.register(Event)
class EventAdmin(ReadOnlyRows, admin.ModelAdmin):
    """The log."""

    list_display = ("at", "actor", "verb", "object_kind", "object_code")
    list_filter = ("verb", "object_kind")
    list_select_related = ("actor",)
    search_fields = ("object_code", "actor__username")
    date_hierarchy = "at"
