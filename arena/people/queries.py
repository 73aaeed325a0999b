"""Accounts, roles and preferences, and the rights of their links and tokens."""

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from django.contrib.auth.backends import ModelBackend
from django.contrib.auth.models import AnonymousUser, User
from django.db.models import Q, QuerySet

from arena.models import Person

ROLES = ("admin", "researcher", "expert", "entrant")
"""The groups of accounts, the most powerful first. Entrants submit systems and never vote."""

TOKEN_ROLES = {"admin": ROLES[:2], **{role: (role,) for role in ROLES[1:]}}
"""The roles that a token may have, by the role of its owner. Staff know too much to vote, so
that theirs is never an expert's."""


class AccountBackend(ModelBackend):
    """Django's accounts and passwords; who is signed in is loaded with person and roles."""

    def get_user(self, user_id: Any) -> User | None:
        """Return the account of a session, None where it is gone or not active."""
        accounts = User.objects.select_related("person").prefetch_related("groups")
        user = next(iter(accounts.filter(pk=user_id)), None)
        return user if user is not None and self.user_can_authenticate(user) else None


def top_role(user: User | AnonymousUser) -> str | None:
    """Return the most powerful role of an account, None without one.

    Whoever came by an API token has the token's role.
    """
    if not user.is_authenticated or not user.is_active:
        return None
    role: str | None = getattr(user, "token_role", None)
    return role or role_given(user)


def role_given(user: User) -> str | None:
    """Return the same whether or not the account is paused."""
    if user.is_superuser:
        return "admin"
    names = {group.name for group in user.groups.all()}
    return next((role for role in ROLES if role in names), None)


def effective_role(role: str, owner_role: str | None) -> str | None:
    """Return the role that a token of `role` has now, None if its owner no longer has it.

    An admin's token opens what a researcher may once its owner is one.
    """
    if role in TOKEN_ROLES.get(owner_role or "", ()):
        return role
    return "researcher" if (role, owner_role) == ("admin", "researcher") else None


def experts() -> QuerySet[User]:
    """Return active accounts that can be asked to vote: experts who are no researchers or admins.

    Those may know which contestant made what, and their role opens no voting page. Who enrolled
    by a link for one study is asked for that one alone.
    """
    found = User.objects.filter(
        is_active=True, is_superuser=False, groups__name="expert", enrolled=None
    )
    found = found.exclude(groups__name__in=("admin", "researcher")).exclude(person=None)
    return found.select_related("person")


def may_be_let_in(user: User) -> bool:
    """Return whether a link may sign this account in: an active expert, nothing more."""
    return top_role(user) == "expert" and not user.person.is_simulated


def by_pseudonym(found: QuerySet[User]) -> list[User]:
    """Return accounts with a person, Expert 2 before Expert 10."""
    return sorted(found, key=lambda user: natural_order(user.person.pseudonym))


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


class Theme(StrEnum):
    """Colours of the pages for a person; `auto` follows the device."""

    AUTO = "auto"
    LIGHT = "light"
    DARK = "dark"


class Language(StrEnum):
    """A language that the pages have; each is called by its own name."""

    EN = "en"
    DE = "de"

    @property
    def label(self) -> str:
        """Name of the language in itself."""
        return {"en": "English", "de": "Deutsch"}[self.value]


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Name, role and preferences of somebody who is signed in."""

    name: str
    role: str | None
    theme: Theme


def frame_profile(user: User | AnonymousUser) -> Profile | None:
    """Return the account as the page's frame shows it; None if nobody is signed in."""
    if not user.is_authenticated:
        return None
    person: Person | None = getattr(user, "person", None)
    stored = person.preferences.get("theme") if person else None
    return Profile(
        name=person.pseudonym if person else user.get_username(),
        role=top_role(user),
        theme=Theme(stored) if stored in set(Theme) else Theme.AUTO,
    )


def chosen_language(user: User) -> Language | None:
    """Return the language that a person chose; None follows the browser."""
    person: Person | None = getattr(user, "person", None)
    stored = person.preferences.get("language") if person else None
    return Language(stored) if stored in set(Language) else None
