"""Accounts and roles in Django's admin: nothing made or edited here may break a page.

Names stay once they are given, because plans of studies hold them; who leaves is deactivated,
because what they judged stays.
"""

from __future__ import annotations

from typing import Any

from django.contrib import admin
from django.contrib.auth.admin import GroupAdmin, UserAdmin
from django.contrib.auth.models import Group, User
from django.http import HttpRequest

from arena.models import Person
from arena.people.queries import ROLES
from augment.services.events import log_event


class PersonInline(admin.StackedInline):
    """The person of an account; it comes with the account and goes with nothing."""

    model = Person
    fields = ("pseudonym", "code", "is_simulated")
    readonly_fields = ("code", "is_simulated")
    can_delete = False
    max_num = 0  # no further one


class AccountAdmin(UserAdmin):
    """Accounts; a new one gets its person by itself and its role from the groups."""

    list_display = ("username", "roles", "is_active", "is_staff", "last_login")
    list_filter = ("groups", "is_active", "is_staff", "is_superuser")
    inlines = (PersonInline,)

    def get_queryset(self, request: HttpRequest) -> Any:
        """With the groups of a line, in one query more."""
        return super().get_queryset(request).prefetch_related("groups")

    @admin.display(description="groups")
    def roles(self, account: User) -> str:
        """The names of its groups."""
        return ", ".join(sorted(group.name for group in account.groups.all()))

    def get_inlines(self, request: HttpRequest, obj: Any) -> Any:
        """A new account has no person yet to show."""
        return () if obj is None else self.inlines

    def get_readonly_fields(self, request: HttpRequest, obj: Any = None) -> Any:
        """Plans name experts by it."""
        return () if obj is None else ("username", "last_login", "date_joined")

    def has_delete_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """Never: an account that leaves is made inactive."""
        return False

    def save_model(self, request: HttpRequest, obj: Any, form: Any, change: bool) -> None:
        """Remember how it was, for the log."""
        form.before = _facts(User.objects.get(pk=obj.pk)) if change else None
        super().save_model(request, obj, form, change)

    def save_related(self, request: HttpRequest, form: Any, formsets: Any, change: bool) -> None:
        """Log the account with its groups, before and after."""
        super().save_related(request, form, formsets, change)
        account = User.objects.get(pk=form.instance.pk)
        log_event(
            actor=request.user,  # type: ignore[arg-type]
            verb="change" if change else "add",
            object_kind="person",
            object_code=account.person.code,
            before=form.before,
            after=_facts(account),
        )


class RoleAdmin(GroupAdmin):
    """Groups; those that are roles keep their names and stay."""

    def get_readonly_fields(self, request: HttpRequest, obj: Any = None) -> Any:
        """Pages know roles by their names."""
        return ("name",) if obj is not None and obj.name in ROLES else ()

    def has_delete_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """Only other groups, one by one."""
        return obj is not None and obj.name not in ROLES


@admin.register(Person)
class PersonAdmin(admin.ModelAdmin):
    """Pseudonyms may be mended; who is simulated is fixed when the account is made."""

    list_display = ("pseudonym", "user", "is_simulated")
    list_select_related = ("user",)
    search_fields = ("pseudonym", "user__username")
    fields = ("pseudonym", "user", "code", "is_simulated")
    readonly_fields = ("user", "code", "is_simulated")

    def has_add_permission(self, request: HttpRequest) -> bool:
        """A person comes with its account."""
        return False

    def has_delete_permission(self, request: HttpRequest, obj: Any = None) -> bool:
        """Never: pages name people by it."""
        return False


def _facts(account: User) -> dict[str, object]:
    """What the log keeps of an account."""
    return {
        "groups": sorted(account.groups.values_list("name", flat=True)),
        "is_active": account.is_active,
        "is_staff": account.is_staff,
        "is_superuser": account.is_superuser,
    }


admin.site.unregister(User)
admin.site.unregister(Group)
admin.site.register(User, AccountAdmin)
admin.site.register(Group, RoleAdmin)
