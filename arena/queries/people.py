"""Who somebody is."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass

from django.contrib.auth.models import AnonymousUser, User
from django.db.models import Q, QuerySet

from arena.models import Person

ROLES = ("admin", "analyst", "expert")
"""The groups of accounts, the most powerful first."""


def role_of(user: User | AnonymousUser) -> str | None:
    """The most powerful role of an account, None without one.

    Whoever came by an API token has the token's role. Costs a query, but for the account of the
    request (`arena.queries.accounts`).
    """
    if not user.is_authenticated or not user.is_active:
        return None
    if hasattr(user, "token_role"):
        role: str = user.token_role
        return role
    groups = getattr(user, "role_names", None)
    if groups is None and not user.is_superuser:
        groups = {group.name for group in user.groups.all()}
    return _highest(user, groups or ())


def role_given(user: User) -> str | None:
    """The same whether or not the account is paused; its groups are fetched before."""
    return _highest(user, {group.name for group in user.groups.all()})


def experts() -> QuerySet[User]:
    """Active accounts that can be asked to vote: experts who are not analysts or admins too.

    Those may know which contestant made what, and their role opens no voting page. Who enrolled
    by a link for one study is asked for that one alone.
    """
    more = ("admin", "analyst")
    found = User.objects.filter(
        is_active=True, is_superuser=False, groups__name="expert", enrolled=None
    )
    return found.exclude(groups__name__in=more).exclude(person=None).select_related("person")


def by_pseudonym(found: QuerySet[User]) -> list[User]:
    """Accounts with a person, Expert 2 before Expert 10."""
    return sorted(found, key=lambda user: natural_order(user.person.pseudonym))


def natural_order(name: str) -> list[tuple[bool, int, str]]:
    """What to sort names by so that numbers in them count as numbers."""
    parts = re.split(r"(\d+)", name)
    return [(part.isdecimal(), int(part) if part.isdecimal() else 0, part) for part in parts]


def find_admins() -> QuerySet[User]:
    """Who can administrate."""
    ruling = Q(is_superuser=True) | Q(groups__name="admin")
    return User.objects.filter(ruling, is_active=True).distinct()


def has_admin() -> bool:
    """Whether anybody can administrate."""
    return find_admins().exists()


def forgotten_name(person: Person) -> str:
    """The username of an account whose identity was forgotten; nobody else has it."""
    return f"gone-{person.code.hex[:12]}"


def is_forgotten(user: User) -> bool:
    """Whether the identity of an account was forgotten; it stays so."""
    return user.username == forgotten_name(user.person)


@dataclass(frozen=True, slots=True, kw_only=True)
class AccountLine:
    """One account as an admin sees it."""

    user: User
    role: str | None
    has_password: bool
    is_forgotten: bool


def list_accounts() -> list[AccountLine]:
    """Every account, by role and pseudonym; two queries.

    Left out are those that the machine votes for and those that enrolled by a link, which the page
    of their study lists.
    """
    found = User.objects.filter(person__is_simulated=False, enrolled=None)
    found = found.select_related("person")
    lines = []
    for user in found.prefetch_related("groups"):
        lines.append(
            AccountLine(
                user=user,
                role=role_given(user),
                has_password=user.has_usable_password(),
                is_forgotten=is_forgotten(user),
            )
        )
    places = {role: place for place, role in enumerate(ROLES)}
    return sorted(
        lines,
        key=lambda line: (
            places.get(line.role or "", len(places)),
            natural_order(line.user.person.pseudonym),
        ),
    )


# --- Private -----------------------------------------------------------------------------------


def _highest(user: User, groups: Collection[str]) -> str | None:
    if user.is_superuser:
        return "admin"
    return next((role for role in ROLES if role in groups), None)
