"""Roles and preferences of accounts, and those of whoever is signed in."""

from dataclasses import dataclass
from enum import StrEnum

from django.contrib.auth.models import AnonymousUser, User

from arena.models import Person

ROLES = ("admin", "researcher", "expert", "entrant")
"""The groups of accounts, the most powerful first. Entrants submit systems and never vote."""


TOKEN_ROLES = {"admin": ROLES[:2], **{role: (role,) for role in ROLES[1:]}}
"""The roles that a token may have, by the role of its owner. Staff know too much to vote, so
that theirs is never an expert's."""


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


def find_language(user: User) -> Language | None:
    """Return the language that a person chose; None follows the browser."""
    person: Person | None = getattr(user, "person", None)
    stored = person.preferences.get("language") if person else None
    return Language(stored) if stored in set(Language) else None
