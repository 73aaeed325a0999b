"""Django's admin of arena, for rare edits. What was voted and rated can only be read."""

from __future__ import annotations

from typing import Any

from django.contrib import admin
from django.http import HttpRequest

from arena.models import (
    Authorship,
    FaultLabel,
    Invitation,
    LabellingRound,
    Matchup,
    Person,
    Report,
    Snapshot,
    Standing,
    Study,
    Vote,
)


class ReadOnly:
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


@admin.register(Person)
class PersonAdmin(admin.ModelAdmin):
    """Pseudonyms may be mended; who is simulated is fixed when the account is made."""

    list_display = ("pseudonym", "user", "is_simulated")
    list_select_related = ("user",)
    search_fields = ("pseudonym", "user__username")
    readonly_fields = ("user", "code", "is_simulated")

    def has_add_permission(self, request: HttpRequest) -> bool:
        """Accounts are made with their role by the service."""
        return False


@admin.register(Invitation)
class InvitationAdmin(ReadOnly, admin.ModelAdmin):
    """Links are made and taken back on the page of a study's experts."""

    list_display = ("expert", "study", "invited_by", "made_at", "expires_at", "used_at")
    list_select_related = ("expert", "study", "invited_by")
    list_filter = ("study",)
    exclude = ("token_sha256",)


@admin.register(Authorship)
class AuthorshipAdmin(ReadOnly, admin.ModelAdmin):
    """Authors are marked and taken back on the page of a study's experts."""

    list_display = ("expert", "contestant", "study", "marked_by", "marked_at")
    list_select_related = ("expert", "contestant", "study", "marked_by")
    list_filter = ("study",)


@admin.register(Study)
class StudyAdmin(ReadOnly, admin.ModelAdmin):
    """A study's rules are fixed when it opens."""

    list_display = ("name", "state", "votes_per_expert", "allow_simulated", "opened_at")
    list_filter = ("state", "allow_simulated")
    search_fields = ("name",)


@admin.register(Matchup)
class MatchupAdmin(ReadOnly, admin.ModelAdmin):
    """The plan."""

    list_display = ("code", "study", "expert", "position", "scenario", "served_at")
    list_select_related = ("study", "expert", "scenario")
    list_filter = ("study",)
    exclude = ("left_token", "right_token", "original_token")


@admin.register(Vote)
class VoteAdmin(ReadOnly, admin.ModelAdmin):
    """Append-only."""

    list_display = ("key", "expert", "outcome", "is_simulated", "at")
    list_select_related = ("expert",)
    list_filter = ("outcome", "is_simulated", "matchup__study")
    date_hierarchy = "at"


@admin.register(Report)
class ReportAdmin(ReadOnly, admin.ModelAdmin):
    """What experts reported about pairs."""

    list_display = ("matchup", "expert", "reason", "comment", "at")
    list_select_related = ("matchup", "expert")
    list_filter = ("reason", "matchup__study")


class StandingInline(ReadOnly, admin.TabularInline):
    """A snapshot's lines."""

    model = Standing
    extra = 0


@admin.register(Snapshot)
class SnapshotAdmin(ReadOnly, admin.ModelAdmin):
    """Frozen."""

    list_display = ("study", "method", "resampling_unit", "votes_counted", "made_at")
    list_select_related = ("study",)
    inlines = (StandingInline,)


@admin.register(LabellingRound)
class LabellingRoundAdmin(ReadOnly, admin.ModelAdmin):
    """The plan of a labelling is fixed when it opens."""

    list_display = ("name", "job", "seed", "opened_at")
    list_select_related = ("job",)


@admin.register(FaultLabel)
class FaultLabelAdmin(ReadOnly, admin.ModelAdmin):
    """What experts said; a label is never changed."""

    list_display = ("augmentation", "expert", "position", "heading", "logic", "at")
    list_select_related = ("augmentation", "expert")
    list_filter = ("position", "heading", "logic")
    exclude = ("task",)
