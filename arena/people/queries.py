"""Accounts, roles and preferences, and the rights of their links and tokens."""

import re
from typing import Any

from django.contrib.auth.backends import ModelBackend
from django.contrib.auth.models import User
from django.db.models import Q, QuerySet

from arena.models import Person
from arena.shell.accounts import top_role


class AccountBackend(ModelBackend):
    """Django's accounts and passwords; who is signed in is loaded with person and roles."""

    def get_user(self, user_id: Any) -> User | None:
        """Return the account of a session, None where it is gone or not active."""
        accounts = User.objects.select_related("person").prefetch_related("groups")
        user = next(iter(accounts.filter(pk=user_id)), None)
        return user if user is not None and self.user_can_authenticate(user) else None


def experts() -> QuerySet[User]:
    """Return active accounts that can be asked to vote: experts who are no researchers or admins.

    Those may know which contestant made what, and their role opens no voting page. Who enrolled
    by a link for one study is asked for that one alone.
    """
    accounts = User.objects.filter(
        is_active=True, is_superuser=False, groups__name="expert", enrolled=None
    )
    accounts = accounts.exclude(groups__name__in=("admin", "researcher")).exclude(person=None)
    return accounts.select_related("person")


def may_be_let_in(user: User) -> bool:
    """Return whether a link may sign this account in: an active expert, nothing more."""
    return top_role(user) == "expert" and not user.person.is_simulated


def by_pseudonym(accounts: QuerySet[User]) -> list[User]:
    """Return accounts with a person, Expert 2 before Expert 10."""
    return sorted(accounts, key=lambda user: natural_order(user.person.pseudonym))


def natural_order(name: str) -> list[tuple[bool, int, str]]:
    """Return a sort key of a name in which numbers count as numbers."""
    parts = re.split(r"(\d+)", name)
    return [(part.isdecimal(), int(part) if part.isdecimal() else 0, part) for part in parts]


def find_admins() -> QuerySet[User]:
    """Return who can administrate."""
    ruling = Q(is_superuser=True) | Q(groups__name="admin")
    return User.objects.filter(ruling, is_active=True).distinct()


def has_admin() -> bool:
    """Return whether anybody can administrate."""
    return find_admins().exists()


def forgotten_name(person: Person) -> str:
    """Return the username of an account whose identity was forgotten; nobody else has it."""
    return f"gone-{person.code.hex[:12]}"


def is_forgotten(user: User) -> bool:
    """Return whether the identity of an account was forgotten; it stays so."""
    return user.username == forgotten_name(user.person)
