"""Studies and what came of them in Django's admin, to be read alone.

What an open study has brought so far is shown to those alone who opened its results early on its
own page, which the log keeps: see arena.results.services.ratings.
"""

from __future__ import annotations

from typing import Any, ClassVar

from django.contrib import admin, messages
from django.contrib.auth.models import User
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


class ReadOnlyStudies:
    """Rows that nobody adds, changes or deletes by hand."""

    def has_add_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """Never."""
        return False

    def has_change_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """Never."""
        return False

    def has_delete_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """Never."""
        return False


class OfReadStudies(ReadOnlyStudies):
    """Rows that tell how a study goes: while it is open, only for who opened its results early."""

    study_path: ClassVar[str] = "study"

    def get_queryset(self, request: HttpRequest) -> Any:
        """Without what must not be seen yet, whatever page, filter or search asks for it."""
        rows = super().get_queryset(request)  # type: ignore[misc]
        unread = unread_studies(_account(request))
        return rows.exclude(**{f"{self.study_path}__in": unread})

    def changelist_view(self, request: HttpRequest, extra_context: Any = None) -> HttpResponse:
        """The list, which says what it leaves out."""
        names = list(unread_studies(_account(request)).values_list("name", flat=True))
        if names:
            text = (
                f"Not shown here: what belongs to {', '.join(names)}. A study that is open shows "
                "its results on its own page, to those who open them early; the log keeps who did."
            )
            messages.info(request, text)
        return super().changelist_view(request, extra_context)  # type: ignore[misc,no-any-return]


def _account(request: HttpRequest) -> User:
    assert isinstance(request.user, User)
    return request.user


@admin.register(Invitation)
class InvitationAdmin(ReadOnlyStudies, admin.ModelAdmin):
    """Links are made and taken back on the page of a study's experts."""

    list_display = ("expert", "study", "invited_by", "made_at", "expires_at", "used_at")
    list_select_related = ("expert", "study", "invited_by")
    list_filter = ("study",)
    exclude = ("token_sha256",)


@admin.register(Authorship)
class AuthorshipAdmin(ReadOnlyStudies, admin.ModelAdmin):
    """Authors are marked and taken back on the page of a study's experts."""

    list_display = ("expert", "contestant", "study", "marked_by", "marked_at")
    list_select_related = ("expert", "contestant", "study", "marked_by")
    list_filter = ("study",)


@admin.register(Study)
class StudyAdmin(ReadOnlyStudies, admin.ModelAdmin):
    """A study's rules are fixed when it opens."""

    list_display = ("name", "state", "votes_per_expert", "allow_simulated", "opened_at")
    list_filter = ("state", "allow_simulated")
    search_fields = ("name",)


@admin.register(Matchup)
class MatchupAdmin(OfReadStudies, admin.ModelAdmin):
    """The plan: what is shown how often tells, in an adaptive part, how it stands."""

    list_display = ("code", "study", "expert", "position", "scenario", "served_at")
    list_select_related = ("study", "expert", "scenario")
    list_filter = ("study",)
    exclude = ("left_token", "right_token", "original_token")


@admin.register(Vote)
class VoteAdmin(OfReadStudies, admin.ModelAdmin):
    """Append-only."""

    study_path = "matchup__study"

    list_display = ("key", "expert", "outcome", "is_simulated", "at")
    list_select_related = ("expert",)
    list_filter = ("outcome", "is_simulated", "matchup__study")
    date_hierarchy = "at"


@admin.register(Report)
class ReportAdmin(ReadOnlyStudies, admin.ModelAdmin):
    """What experts reported about pairs."""

    list_display = ("matchup", "expert", "reason", "side", "comment", "at")
    list_select_related = ("matchup", "expert")
    list_filter = ("reason", "matchup__study")


class StandingInline(ReadOnlyStudies, admin.TabularInline):
    """A snapshot's lines."""

    model = Standing
    extra = 0


@admin.register(Snapshot)
class SnapshotAdmin(OfReadStudies, admin.ModelAdmin):
    """Frozen."""

    list_display = ("study", "method", "resampling_unit", "votes_counted", "made_at")
    list_select_related = ("study",)
    inlines = (StandingInline,)


@admin.register(LabellingRound)
class LabellingRoundAdmin(ReadOnlyStudies, admin.ModelAdmin):
    """The plan of a labelling is fixed when it opens."""

    list_display = ("name", "job", "seed", "opened_at")
    list_select_related = ("job",)


@admin.register(FaultLabel)
class FaultLabelAdmin(ReadOnlyStudies, admin.ModelAdmin):
    """What experts said; a label is never changed."""

    list_display = ("augmentation", "expert", "position", "heading", "logic", "at")
    list_select_related = ("augmentation", "expert")
    list_filter = ("position", "heading", "logic")
    exclude = ("task",)
