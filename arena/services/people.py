"""Accounts with a role and a pseudonym."""

from __future__ import annotations

from django.contrib.auth.models import Group, User
from django.core.exceptions import ValidationError
from django.db import IntegrityError, transaction

from arena.errors import NotYours
from arena.models import Person, Study
from arena.queries.people import ROLES
from arena.results.queries.access import votes_in
from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.services.events import log_event
from augment.services.texts import one_line


@transaction.atomic
def create_person(
    *,
    username: str,
    password: str | None,
    role: str,
    pseudonym: str | None = None,
    is_simulated: bool = False,
    actor: User | None = None,
) -> User:
    """Make an account; an admin may enter Django's admin too.

    Args:
        username: For the login.
        password: None for an account that nobody can log in to by password.
        role: "expert", "analyst" or "admin".
        pseudonym: What others see instead of the name; "Expert 3" and so on by default.
        is_simulated: The machine votes for it, and everything that comes of it says so.
        actor: Who makes the account, for the log.

    Raises:
        UnknownName: There is no such role.
        InvalidDocument: The username or the pseudonym is empty, too long or has other signs.
        Conflict: The username or the pseudonym is taken.
    """
    if role not in ROLES:
        raise UnknownName("role", role, list(ROLES))
    _check_username(username)
    if pseudonym is not None:
        pseudonym = one_line("pseudonym", pseudonym, what="person", longest=60)
    if User.objects.filter(username=username).exists():
        raise Conflict(f"The username {username!r} is taken.")
    if pseudonym is None:
        pseudonym = _free_pseudonym(role)
    elif Person.objects.filter(pseudonym=pseudonym).exists():
        raise Conflict(f"The pseudonym {pseudonym!r} is taken.")
    is_admin = role == "admin"
    try:
        with transaction.atomic():
            user = User.objects.create_user(
                username, password=password, is_staff=is_admin, is_superuser=is_admin
            )
            person = user.person
            person.pseudonym, person.is_simulated = pseudonym, is_simulated
            person.save(update_fields=["pseudonym", "is_simulated"])
    except IntegrityError:  # somebody else was faster
        raise Conflict(
            f"The username {username!r} or the pseudonym {pseudonym!r} was taken just now; try "
            "again."
        ) from None
    user.groups.add(Group.objects.get_or_create(name=role)[0])
    log_event(
        actor=actor,
        verb="add",
        object_kind="person",
        object_code=person.code,
        after={"role": role, "is_simulated": is_simulated},
    )
    return user


def must_take_part(*, study: Study, expert: User) -> None:
    """Refuse an account that is no expert of the study.

    Raises:
        NotYours: It does not take part.
    """
    if not votes_in(expert, study):
        raise NotYours(f"{expert.get_username()} does not take part in '{study.name}'.")


def _check_username(username: str) -> None:
    """Raise InvalidDocument for a name that Django's own forms would refuse."""
    try:
        User._meta.get_field("username").clean(username, None)
    except ValidationError as error:
        raise InvalidDocument("person", [("username", " ".join(error.messages))]) from None


def _free_pseudonym(role: str) -> str:
    number = Person.objects.filter(user__groups__name=role).count() + 1
    while Person.objects.filter(pseudonym=f"{role.capitalize()} {number}").exists():
        number += 1
    return f"{role.capitalize()} {number}"
