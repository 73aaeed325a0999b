"""Studies and what came of them in Django's admin, to be read alone.

What an open study has brought so far is shown to those alone who opened its results early on its
own page, which the log keeps: see arena.results.services.ratings.
"""

from __future__ import annotations

from typing import Any, ClassVar

from django.contrib import admin, messages
from django.db.models import Model
from django.http import HttpRequest, HttpResponse

from arena.models import (
    Authorship,
    FaultLabel,
    Invitation,
    LabellingRound,
    Matchup,
    Report,
    Snapshot,
    Standing,
    Study,
    Vote,
)
from arena.results.queries.access import unread_studies
from arena.site.access import user_of


class ReadOnly:
    """Rows that nobody adds, changes or deletes by hand."""

    def has_add_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """Never."""
        return False

    has_change_permission = has_delete_permission = has_add_permission


class ReadOnlyAdmin(ReadOnly, admin.ModelAdmin):
    """A page of such rows."""


class OfReadStudies(ReadOnlyAdmin):
    """Rows that tell how a study goes: while it is open, only for who opened its results early."""

    study_path: ClassVar[str] = "study"

    def get_queryset(self, request: HttpRequest) -> Any:
        """Leave out what must not be seen yet, whatever page, filter or search asks for it."""
        unread = unread_studies(user_of(request))
        return super().get_queryset(request).exclude(**{f"{self.study_path}__in": unread})

    def changelist_view(self, request: HttpRequest, extra_context: Any = None) -> HttpResponse:
        """Show the list, which says what it leaves out."""
        names = list(unread_studies(user_of(request)).values_list("name", flat=True))
        if names:
            text = (
                f"Not shown here: what belongs to {', '.join(names)}. A study that is open shows "
                "its results on its own page, to those who open them early; the log keeps who did."
            )
            messages.info(request, text)
        return super().changelist_view(request, extra_context)


class StandingInline(ReadOnly, admin.TabularInline):
    """A snapshot's lines."""

    model = Standing
    extra = 0


PAGES: dict[type[Model], dict[str, Any]] = {
    Invitation: {
        "list_display": ("expert", "study", "invited_by", "made_at", "expires_at", "used_at"),
        "list_select_related": ("expert", "study", "invited_by"),
        "list_filter": ("study",),
        "exclude": ("token_sha256",),
    },
    Authorship: {
        "list_display": ("expert", "contestant", "study", "marked_by", "marked_at"),
        "list_select_related": ("expert", "contestant", "study", "marked_by"),
        "list_filter": ("study",),
    },
    Study: {
        "list_display": ("name", "state", "votes_per_expert", "allow_simulated", "opened_at"),
        "list_filter": ("state", "allow_simulated"),
        "search_fields": ("name",),
    },
    Report: {
        "list_display": ("matchup", "expert", "reason", "side", "comment", "at"),
        "list_select_related": ("matchup", "expert"),
        "list_filter": ("reason", "matchup__study"),
    },
    LabellingRound: {
        "list_display": ("name", "job", "seed", "opened_at"),
        "list_select_related": ("job",),
    },
    FaultLabel: {
        "list_display": ("augmentation", "expert", "position", "heading", "logic", "at"),
        "list_select_related": ("augmentation", "expert"),
        "list_filter": ("position", "heading", "logic"),
        "exclude": ("task",),
    },
}
GUARDED: dict[type[Model], dict[str, Any]] = {
    Matchup: {
        "list_display": ("code", "study", "expert", "position", "scenario", "served_at"),
        "list_select_related": ("study", "expert", "scenario"),
        "list_filter": ("study",),
        "exclude": ("left_token", "right_token", "original_token"),
    },
    Vote: {
        "study_path": "matchup__study",
        "list_display": ("key", "expert", "outcome", "is_simulated", "at"),
        "list_select_related": ("expert",),
        "list_filter": ("outcome", "is_simulated", "matchup__study"),
        "date_hierarchy": "at",
    },
    Snapshot: {
        "list_display": ("study", "method", "resampling_unit", "votes_counted", "made_at"),
        "list_select_related": ("study",),
        "inlines": (StandingInline,),
    },
}
"""What tells how a study stands: also, in an adaptive part, what is shown how often."""

for model, options in PAGES.items():
    admin.site.register(model, ReadOnlyAdmin, **options)
for model, options in GUARDED.items():
    admin.site.register(model, OfReadStudies, **options)
