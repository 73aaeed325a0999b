"""What the frame of every page says about the person who looks at it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from django.contrib.auth.models import AnonymousUser, User

from arena.models import Person
from arena.queries.people import role_of


class Theme(StrEnum):
    """How the pages look to a person; `auto` follows the device."""

    AUTO = "auto"
    LIGHT = "light"
    DARK = "dark"


class Language(StrEnum):
    """A language that the pages have; each is called by its own name."""

    EN = "en"
    DE = "de"

    @property
    def label(self) -> str:
        """What its speakers call it."""
        return {"en": "English", "de": "Deutsch"}[self.value]


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Name, role and preferences of somebody who is signed in."""

    name: str
    role: str | None
    theme: Theme


def profile_of(user: User | AnonymousUser) -> Profile | None:
    """What the page's frame shows of a person; None for somebody who is not signed in."""
    if not user.is_authenticated:
        return None
    person = Person.objects.filter(user=user).first()
    stored = person.preferences.get("theme") if person else None
    return Profile(
        name=person.pseudonym if person else user.get_username(),
        role=role_of(user),
        theme=Theme(stored) if stored in set(Theme) else Theme.AUTO,
    )


def language_of(user: User) -> Language | None:
    """The language that a person chose; None follows the browser."""
    person = Person.objects.filter(user=user).only("preferences").first()
    stored = person.preferences.get("language") if person else None
    return Language(stored) if stored in set(Language) else None
