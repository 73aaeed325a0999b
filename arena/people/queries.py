"""Who somebody is."""

import re
from collections.abc import Collection
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from django.contrib.auth.backends import ModelBackend
from django.contrib.auth.models import AnonymousUser, User
from django.db.models import Q, QuerySet
from django.utils import timezone

from arena.errors import NotYours
from arena.models import ApiToken, Invitation, Person, token_digest

ROLES = ("admin", "analyst", "expert")
"""The groups of accounts, the most powerful first."""


def role_of(user: User | AnonymousUser) -> str | None:
    """The most powerful role of an account, None without one.

    Whoever came by an API token has the token's role. Costs a query, but for the account of the
    request (`arena.people.queries`).
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


_ACCOUNT = """
SELECT account.*, auth_group.name AS role
FROM auth_user account
LEFT JOIN auth_user_groups ON auth_user_groups.user_id = account.id
LEFT JOIN auth_group ON auth_group.id = auth_user_groups.group_id
WHERE account.id = %(id)s
"""


class AccountBackend(ModelBackend):
    """Django's accounts and passwords; who is signed in is loaded by one query with the roles."""

    def get_user(self, user_id: Any) -> User | None:
        """The account of a session, None where it is gone or not active.

        Its `role_names` hold the names of its groups for `role_of`, as of this request.
        """
        rows: list[Any] = list(User.objects.raw(_ACCOUNT, {"id": user_id}))
        if not rows or not self.user_can_authenticate(rows[0]):
            return None
        user = rows[0]
        user.role_names = frozenset(row.role for row in rows)
        return user  # type: ignore[no-any-return]


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


OFFERED = {"admin": ("admin", "analyst"), "analyst": ("analyst",), "expert": ("expert",)}
"""The roles that a token may have, by the role of its owner. Staff know too much to vote, so
that theirs is never an expert's."""


def roles_offered(user: User) -> tuple[str, ...]:
    """The roles that a new token of this account may have, the most powerful first."""
    return OFFERED.get(role_of(user) or "", ())


def effective_role(role: str, owner_role: str | None) -> str | None:
    """What a token of that role opens while its owner has that role, None for nothing.

    An admin's token opens what an analyst may once its owner is one.
    """
    offered = OFFERED.get(owner_role or "", ())
    if role in offered:
        return role
    return "analyst" if (role, owner_role) == ("admin", "analyst") else None


def api_tokens_of(user: User) -> list[tuple[ApiToken, ApiToken.State]]:
    """The tokens of an account with their states, the newest first; one query."""
    now = timezone.now()
    return [(token, token.state(now)) for token in ApiToken.objects.filter(owner=user)]


def api_token_by_secret(secret: str) -> ApiToken | None:
    """The token that reads so, with its owner; None where there is none that works."""
    now = timezone.now()
    rows = ApiToken.objects.select_related("owner")
    token = rows.filter(token_sha256=token_digest(secret)).first()
    if token is None or not token.owner.is_active:
        return None
    return token if token.state(now) is ApiToken.State.ALIVE else None


def may_be_let_in(user: User) -> bool:
    """Whether a link may sign this account in: an active expert, nothing more, no machine."""
    return role_of(user) == "expert" and not user.person.is_simulated


def invitation_by_token(token: str, *, locked: bool = False) -> Invitation:
    """The invitation whose link carries this token, whatever its state.

    Raises:
        NotYours: There is none.
    """
    rows = Invitation.objects.select_related("study", "expert__person", "invited_by")
    if locked:
        rows = rows.select_for_update(of=("self",))
    invitation = rows.filter(token_sha256=token_digest(token)).first()
    if invitation is None:
        raise NotYours("No invitation has this address.")
    return invitation
